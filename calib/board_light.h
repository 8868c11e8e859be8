/* board_light.h -- the lit board as a lamp, and the light that goes between it and the sample.
 * Internal to calib/. */
#ifndef GONIOCAM_BOARD_LIGHT_H
#define GONIOCAM_BOARD_LIGHT_H

#include "calib.h"
#include "lobe.h"
#include "photometry.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Measure the board under each lamp from the photographs: fills calibration->surroundings. Needs
 *  cameras, views with power, lamps and sample. Reads OUT/radiance/SHOT.exr. */
enum status cal_board_light(struct calibration *calibration, const struct capture *capture,
                            const char *out, struct run *run, struct error *err);

/** How much of the predicted light is there: fills strength and its sigma from the sample's facets
 *  that the lamp does not light. */
enum status cal_board_light_strength(struct calibration *calibration, const struct facets *sample,
                                     struct run *run, struct error *err);

/** Did such facets tell it? Else it is 1, as in any real room. */
bool cal_board_light_told(const struct calibration *calibration);

/** cal_bounce by the matte and the glossy part of the sample's reflectance. */
void cal_bounce_parts(const struct calibration *calibration, int view, vec3 point, vec3 normal,
                      vec3 wo, double matte[3], double gloss[3]);

/** Radiance that the board's light has at the SOLID_POINTS of the sample, under each lamp with
 * power 1, by the sample's matte reflectance: light that has been reflected twice when it comes
 * back to the board. *radiance is [lamps SOLID_POINTS][3]; the caller frees it. STATUS_MEMORY. */
enum status cal_twice_bounced(double (**radiance)[3], const struct calibration *calibration,
                              struct run *run, struct error *err);
/** Radiance that the sample, lit by a view's lamp, adds to a matte surface of reflectance 1 at a
 *  point with a normal, by its matte and its glossy part: [3], to be multiplied by the surface's
 *  albedo. twice: of cal_twice_bounced, or NULL. */
void cal_sample_light(const struct calibration *calibration, const double (*twice)[3], int view,
                      vec3 point, vec3 normal, double matte[3], double gloss[3]);

#ifdef __cplusplus
}
#endif
#endif
