/* corners.h -- the corners of a tag, fitted to the photograph of its whole pattern. */
#ifndef GONIOCAM_CORNERS_H
#define GONIOCAM_CORNERS_H

#include "calib.h"
#include "lens.h"
#include "pattern.h"

/** The fit of one tag in one photograph. */
struct tag_fit {
    double corner[4][2];      // pixels, in the order of struct seen_tag
    double covariance[8][8];  // of corner, from the scatter of the photosites about the fit
    double by_lens[8][LENS_PARAMETERS];  // how corner follows the numbers of the lens it was fitted
                                         // through, in the order of lens.h
    double blur;      // variance of the image's point spread, photosite included; px^2
    double contrast;  // white minus black level
    double scatter;   // of the photosites about the fit, as a share of the contrast
    double inliers;   // share of the photosites that agree with the pattern
};

/** Fit the pattern near `start` (within about a pixel, or half a cell where that is less), seen
 *  through the camera's lens. false: it is not there, or not to be trusted (outside the image,
 *  covered, half in shadow); *fit then holds nothing of use. */
bool corners_fit(struct tag_fit *fit, const struct tag_pattern *pattern,
                 const struct camera *camera, const struct radiance *map, double start[4][2]);

#endif
