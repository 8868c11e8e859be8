/* board_light.h -- the lit board as a lamp. Internal to calib/. */
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
 *  that the lamp does not light, where there are such: then it is told. Else it is 1, as in any
 *  real room. */
enum status cal_board_light_strength(struct calibration *calibration, const struct facets *sample,
                                     struct run *run, struct error *err);

/** cal_bounce in its kinds: by the matte and the glossy part of the sample's reflectance, and what
 *  mirrors in its place would show (not part of cal_bounce). */
void cal_bounce_kinds(const struct calibration *calibration, int view, vec3 point, vec3 normal,
                      vec3 wo, double radiance[ECHOES][3]);

#ifdef __cplusplus
}
#endif
#endif
