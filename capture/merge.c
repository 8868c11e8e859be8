/* merge.c -- the frames of a bracket become one linear value with its variance.
 *
 * Frame f of a photosite counts d_f = DN - black in t_f seconds, with variance
 * v_f = read^2 + x t_f / gain for radiance x. The maximum-likelihood estimate is
 *
 *     x = sum (t_f d_f / v_f) / sum (t_f^2 / v_f),      var x = 1 / sum (t_f^2 / v_f),
 *
 * with v_f at the estimate itself, not at the noisy d_f, which would favour low values: it starts
 * from sum d_f / sum t_f, what photon noise alone asks for, and two rounds settle it.
 *
 * Whether a frame is used must not depend on noise that the estimate shares, or bright photosites
 * would come out too dark or too bright. The sum of a frame and all shorter ones, as a rate, is
 * independent of how they differ, and so of what the frame would change (for photon noise it is
 * the sufficient statistic): a frame is used where that rate predicts it 4 standard deviations
 * below saturation, and it is not at the pile of saturated values. The shortest frame is judged
 * by the pile alone.
 *
 * M. Granados et al., "Optimal HDR reconstruction with linear digital cameras", CVPR 2010;
 * S. W. Hasinoff et al., "Noise-optimal capture for high dynamic range photography", CVPR 2010.
 */
#include "merge.h"

#include <stdlib.h>

enum { BLOCK = 512 };  // values at a time: what the loops below share stays in the nearest cache

enum status merge_row_make(struct merge_row *row, const struct sensor *sensor, int width,
                           struct error *err)
{
    size_t count = 3 * (size_t)width;
    float *all = calloc(6 * count, sizeof *all);
    if (!all)
        return cap_fail(err, STATUS_MEMORY, "%zu values", 6 * count);
    *row = (struct merge_row){
        (int)count,     all, all + count, all + 2 * count, all + 3 * count, all + 4 * count,
        all + 5 * count};
    for (size_t i = 0; i < count; i++) {
        size_t c = i % 3;
        double read2 = sensor->read_noise[c] * sensor->read_noise[c];
        double signal = sensor->usable[c] - sensor->black[c];
        row->black[i] = (float)sensor->black[c];
        row->usable[i] = (float)sensor->usable[c];
        row->safe[i] = (float)(signal - 4 * sqrt(read2 + signal / sensor->gain[c]));
        row->read2[i] = (float)read2;
        row->slope[i] = (float)(1 / sensor->gain[c]);
    }
    merge_row_scale(row, sensor, NULL);
    return STATUS_OK;
}

void merge_row_free(struct merge_row *row)
{
    free(row->black);
    *row = (struct merge_row){0};
}

void merge_row_scale(struct merge_row *row, const struct sensor *sensor, const float *flat)
{
    float full[3];
    for (int c = 0; c < 3; c++)
        full[c] = (float)(1 / (sensor->white[c] - sensor->black[c]));
    for (int i = 0; i < row->count; i++)
        row->scale[i] = flat ? full[i % 3] / flat[i] : full[i % 3];
}

/* sum[i] of d_f over the first used[i] frames, which are those that serve. */
static void choose_frames(float *restrict sum, float *restrict used, const struct merge_row *row,
                          int from, int count, const uint16_t *const *dn, const double *time,
                          int frames)
{
    const float *restrict black = row->black + from, *restrict usable = row->usable + from;
    const float *restrict safe = row->safe + from;
    double total = 0;
    for (int i = 0; i < count; i++)
        sum[i] = used[i] = 0;
    for (int f = 0; f < frames; f++) {
        const uint16_t *restrict v = dn[f] + from;
        float share = f > 0 ? (float)(time[f] / (total + time[f])) : 0, before = (float)f;
#pragma omp simd
        for (int i = 0; i < count; i++) {
            float d = (float)v[i] - black[i];
            float serves = used[i] == before ? 1.0f : 0.0f;
            serves = (sum[i] + d) * share < safe[i] ? serves : 0.0f;
            serves = (float)v[i] < usable[i] ? serves : 0.0f;
            sum[i] += serves * d;
            used[i] += serves;
        }
        total += time[f];
    }
}

/* One round: numerator and denominator of x with variances at the x of before. */
static void weigh_frames(float *restrict numerator, float *restrict denominator,
                         const float *restrict x, const float *restrict used,
                         const struct merge_row *row, int from, int count,
                         const uint16_t *const *dn, const double *time, int frames)
{
    const float *restrict black = row->black + from, *restrict read2 = row->read2 + from;
    const float *restrict slope = row->slope + from;
    for (int i = 0; i < count; i++)
        numerator[i] = denominator[i] = 0;
    for (int f = 0; f < frames; f++) {
        const uint16_t *restrict v = dn[f] + from;
        float t = (float)time[f], number = (float)f;
#pragma omp simd
        for (int i = 0; i < count; i++) {
            // Products instead of selections: the compiler makes no branches of them.
            float serves = used[i] > number ? 1.0f : 0.0f;
            float signal = 0.5f * (x[i] + fabsf(x[i])) * t;
            float weight = serves * t / (read2[i] + signal * slope[i]);
            numerator[i] += weight * ((float)v[i] - black[i]);
            denominator[i] += weight * t;
        }
    }
}

static void merge_block(float *value, float *variance, const struct merge_row *row, int from,
                        int count, const uint16_t *const *dn, const double *time,
                        const float *per_total, int frames)
{
    float sum[BLOCK], used[BLOCK], x[BLOCK], numerator[BLOCK], denominator[BLOCK];
    choose_frames(sum, used, row, from, count, dn, time, frames);
    for (int i = 0; i < count; i++)
        x[i] = sum[i] * per_total[(int)used[i]];
    for (int round = 0; round < 2; round++) {
        weigh_frames(numerator, denominator, x, used, row, from, count, dn, time, frames);
        for (int i = 0; i < count; i++)
            x[i] = used[i] > 0 ? numerator[i] / denominator[i] : 0;
    }
    float shortest = (float)time[0];
    for (int i = 0; i < count; i++) {
        float scale = row->scale[from + i];
        // Saturated in all frames: at least what the shortest could have told.
        float bound = (row->usable[from + i] - row->black[from + i]) / shortest;
        value[i] = scale * (used[i] > 0 ? x[i] : bound);
        variance[i] = used[i] > 0 ? scale * scale / denominator[i] : INFINITY;
    }
}

void merge_row(float *value, float *variance, const struct merge_row *row,
               const uint16_t *const *dn, const double *time, int frames)
{
    float per_total[65] = {0};  // 1 / (the first k times together)
    double total = 0;
    for (int f = 0; f < frames; f++)
        per_total[f + 1] = (float)(1 / (total += time[f]));
    for (int from = 0; from < row->count; from += BLOCK) {
        int count = row->count - from < BLOCK ? row->count - from : BLOCK;
        merge_block(value + from, variance + from, row, from, count, dn, time, per_total, frames);
    }
}
