/* warp.h -- densities on the unit square that RGL's files are made of, and how they bend it. */
#ifndef GONIOCAM_WARP_H
#define GONIOCAM_WARP_H

#include "tensor_file.h"

/** Functions on the unit square, bilinear between nodes, one for each pair of parameters (azimuth
 *  and polar angle of the light, say). Between parameters everything is linear too. Owns value,
 * along and across; {0} is empty; release with rec_warp_free(). */
struct warp {
    int width, height;          // nodes along x, along y
    int size[2];                // slices along the first parameter (slow) and the second
    const float *parameter[2];  // their values, ascending; borrowed
    double *value;              // [slices][height][width]
    double *along;              // [slices][height][width] integral in x from 0; NULL: no density
    double *across;             // [slices][height] integral over x, and in y from 0
};

/** Where a pair of parameters lies between slices. */
struct blend {
    int slice[4];
    double weight[4];
    int count;
};

/** From nodes, value [slices][height][width], of at least 2 x 2 and at least one slice. density:
 * each slice is scaled to integrate to 1, and can be sampled. STATUS_MEMORY; STATUS_DATA: a density
 * that is negative or nowhere positive. */
enum status rec_warp_make(struct warp *warp, const float *value, int width, int height,
                          const int size[2], const float *const parameter[2], bool density,
                          struct error *err);
void rec_warp_free(struct warp *warp);
/** Parameters beyond the first or last value count as that. */
struct blend rec_warp_blend(const struct warp *warp, const double parameter[2]);
double rec_warp_eval(const struct warp *warp, const struct blend *blend, const double at[2]);
/** The point that a uniform one becomes when it is distributed as the density: first y is chosen
 *  by its marginal, then x. */
void rec_warp_sample(const struct warp *warp, const struct blend *blend, const double uniform[2],
                     double at[2]);
/** The inverse of rec_warp_sample. */
void rec_warp_invert(const struct warp *warp, const struct blend *blend, const double at[2],
                     double uniform[2]);
#endif
