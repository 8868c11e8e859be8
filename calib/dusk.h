/* dusk.h -- where light ends beside an outline. Internal to calib/. */
#ifndef GONIOCAM_DUSK_H
#define GONIOCAM_DUSK_H

#include "calib.h"

/** Would the border of light be taken for the outline that touches the sample at `point`, where its
 *  normal is `normal` and it curves with `radius_px`? Once the view's lamp is known; before, no. */
bool cal_dusk_at_limb(const struct calibration *calibration, int view, vec3 point, vec3 normal,
                      double radius_px);
#endif
