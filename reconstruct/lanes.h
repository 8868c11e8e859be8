/* lanes.h -- neighbouring photosites side by side: loops over lanes become vector instructions.
 *
 * Functions marked WIDE (program.h) do the loops. Lanes do not meet, and no operation is fused or
 * reordered: all widths give the same bits. Conditions choose between two finished values, so that
 * they are no branches.
 */
#ifndef GONIOCAM_LANES_H
#define GONIOCAM_LANES_H

#include "calib.h"

enum { LANES = 64 };  // some forty arrays of them fit in a first-level cache

/** LANES vectors. */
typedef struct {
    double x[LANES], y[LANES], z[LANES];
} vec3_lanes;

static inline vec3 rec_lane(const vec3_lanes *v, int i)
{
    return (vec3){v->x[i], v->y[i], v->z[i]};
}
static inline void rec_lane_set(vec3_lanes *v, int i, vec3 a)
{
    v->x[i] = a.x;
    v->y[i] = a.y;
    v->z[i] = a.z;
}

#endif
