/* balls.h -- balls beside the sample, in which the lamps are seen. Internal to calib/. */
#ifndef GONIOCAM_BALLS_H
#define GONIOCAM_BALLS_H

#include "highlight.h"

#ifdef __cplusplus
extern "C" {
#endif

/** The balls of capture.yaml to a pixel of their outlines in OUT/radiance/SHOT.exr: fills ball and
 *  balls. One that is not found near its place is left out, with a warning. */
enum status cal_balls_start(struct calibration *calibration, const struct capture *capture,
                            const char *out, struct run *run, struct error *err);
/** Then to a hundredth of a pixel, with sigmas. */
enum status cal_balls_place(struct calibration *calibration, const struct capture *capture,
                            const char *out, struct run *run, struct error *err);
/** What ball i shows of the lamp in a view, as cal_highlight_lamp(); sigma holds what its centre
 * may be off. false: nothing, or the sample is in the way. */
bool cal_ball_highlight(struct seen_highlight *seen, const struct radiance *map,
                        const struct calibration *calibration, int ball, int view);

#ifdef __cplusplus
}
#endif
#endif
