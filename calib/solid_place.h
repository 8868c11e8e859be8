/* solid_place.h -- a cylinder or a mesh placed by its outline in all photographs. Internal to
 * calib/. */
#ifndef GONIOCAM_SOLID_PLACE_H
#define GONIOCAM_SOLID_PLACE_H

#include "contour.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Where a sample was before any photograph was looked at, and how far from there it may be. */
struct solid_prior {
    vec3 turned, shifted;         // by how much it has been moved since
    double radius, radius_sigma;  // nominal
    bool free_radius;             // a cylinder's radius is fitted too
    bool free_size;               // a mesh's, as the radius of its ball
};

/** One robust step towards the edges ([count], views counted in `views`): moves *sample, and fills
 *  its sigmas, outline_rms_px and outline_edges. mm_per_px: of the photographs, at the sample.
 *  STATUS_DATA: too few edges; STATUS_MEMORY. */
enum status cal_solid_fit(struct sample *sample, struct solid_prior *prior,
                          const struct contour_edge *edge, int count, int views, double mm_per_px,
                          struct error *err);

/** prior: radius and radius_sigma as capture.yaml has them, else 0.
 *  Put the sample of *calibration, which stands at its nominal place, where its outline is to a
 *  pixel in OUT/radiance/SHOT.exr of all views. *sure: as cal_sphere_start(). */
enum status cal_solid_start(bool *sure, struct solid_prior *prior, struct calibration *calibration,
                            const char *out, struct run *run, struct error *err);
/** Then to a hundredth of a pixel; and is it that shape: as cal_sphere_place and cal_sphere_check.
 */
enum status cal_solid_place(struct contour_edge **edges, int *count, struct solid_prior *prior,
                            struct calibration *calibration, const char *out, struct run *run,
                            struct error *err);
/** Warn of a mesh that another size would fit better, with the `scale` of its file that does. */
enum status cal_mesh_size_check(const struct calibration *calibration, const char *out,
                                struct run *run, struct error *err);
enum status cal_solid_check(const struct calibration *calibration, const struct contour_edge *edges,
                            int count, struct run *run, struct error *err);

#ifdef __cplusplus
}
#endif
#endif
