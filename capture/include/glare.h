/* glare.h -- light that a lens spreads over the whole image (veiling glare), and its removal.
 *
 * A share g_k of all light is spread by kernel k and the rest arrives where it should,
 *
 *     seen = (1 - sum g_k) true + sum g_k K_k true.
 *
 * Kernel 0 spreads evenly over the image; the others are Gaussians, of a sixth and of a
 * twenty-fourth of the image's diagonal. They are so wide that a coarse picture of the map, a
 * field, tells what they do. What lies beyond the border is taken to be like what lies within it.
 */
#ifndef GONIOCAM_GLARE_H
#define GONIOCAM_GLARE_H

#include "capture.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { GLARE_TERMS = 3 };

/** Means over cells of side x side photosites. Owns value; {0} is empty; free(field.value). */
struct glare_field {
    int width, height, side;
    double last[2];  // how much of a whole one the last column and the last row are
    float *value;    // [height][width][3]
};
/** Some 64 cells along the longer side. STATUS_MEMORY. */
enum status cap_glare_field(struct glare_field *field, const struct radiance *map,
                            struct error *err);
/** K_term of a field. On success the caller owns *spread. STATUS_MEMORY. */
enum status cap_glare_spread(struct glare_field *spread, const struct glare_field *field, int term,
                             struct error *err);
/** A field at a pixel, [3], linear between the middles of its cells. */
void cap_glare_at(const struct glare_field *field, double x, double y, double value[3]);
/** The field of the true light, from the field `seen`. On success the caller owns *truth. Requires
 *  sum share < 0.5. STATUS_MEMORY. */
enum status cap_glare_clear(struct glare_field *truth, const struct glare_field *seen,
                            const double share[GLARE_TERMS], struct error *err);
/** Take the veil off a map of three channels. sigma is the standard deviation of the sum of the
 *  shares: the same part of the veil goes into the variance. Nothing happens where all shares are
 *  0. STATUS_MEMORY. */
enum status cap_glare_remove(struct radiance *map, const double share[GLARE_TERMS], double sigma,
                             struct error *err);

#ifdef __cplusplus
}
#endif
#endif
