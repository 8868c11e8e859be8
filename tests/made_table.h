/* made_table.h -- a complete table of a known material, for tests. */
#ifndef GONIOCAM_MADE_TABLE_H
#define GONIOCAM_MADE_TABLE_H

#include "brdf.h"

#include <stdlib.h>

/** Every bin whose center is above the horizon, the others -1. The caller frees it. */
static inline struct merl made_table(const struct model *model, const double *value)
{
    struct merl merl = {malloc(3 * (size_t)MERL_BINS * sizeof(double))};
    for (int bin = 0; bin < MERL_BINS; bin++) {
        vec3 wi, wo;
        double f[3] = {-1, -1, -1};
        rec_directions(rec_merl_center(bin), &wi, &wo);
        if (wi.z > 0 && wo.z > 0)
            model->eval(value, wi, wo, f);
        for (int c = 0; c < 3; c++)
            merl.value[(size_t)c * MERL_BINS + (size_t)bin] = f[c];
    }
    return merl;
}
#endif
