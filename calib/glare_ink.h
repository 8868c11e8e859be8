/* glare_ink.h -- the veiling glare of the lenses, told by black ink beside white paper. Internal to
 * calib/. */
#ifndef GONIOCAM_GLARE_INK_H
#define GONIOCAM_GLARE_INK_H

#include "calib.h"
#include "glare.h"
#include "pattern.h"

/** The ink of one tag in one view, and what its paper shows at the same place. */
struct ink {
    int view, tag;              // clusters: errors of either may be shared
    double pixel[2];            // the middle of the ink that was looked at
    double black[3], white[3];  // mean radiance of the ink; of the paper, there
    double noise[3];            // of black, 1 sigma
};
/** A growing list; {0} is empty; free(list.ink). */
struct inks {
    struct ink *ink;
    int count, room;
};

/** Append the tags of a view whose ink and paper can be told apart, away from the blur of edges,
 *  and whose paper is evenly lit. STATUS_MEMORY, and those of pattern_of. */
enum status cal_glare_look(struct inks *inks, const struct radiance *map,
                           const struct calibration *calibration, int view,
                           const struct tag_family *family, struct error *err);

/** Shares of light that one camera's lens spreads; see glare_fit.c. */
struct glare_estimate {
    double share[GLARE_TERMS];  // all 0 where the ink does not tell of any
    double total, sigma;        // of all kernels together, significant or not
    double ink[3];              // reflectance, relative to the paper
};
/** Estimate from the ink of one camera's views, at least one; seen [views] are the fields of the
 *  maps as photographed. STATUS_MEMORY. */
enum status cal_glare_fit(struct glare_estimate *estimate, const struct inks *inks,
                          const struct glare_field *seen, int views, struct error *err);

/** Measure the glare of all views, camera by camera: sets glare and sigma_glare of the views where
 *  it is significant. Needs poses and tags. Reads OUT/radiance/SHOT.exr. */
enum status cal_glare(struct calibration *calibration, const struct capture *capture,
                      const char *out, struct run *run, struct error *err);
#endif
