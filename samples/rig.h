/* rig.h -- cameras, lamps, sample and tags as a plan needs them: from a scene or from a result. */
#ifndef GONIOCAM_SAMPLES_RIG_H
#define GONIOCAM_SAMPLES_RIG_H

#include "scene.h"

/** A tag, as a plan knows it: its corners in the world. */
struct rig_tag {
    vec3 corner[4];
};

/** What stands where. Owns everything below it; {0} is empty; release with sam_rig_free(). */
struct rig {
    struct calibration calibration;  // views: the shots that are there already
    struct rig_tag *tag;             // [tags]
    int tags;
};

/** From SCENE.yaml. Statuses of sam_scene_read. */
enum status sam_rig_of_scene(struct rig *rig, const char *path, struct error *err);
/** From OUT/calibration.yaml: tags stand where their corners in the photographs say. Statuses of
 *  cal_calibration_read. */
enum status sam_rig_of_result(struct rig *rig, const char *out, struct error *err);
void sam_rig_free(struct rig *rig);

#endif
