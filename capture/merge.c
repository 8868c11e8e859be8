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
 * the sufficient statistic): that rate decides; the shortest frame is judged by the pile alone.
 * Given the sum, the frame itself scatters less than its own noise,
 *
 *     var(d_f | sum) = v_f m / (1 + m),      m = sum of the shorter frames' v / v_f,
 *
 * which is a quarter where times are 4 apart: where it is predicted 2 of those standard deviations
 * below saturation, it hits the pile of saturated values once in 44 times, and is not used then.
 * Over all sums of one radiance that is a bias of some 0.005 standard deviations of the estimate.
 *
 * Frames that disagree by more than noise (something moved, a stuck photosite, a cosmic ray) show
 * in chi^2 = sum (d_f - x t_f)^2 / v_f: beyond what noise does once in 10^5 photosites, the
 * variance is multiplied by chi^2 over its degrees of freedom.
 *
 * Speed.    Sixteen values go through all frames together, free of branches, and their sums stay in
 *           registers, the widest that the processor has, with the same bits (nothing is
 *           contracted). Frames that are saturated all over a block are passed over.
 *
 * M. Granados et al., "Optimal HDR reconstruction with linear digital cameras", CVPR 2010;
 * S. W. Hasinoff et al., "Noise-optimal capture for high dynamic range photography", CVPR 2010.
 */
#include "merge.h"
#include "bracket.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

// Electrons in all frames that serve: in between, a second round tells. Below there is nothing to
// tell.
static const float dim_from = 10, dim_to = 400;

enum { TOGETHER = 16, BLOCK = 256 };  // values
typedef float lanes __attribute__((vector_size(TOGETHER * sizeof(float))));
typedef int32_t flags __attribute__((vector_size(TOGETHER * sizeof(int32_t))));  // -1 or 0
#define INLINE static inline __attribute__((always_inline))

static int channel_of(size_t i, const char *cfa, int y)
{
    if (!cfa || !*cfa)
        return (int)(i % 3);
    return cap_cfa_channel(cfa, (int)i, y);
}

enum status merge_row_make(struct merge_row *row, const struct sensor *sensor, int width,
                           const char *cfa, int y, struct error *err)
{
    size_t count = (cfa && *cfa ? 1u : 3u) * (size_t)width;
    float *all = calloc(8 * count, sizeof *all);
    if (!all)
        return cap_fail(err, STATUS_MEMORY, "%zu values", 8 * count);
    float **const part[8] = {&row->black, &row->usable,    &row->verge, &row->read2,
                             &row->slope, &row->relative2, &row->full,  &row->scale};
    for (int k = 0; k < 8; k++)
        *part[k] = all + (size_t)k * count;
    row->count = (int)count;
    for (size_t i = 0; i < count; i++) {
        int c = channel_of(i, cfa, y);
        double read2 = sensor->read_noise[c] * sensor->read_noise[c];
        double signal = sensor->usable[c] - sensor->black[c];
        row->black[i] = (float)sensor->black[c];
        row->usable[i] = (float)sensor->usable[c];
        row->verge[i] = (float)(0.5 / sqrt(read2 + signal / sensor->gain[c]));
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

/* Sixteen values, and what their row and their sums say of them. */
struct group {
    lanes black, usable, verge, read2, slope, relative2, scale;
    lanes x;             // an estimate for the weights
    lanes sum, second;   // over the first used[] frames, which serve; one over their time
    lanes limit, freed;  // of chi^2; one over its degrees of freedom
    flags used;
    lanes numerator, denominator, square;
};

/* How the frames of a bracket are used. */
struct timing {
    float time[BRACKET_FRAMES_MAX];
    // Of all frames up to one: its share of their time (0: the first), and one over their time;
    // what chi^2 exceeds once in 10^5, and one over its degrees of freedom.
    float share[BRACKET_FRAMES_MAX], second[BRACKET_FRAMES_MAX];
    float before[BRACKET_FRAMES_MAX];  // the time of all shorter frames over its own
    float limit[BRACKET_FRAMES_MAX], freed[BRACKET_FRAMES_MAX];
};

INLINE void take(lanes *to, const float *from)
{
    memcpy(to, from, sizeof *to);
}

/* Is x below zero? By its sign: comparisons of vectors are taken to pieces before the compiler
 * knows which registers it has. a - b is below zero where a < b. */
#define NEGATIVE(x) ((flags)(x) >> 31)
/* x where the flag is set, else 0. Not a product: 0 times infinity is none. */
#define WHERE(flag, x) ((lanes)((flag) & (flags)(x)))
/* a where the flag is set, else b. */
#define EITHER(flag, a, b) ((lanes)(((flag) & (flags)(a)) | (~(flag) & (flags)(b))))

/* Signal of a frame; a saturated one is cut, so that all that follows is finite. */
INLINE void signal_of(lanes *d, flags *below, const struct group *g, const float *dn)
{
    lanes v;
    take(&v, dn);
    *below = NEGATIVE(v - g->usable);
    *d = EITHER(*below, v, g->usable) - g->black;
}

/* Is frame f, with a signal that the sum predicts, far enough from saturation? `steady` is the
 * share of read noise in its variance there. */
INLINE void is_safe(flags *safe, const struct group *g, const lanes *predicted, const lanes *steady,
                    float before, int f)
{
    const lanes gap = g->usable - g->black - *predicted, q = gap * g->verge;
    const lanes m = before + ((float)f - before) * *steady;
    *safe = NEGATIVE(-gap) & NEGATIVE(m - q * q * (1 + m));
}

/* Which frames serve, one by one. */
INLINE void choose_some(struct group *g, const float *const *dn, int at,
                        const struct timing *timing, int frames)
{
    g->sum = g->second = g->limit = g->freed = (lanes){0};
    g->used = (flags){0};
    flags serves = ~g->used;
    const lanes steady = 4 * g->read2 * g->verge * g->verge;
    for (int f = 0; f < frames; f++) {
        lanes d;
        flags below, safe;
        signal_of(&d, &below, g, dn[f] + at);
        const lanes predicted = (g->sum + d) * timing->share[f];
        is_safe(&safe, g, &predicted, &steady, timing->before[f], f);
        serves &= below & safe;
        g->sum += WHERE(serves, d);
        g->second = EITHER(serves, (lanes){0} + timing->second[f], g->second);
        g->limit = EITHER(serves, (lanes){0} + timing->limit[f], g->limit);
        g->freed = EITHER(serves, (lanes){0} + timing->freed[f], g->freed);
        g->used -= serves;
    }
}

/* Do all frames serve all values? They do where q of is_safe() is above 1, whatever m is: that is
 * the rule, and asked first, for it takes a third of the time. Only then is the group's sum set. */
INLINE bool choose_all(struct group *g, const float *const *dn, int at, const struct timing *timing,
                       int frames)
{
    const lanes range = g->usable - g->black;
    lanes sum = {0};
    flags good = ~(flags){0};  // by its sign
    for (int f = 0; f < frames; f++) {
        lanes v;
        take(&v, dn[f] + at);
        sum += v - g->black;
        const lanes q = (range - sum * timing->share[f]) * g->verge;
        good &= (flags)(v - g->usable) & (flags)(1 - q);
    }
    int32_t all = -1;
    for (int i = 0; i < TOGETHER; i++)
        all &= good[i];
    if (all >= 0)
        return false;
    g->sum = sum;
    g->used = (flags){0} + frames;
    g->second = (lanes){0} + timing->second[frames - 1];
    g->limit = (lanes){0} + timing->limit[frames - 1];
    g->freed = (lanes){0} + timing->freed[frames - 1];
    return true;
}

/* What a frame adds to the sums; all: each frame serves all values. */
INLINE void weigh_frame(struct group *g, const float *dn, float t, int frame, bool all)
{
    lanes d;
    flags unused;
    if (all) {
        take(&d, dn);
        d -= g->black;
    } else {
        signal_of(&d, &unused, g, dn);
    }
    lanes signal = WHERE(~NEGATIVE(g->x), g->x) * t;
    lanes weight = 1 / (g->read2 + signal * g->slope), off = d - g->x * t;
    if (!all)
        weight = WHERE(NEGATIVE(frame - g->used), weight);
    lanes wt = weight * t;
    g->numerator += wt * d;
    g->denominator += wt * t;
    g->square += weight * off * off;
}

INLINE void weigh(struct group *g, const float *const *dn, int at, const struct timing *timing,
                  int frames, bool all)
{
    g->numerator = g->denominator = g->square = (lanes){0};
    for (int f = 0; f < frames; f++)
        weigh_frame(g, dn[f] + at, timing->time[f], f, all);
}

/* Is one of the values so dim that a second round tells? */
INLINE bool is_dim(const struct group *g)
{
    flags dim = NEGATIVE(dim_from * g->slope - g->sum) & NEGATIVE(g->sum - dim_to * g->slope);
    int32_t any = 0;
    for (int i = 0; i < TOGETHER; i++)
        any |= dim[i];
    return any != 0;
}

/* The weighted sums of the frames that serve. */
INLINE void estimate(struct group *g, const float *const *dn, int at, const struct timing *timing,
                     int frames, bool all)
{
    g->x = g->sum * g->second;
    weigh(g, dn, at, timing, frames, all);
    if (is_dim(g)) {
        g->x = g->numerator / EITHER(NEGATIVE(-g->used), g->denominator, (lanes){0} + 1);
        weigh(g, dn, at, timing, frames, all);
    }
}

INLINE void finish(lanes *value, lanes *variance, const struct group *g, float shortest)
{
    const flags some = NEGATIVE(-g->used);
    const lanes one = (lanes){0} + 1;
    // Saturated in all frames: at least what the shortest could have told.
    lanes bound = (g->usable - g->black) * shortest;
    lanes over = 1 / EITHER(some, g->denominator, one), x = g->numerator * over;
    over *= EITHER(NEGATIVE(g->limit - g->square), g->square * g->freed, one);
    lanes noise = over + g->relative2 * x * x;
    *value = g->scale * EITHER(some, x, bound);
    *variance = EITHER(some, g->scale * g->scale * noise, one * INFINITY);
}

INLINE void merge_group(float *value, float *variance, const struct merge_row *row, int at,
                        const float *const *dn, const struct timing *timing, int frames)
{
    struct group g = {.used = {0}};
    lanes v, var;
    take(&g.black, row->black + at);
    take(&g.usable, row->usable + at);
    take(&g.verge, row->verge + at);
    take(&g.read2, row->read2 + at);
    take(&g.slope, row->slope + at);
    take(&g.relative2, row->relative2 + at);
    take(&g.scale, row->scale + at);
    if (frames > 0 && choose_all(&g, dn, at, timing, frames)) {
        estimate(&g, dn, at, timing, frames, true);
    } else {
        choose_some(&g, dn, at, timing, frames);
        estimate(&g, dn, at, timing, frames, false);
    }
    finish(&v, &var, &g, 1 / timing->time[0]);
    memcpy(value + at, &v, sizeof v);
    memcpy(variance + at, &var, sizeof var);
}

/* Frames of a block that are not saturated all over; the others are longer. */
INLINE int frames_below(const struct merge_row *row, int from, int end, const float *const *dn,
                        int frames)
{
    int f = 0, below = 1;
    for (; f < frames && below > 0; f++) {
        const float *v = dn[f];
        below = 0;
        for (int i = from; i < end; i++)
            below += v[i] < row->usable[i];
    }
    return below > 0 ? f : f - 1;
}

WIDE static void merge_groups(float *value, float *variance, const struct merge_row *row,
                              const float *const *dn, const struct timing *timing, int frames)
{
    const int whole = row->count / TOGETHER * TOGETHER;
    for (int from = 0; from < whole; from += BLOCK) {
        int end = from + BLOCK < whole ? from + BLOCK : whole;
        int some = frames_below(row, from, end, dn, frames);
        for (int at = from; at < end; at += TOGETHER)
            merge_group(value, variance, row, at, dn, timing, some);
    }
}

/* The last values of a row, fewer than sixteen, in a row of their own. */
static void merge_rest(float *value, float *variance, const struct merge_row *row,
                       const float *const *dn, const struct timing *timing, int frames)
{
    const int count = row->count % TOGETHER, from = row->count - count;
    const float *const of_row[7] = {row->black, row->usable,    row->verge, row->read2,
                                    row->slope, row->relative2, row->scale};
    float of_rest[7][TOGETHER] = {{0}}, seen[BRACKET_FRAMES_MAX][TOGETHER], result[2][TOGETHER];
    const float *frame[BRACKET_FRAMES_MAX];
    for (int k = 0; k < 7; k++)
        memcpy(of_rest[k], of_row[k] + from, (size_t)count * sizeof(float));
    for (int f = 0; f < frames; f++) {
        memset(seen[f], 0, sizeof seen[f]);
        memcpy(seen[f], dn[f] + from, (size_t)count * sizeof(float));
        frame[f] = seen[f];
    }
    const struct merge_row rest = {.count = TOGETHER,
                                   .black = of_rest[0],
                                   .usable = of_rest[1],
                                   .verge = of_rest[2],
                                   .read2 = of_rest[3],
                                   .slope = of_rest[4],
                                   .relative2 = of_rest[5],
                                   .scale = of_rest[6]};
    merge_groups(result[0], result[1], &rest, frame, timing, frames);
    memcpy(value + from, result[0], (size_t)count * sizeof(float));
    memcpy(variance + from, result[1], (size_t)count * sizeof(float));
}

/* Chi^2 of n degrees of freedom exceeds this once in 10^5 (Laurent and Massart 2000:
 * n + 2 sqrt(L n) + 2 L with L = ln 10^5 = 11.5). */
static double chi2_limit(int n)
{
    return n + 23 + 2 * sqrt(11.5 * n);
}

void merge_row(float *value, float *variance, const struct merge_row *row, const float *const *dn,
               const double *time, int frames)
{
    struct timing timing;
    double total = 0;
    assert(frames <= BRACKET_FRAMES_MAX);
    for (int f = 0; f < frames; f++) {
        timing.time[f] = (float)time[f];
        timing.before[f] = (float)(total / time[f]);
        timing.share[f] = f > 0 ? (float)(time[f] / (total + time[f])) : 0;
        total += time[f];
        timing.second[f] = (float)(1 / total);
        timing.limit[f] = (float)chi2_limit(f > 0 ? f : 1);
        timing.freed[f] = 1 / (float)(f > 0 ? f : 1);
    }
    merge_groups(value, variance, row, dn, &timing, frames);
    if (row->count % TOGETHER)
        merge_rest(value, variance, row, dn, &timing, frames);
}
