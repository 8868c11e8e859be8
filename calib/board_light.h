/* board_light.h -- the lit board as a lamp. Internal to calib/. */
#ifndef GONIOCAM_BOARD_LIGHT_H
#define GONIOCAM_BOARD_LIGHT_H

#include "calib.h"
#include "lobe.h"
#include "photometry.h"

#ifdef __cplusplus
extern "C" {
#endif

/** The board's cells in all photographs: no lamps needed, not even the sample. Owns cell and seen;
 *  {0} is empty; release with cal_board_survey_free(). */
struct board_survey {
    struct glow *cell;  // [cells]; radiance not used
    int cells;
    float *seen;  // [views][cells][3], as in the radiance maps; NAN: outside or too flat
};
/** Look at the board, where cameras and views are known. Reads OUT/radiance/SHOT.exr. On success
 *  the caller owns *survey. */
enum status cal_board_survey(struct board_survey *survey, const struct calibration *calibration,
                             const struct capture *capture, const char *out, struct run *run,
                             struct error *err);
void cal_board_survey_free(struct board_survey *survey);

/** The board under each lamp: fills calibration->surroundings. Needs views with power, vignetting,
 *  lamps and sample. */
enum status cal_board_light(struct calibration *calibration, const struct board_survey *survey,
                            struct run *run, struct error *err);

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
