/* made_bins.h -- bins of a known material, with noise, for tests. */
#ifndef GONIOCAM_MADE_BINS_H
#define GONIOCAM_MADE_BINS_H

#include "reconstruct.h"

#include <stdlib.h>

// A number in [0, 1) that looks like chance and is none.
static inline double made_chance(int i, int k)
{
    double x = sin(12.9898 * i + 78.233 * k) * 43758.5453;
    return x - floor(x);
}

/** Every `stride`-th bin above the horizon, off its center, with Gaussian noise of `noise` times
 *  its f. The caller frees. */
static inline struct bins made_bins(const struct model *model, const double *value, int stride,
                                    double noise)
{
    struct bins bins = {.bin = malloc((size_t)(MERL_BINS / stride + 1) * sizeof(struct bin)),
                        .grid = rec_merl_grid};
    for (int i = stride / 2; i < MERL_BINS; i += stride) {
        struct bin b = {.index = i, .count = 1, .centroid = rec_merl_center(i)};
        vec3 wi, wo;
        double f[3];
        b.centroid.phi_d += 0.4 * CAP_PI / MERL_PHI_D * (2 * made_chance(i, 9) - 1);
        rec_directions(b.centroid, &wi, &wo);
        if (!rec_merl_above(i) || wi.z < 0.02 || wo.z < 0.02)
            continue;
        model->eval(value, wi, wo, f);
        for (int c = 0; c < 3; c++) {
            double u = made_chance(i, 2 * c) + 1e-12, v = made_chance(i, 2 * c + 1);
            double gauss = sqrt(-2 * log(u)) * cos(2 * CAP_PI * v);  // Box and Muller 1958
            b.mean[c] = f[c] * (1 + noise * gauss);
            b.noise[c] = b.sigma[c] = noise * f[c];
        }
        bins.bin[bins.count++] = b;
    }
    return bins;
}
#endif
