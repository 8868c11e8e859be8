/* sphere.h -- a sphere placed by its outline in all photographs. Internal to calib/. */
#ifndef GONIOCAM_SPHERE_H
#define GONIOCAM_SPHERE_H

#include "outline.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Fit centre and radius to edges ([count]) in the calibrated views, from sample->center and
 *  ->radius as start and (the radius, to sigma_radius; 0 holds it) as prior. Fills center,
 *  radius, their sigmas, outline_rms_px and outline_edges (those that were used). Needs only
 *  cameras and views of the calibration. STATUS_DATA: the edges do not determine the centre. */
enum status cal_sphere_fit(struct sample *sample, const struct calibration *calibration,
                           const struct edge *edge, int count, struct error *err);

/** Put the sphere of *calibration where its outline is to a pixel, from a place nearby. Reads
 *  OUT/radiance/SHOT.exr of all its views. *sure: false where what was found looks like no outline
 *  (STRAYING). */
enum status cal_sphere_start(bool *sure, struct calibration *calibration,
                             const struct capture *capture, const char *out, struct run *run,
                             struct error *err);
/** Then to a hundredth of a pixel. Where lamps are known, edges of light are told from the
 *  sphere's. *edges [*count]: all that were found; the caller owns them, also on failure. */
enum status cal_sphere_place(struct edge **edges, int *count, struct calibration *calibration,
                             const struct capture *capture, const char *out, struct run *run,
                             struct error *err);
/** When lamps are better known, other edges are the sphere's: fit these again, from where they had
 *  placed it. *moved: by more than a sigma, and the calibration's sample is there now; else it is
 *  as it was. */
enum status cal_sphere_settle(bool *moved, struct calibration *calibration,
                              const struct sample *placed, const struct capture *capture,
                              const struct edge *edges, int count, struct error *err);
/** Warn of a shape that is no sphere. */
enum status cal_sphere_check(const struct calibration *calibration, const struct edge *edges,
                             int count, struct run *run, struct error *err);

#ifdef __cplusplus
}
#endif
#endif
