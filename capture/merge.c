/* merge.c -- the frames of a bracket become one linear value with its variance.
 *
 * Frame f of a photosite counts d_f = DN - black in t_f seconds, with variance
 * v_f = read^2 + x t_f / gain for radiance x. The maximum-likelihood estimate is
 *
 *     x = sum (t_f d_f / v_f) / sum (t_f^2 / v_f),      var x = 1 / sum (t_f^2 / v_f),
 *
 * with v_f at the estimate itself, not at the noisy d_f, which would favour low values: it starts
 * from sum d_f / sum t_f, what photon noise alone asks for; weights that are a little off cost
 * precision in second order only, so one round is enough where there is light. Of 60 electrons in
 * the longest frame it makes 0.13 % too many, of 20 some 0.5 %, for the weights share the noise of
 * that sum: where it is so dark, a second round from the first estimate is unbiased. What frames do
 * not average away, the photosite's unequal response, is added at the end: var x += (r x)^2.
 *
 * Whether a frame is used must not depend on noise that the estimate shares, or bright photosites
 * would come out too dark or too bright. The sum of a frame and all shorter ones, as a rate, is
 * independent of how they differ, and so of what the frame would change (for photon noise it is
 * the sufficient statistic): a frame is used where that rate predicts it 4 standard deviations
 * below saturation, and it is not at the pile of saturated values. The shortest frame is judged
 * by the pile alone.
 *
 * Frames that disagree by more than noise (something moved, a stuck photosite, a cosmic ray) show
 * in chi^2 = sum (d_f - x t_f)^2 / v_f: beyond what noise does once in 10^5 photosites, the
 * variance is multiplied by chi^2 over its degrees of freedom.
 *
 * Speed.    All loops are over values, free of branches, and vectorised; the processor's widest
 *           registers are used where it has them, with the same bits (nothing is contracted).
 *
 * M. Granados et al., "Optimal HDR reconstruction with linear digital cameras", CVPR 2010;
 * S. W. Hasinoff et al., "Noise-optimal capture for high dynamic range photography", CVPR 2010.
 */
#include "merge.h"

#include <stdlib.h>
#include <string.h>

#if defined __clang__
#define INDEPENDENT
#else
#define INDEPENDENT _Pragma("GCC ivdep")
#endif

// Electrons in the longest frame: in between, a second round tells. Below there is nothing to tell.
static const float dim_from = 8, dim_to = 300;

enum { BLOCK = 256 };  // values at a time: what the loops below share stays in the nearest cache

static int channel_of(size_t i, const char *cfa, int y)
{
    if (!cfa || !*cfa)
        return (int)(i % 3);
    char letter = cfa[2 * (y % 2) + (int)(i % 2)];
    return letter == 'R' ? 0 : letter == 'G' ? 1 : 2;
}

enum status merge_row_make(struct merge_row *row, const struct sensor *sensor, int width,
                           const char *cfa, int y, struct error *err)
{
    size_t count = (cfa && *cfa ? 1u : 3u) * (size_t)width;
    float *all = calloc(8 * count, sizeof *all);
    if (!all)
        return cap_fail(err, STATUS_MEMORY, "%zu values", 8 * count);
    float **const part[8] = {&row->black, &row->usable,    &row->safe, &row->read2,
                             &row->slope, &row->relative2, &row->full, &row->scale};
    for (int k = 0; k < 8; k++)
        *part[k] = all + (size_t)k * count;
    row->count = (int)count;
    for (size_t i = 0; i < count; i++) {
        int c = channel_of(i, cfa, y);
        double read2 = sensor->read_noise[c] * sensor->read_noise[c];
        double signal = sensor->usable[c] - sensor->black[c];
        row->black[i] = (float)sensor->black[c];
        row->usable[i] = (float)sensor->usable[c];
        row->safe[i] = (float)(signal - 4 * sqrt(read2 + signal / sensor->gain[c]));
        row->read2[i] = (float)read2;
        row->slope[i] = (float)(1 / sensor->gain[c]);
        row->relative2[i] = (float)(sensor->relative[c] * sensor->relative[c]);
        row->full[i] = (float)(1 / (sensor->white[c] - sensor->black[c]));
    }
    merge_row_scale(row, NULL);
    return STATUS_OK;
}

void merge_row_free(struct merge_row *row)
{
    free(row->black);
    *row = (struct merge_row){0};
}

WIDE void merge_row_scale(struct merge_row *row, const float *flat)
{
    const float *restrict full = row->full;
    float *restrict scale = row->scale;
    if (!flat)
        memcpy(scale, full, (size_t)row->count * sizeof *scale);
    for (int i = 0; flat && i < row->count; i++)
        scale[i] = full[i] / flat[i];
}

/* The sums of one block. */
struct sums {
    float x[BLOCK];
    float sum[BLOCK], seconds[BLOCK], used[BLOCK];  // over the first used[] frames, which serve
    float numerator[BLOCK], denominator[BLOCK], square[BLOCK];
};

static inline __attribute__((always_inline)) void choose_frame(struct sums *restrict s,
                                                               const struct merge_row *row,
                                                               int from, int count,
                                                               const float *restrict v, float t,
                                                               float share, float before)
{
    const float *restrict black = row->black + from, *restrict usable = row->usable + from;
    const float *restrict safe = row->safe + from;
    float *restrict sum = s->sum, *restrict seconds = s->seconds, *restrict used = s->used;
    INDEPENDENT for (int i = 0; i < count; i++)
    {
        // Infinite values must not reach the sums: 0 times infinity is none.
        float serves = v[i] < usable[i] ? 1.0f : 0.0f;
        float d = (v[i] < usable[i] ? v[i] : usable[i]) - black[i];
        serves = used[i] == before ? serves : 0.0f;
        serves = (sum[i] + d) * share < safe[i] ? serves : 0.0f;
        sum[i] += serves * d;
        seconds[i] += serves * t;
        used[i] += serves;
    }
}

static inline __attribute__((always_inline)) void weigh_frame(struct sums *restrict s,
                                                              const struct merge_row *row, int from,
                                                              int count, const float *restrict v,
                                                              float t, float number)
{
    const float *restrict black = row->black + from, *restrict usable = row->usable + from;
    const float *restrict read2 = row->read2 + from, *restrict slope = row->slope + from;
    const float *restrict x = s->x, *restrict used = s->used;
    float *restrict numerator = s->numerator, *restrict denominator = s->denominator;
    float *restrict square = s->square;
    INDEPENDENT for (int i = 0; i < count; i++)
    {
        float serves = used[i] > number ? 1.0f : 0.0f;
        float d = (v[i] < usable[i] ? v[i] : usable[i]) - black[i];
        float signal = 0.5f * (x[i] + fabsf(x[i])) * t;
        float weight = serves / (read2[i] + signal * slope[i]);
        numerator[i] += weight * t * d;
        denominator[i] += weight * t * t;
        square[i] += weight * (d - x[i] * t) * (d - x[i] * t);
    }
}

/* Is a value of the block so dim that a second round tells? */
static inline __attribute__((always_inline)) bool is_dim(const struct sums *restrict s,
                                                         const struct merge_row *row, int from,
                                                         int count, float longest)
{
    const float *restrict slope = row->slope + from, *restrict x = s->x;
    int dim = 0;
    for (int i = 0; i < count; i++) {
        float signal = x[i] * longest;
        dim += signal > dim_from * slope[i] && signal < dim_to * slope[i];
    }
    return dim > 0;
}

static inline __attribute__((always_inline)) void weigh(struct sums *restrict s,
                                                        const struct merge_row *row, int from,
                                                        int count, const float *const *dn,
                                                        const double *time, int frames)
{
    memset(s->numerator, 0, sizeof s->numerator);
    memset(s->denominator, 0, sizeof s->denominator);
    memset(s->square, 0, sizeof s->square);
    for (int f = 0; f < frames; f++)
        weigh_frame(s, row, from, count, dn[f] + from, (float)time[f], (float)f);
    for (int i = 0; i < count; i++)
        s->x[i] = s->numerator[i] / (s->used[i] > 0 ? s->denominator[i] : 1);
}

static inline __attribute__((always_inline)) void finish_block(float *restrict value,
                                                               float *restrict variance,
                                                               const struct sums *s,
                                                               const struct merge_row *row,
                                                               int from, int count, float shortest)
{
    const float *restrict scale = row->scale + from, *restrict usable = row->usable + from;
    const float *restrict black = row->black + from, *restrict relative2 = row->relative2 + from;
    for (int i = 0; i < count; i++) {
        bool any = s->used[i] > 0;
        // Saturated in all frames: at least what the shortest could have told.
        float bound = (usable[i] - black[i]) * shortest;
        float freedom = s->used[i] > 2 ? s->used[i] - 1 : 1;
        // Chi^2 / n exceeds this once in 10^5 (Laurent and Massart 2000: 1 + 2 sqrt(L/n) + 2 L/n
        // with L = ln 10^5 = 11.5).
        float limit = 1 + 23.0f / freedom + 2 * sqrtf(11.5f / freedom);
        float disagreement = s->square[i] / freedom;
        float factor = disagreement > limit ? disagreement : 1;
        float noise = factor / (any ? s->denominator[i] : 1) + relative2[i] * s->x[i] * s->x[i];
        value[i] = scale[i] * (any ? s->x[i] : bound);
        variance[i] = any ? scale[i] * scale[i] * noise : INFINITY;
    }
}

WIDE static void merge_block(float *value, float *variance, const struct merge_row *row, int from,
                             int count, const float *const *dn, const double *time, int frames)
{
    struct sums s;
    double total = 0;
    memset(&s, 0, sizeof s);
    for (int f = 0; f < frames; f++) {
        float share = f > 0 ? (float)(time[f] / (total + time[f])) : 0;
        choose_frame(&s, row, from, count, dn[f] + from, (float)time[f], share, (float)f);
        total += time[f];
    }
    for (int i = 0; i < count; i++)
        s.x[i] = s.sum[i] / (s.used[i] > 0 ? s.seconds[i] : 1);
    weigh(&s, row, from, count, dn, time, frames);
    if (is_dim(&s, row, from, count, (float)time[frames - 1]))
        weigh(&s, row, from, count, dn, time, frames);
    finish_block(value + from, variance + from, &s, row, from, count, (float)(1 / time[0]));
}

void merge_row(float *value, float *variance, const struct merge_row *row, const float *const *dn,
               const double *time, int frames)
{
    for (int from = 0; from < row->count; from += BLOCK) {
        int count = row->count - from < BLOCK ? row->count - from : BLOCK;
        merge_block(value, variance, row, from, count, dn, time, frames);
    }
}
