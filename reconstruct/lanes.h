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
enum { BLOCK = 16 };  // what is worked on together, at least: a vector or two

/** Lanes [first, end), both multiples of BLOCK: those that matter lie in it. */
typedef struct {
    int first, end;
} lane_span;
static const lane_span ALL_LANES = {0, LANES};

/** All lanes of a span. That it is whole blocks the compiler is told once more: no lane is left
 * over beside the vectors. */
#define FOR_LANES(i, span)                                                                         \
    for (int i = (span).first & -BLOCK, i##_end = (span).end & -BLOCK; i < i##_end; i++)

/** The shortest span of the lanes that are marked, 1 or 0; {0, 0}: none is. */
static inline lane_span rec_lanes_marked(const float marked[LANES])
{
    lane_span span = {LANES, 0};
    for (int begin = 0; begin < LANES; begin += BLOCK) {
        int any = 0;
        for (int i = begin; i < begin + BLOCK; i++)
            any |= marked[i] > 0;
        span.first = any && begin < span.first ? begin : span.first;
        span.end = any ? begin + BLOCK : span.end;
    }
    return span.end > 0 ? span : (lane_span){0, 0};
}

/** LANES vectors. */
typedef struct {
    double x[LANES], y[LANES], z[LANES];
} vec3_lanes;

/** The same of half the width: directions to 1e-7, where no small difference is taken of them. */
typedef struct {
    float x[LANES], y[LANES], z[LANES];
} vec3f_lanes;

static inline vec3 rec_lane_wide(const vec3f_lanes *v, int i)
{
    return (vec3){(double)v->x[i], (double)v->y[i], (double)v->z[i]};
}
static inline void rec_lane_narrow(vec3f_lanes *v, int i, vec3 a)
{
    v->x[i] = (float)a.x;
    v->y[i] = (float)a.y;
    v->z[i] = (float)a.z;
}
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
