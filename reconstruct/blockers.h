/* blockers.h -- what stands between sample, lamp and camera. */
#ifndef GONIOCAM_BLOCKERS_H
#define GONIOCAM_BLOCKERS_H

#include "calib.h"

/** A solid that capture.yaml declares under `occluders`, or a ball (of: NULL). */
struct blocker {
    const struct occluder *of;
    mat3 box_from_world;  // of a box: its axes
    struct mesh *mesh;    // of a mesh
    vec3 center;          // of a ball
    double radius;
};
/** All of them. Owns blocker and the meshes; {0} is empty; rec_blockers_free(). */
struct blockers {
    struct blocker *blocker;
    int count;
};

/** The capture must outlive them. Balls are where the calibration has them, or else where the
 *  capture has. STATUS_MEMORY; those of cal_mesh_read. */
enum status rec_blockers_make(struct blockers *blockers, const struct capture *capture,
                              const struct calibration *calibration, struct error *err);
void rec_blockers_free(struct blockers *blockers);

/** Does the segment from a to b come within `margin` mm of one? Of a mesh the margin is not kept.
 */
bool rec_blocked(const struct blockers *blockers, vec3 a, vec3 b, double margin);

#endif
