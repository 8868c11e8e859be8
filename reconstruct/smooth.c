/* smooth.c -- a field over the bins of a table, smoothed along its axes.
 *
 * Method.   The two-sided exponential along an axis is a pass forth, y[i] = x[i] + a y[i-1], and
 *           the same back over x, added; its cost does not depend on its length. Around phi_d the
 *           pass first goes once around to arrive at its steady state.
 */
#include "smooth.h"

#include <string.h>

enum { H = MERL_THETA_H, D = MERL_THETA_D, P = MERL_PHI_D, SLAB = D * P };

// Rows of `width` values `stride` apart, `count` of them: each row gains a times the row before.
static void pass(float *to, const float *from, int count, ptrdiff_t stride, int width, float a)
{
    for (int i = 0; i < count; i++) {
        float *row = to + i * stride;
        const float *x = from + i * stride, *before = i ? row - stride : NULL;
        if (!before)
            memcpy(row, x, (size_t)width * sizeof *row);
        for (int k = 0; before && k < width; k++)
            row[k] = x[k] + a * before[k];
    }
}

// A line of rows, both ways: from [count][width] at `stride` floats into itself; scratch likewise.
static void smooth_line(float *field, float *scratch, int count, ptrdiff_t stride, int width,
                        float a)
{
    float *forth = scratch, *back = scratch + count * stride;
    pass(forth, field, count, stride, width, a);
    // Backwards is forwards over the rows in reverse, from the last one.
    pass(back + (count - 1) * stride, field + (count - 1) * stride, count, -stride, width, a);
    for (int i = 0; i < count; i++)
        for (int k = 0; k < width; k++)
            field[i * stride + k] =
                forth[i * stride + k] + back[i * stride + k] - field[i * stride + k];
}

// Rings that follow each other, side by side: along a ring each value waits for the one before.
enum { RINGS = 12 };
_Static_assert(H *D % RINGS == 0, "all rings go in such groups");

static void smooth_circles(float *ring, float a)
{
    float x[P][RINGS], forth[P][RINGS], back[P][RINGS], y[RINGS] = {0}, z[RINGS] = {0};
    for (int k = 0; k < RINGS; k++)
        for (int i = 0; i < P; i++)
            x[i][k] = ring[k * P + i];
    for (int turn = 0; turn < 2; turn++)
        for (int i = 0; i < P; i++)
            for (int k = 0; k < RINGS; k++) {
                forth[i][k] = y[k] = x[i][k] + a * y[k];
                back[P - 1 - i][k] = z[k] = x[P - 1 - i][k] + a * z[k];
            }
    for (int k = 0; k < RINGS; k++)
        for (int i = 0; i < P; i++)
            ring[k * P + i] = forth[i][k] + back[i][k] - x[i][k];
}

void rec_smooth(float *field, const double length[3])
{
    enum { BLOCK = P };  // theta_h lines go in blocks of one phi_d circle: contiguous, in cache
    static _Thread_local float scratch[2 * H * BLOCK];
    static _Thread_local float block[H * BLOCK];
    const float a_h = (float)exp(-1 / length[0]), a_d = (float)exp(-1 / length[1]);
    const float a_p = (float)exp(-1 / length[2]);
    for (int i = 0; i < H * D; i += RINGS)
        smooth_circles(field + (ptrdiff_t)i * P, a_p);
    for (int h = 0; h < H; h++)
        smooth_line(field + (ptrdiff_t)h * SLAB, scratch, D, P, P, a_d);
    for (int d = 0; d < D; d++) {
        float *column = field + (ptrdiff_t)d * P;
        for (int h = 0; h < H; h++)
            memcpy(block + h * BLOCK, column + (ptrdiff_t)h * SLAB, BLOCK * sizeof *block);
        smooth_line(block, scratch, H, BLOCK, BLOCK, a_h);
        for (int h = 0; h < H; h++)
            memcpy(column + (ptrdiff_t)h * SLAB, block + h * BLOCK, BLOCK * sizeof *block);
    }
}
