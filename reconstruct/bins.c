/* bins.c -- sums of samples per MERL bin.
 *
 * Method.   A shot's sums (shot_bins.c) are rounded once to multiples of 2^-60 and added as 128-bit
 *           whole numbers: addition is exact, so the sums are the same to the last bit for any
 * order of the shots and any split over threads. Weights are at most 1, |f| below 1e5 and w f^2
 *           below 1e10, so 9e8 samples of the largest kind a shot stay below 2^63.
 * Accuracy. Sums are rounded by 1e-18; the least weight is 1e-10, so a mean is good to 1e-8.
 * Errors.   Noise of the mean is sqrt(sum w^2 var) / sum w. What samples share (geometry, lamp) is
 *           averaged as it stands, as if wholly correlated within a bin.
 */
#include "bins.h"
#include "quantile.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

static const double unit = 0x1p60;

fixed128 rec_fix(double x)
{
    assert(fabs(x) < 0x1p63);
    int64_t whole = (int64_t)x;  // in two parts, each a machine's own conversion
    return (fixed128)whole * ((int64_t)1 << 60) + (int64_t)((x - (double)whole) * unit);
}

double rec_unfix(fixed128 x)
{
    return (double)x / unit;
}

enum status rec_tally_begin(struct tally *tally, struct grid grid, struct error *err)
{
    struct tally t = {.slot = calloc((size_t)rec_grid_bins(grid), sizeof *t.slot), .grid = grid};
    if (!t.slot)
        return cap_fail(err, STATUS_MEMORY, "no memory for bins");
    *tally = t;
    return STATUS_OK;
}

void rec_tally_free(struct tally *tally)
{
    free(tally->slot);
    free(tally->sums);
    free(tally->mosaic);
    *tally = (struct tally){0};
}

// Twice the room, also for a mosaic's sums where there are any. false: no memory.
static bool grow(struct tally *t)
{
    const int room = t->room ? 2 * t->room : 4096;
    struct bin_sums *sums = realloc(t->sums, (size_t)room * sizeof *sums);
    t->sums = sums ? sums : t->sums;
    struct mosaic_sums *mosaic =
        t->mosaic && sums ? realloc(t->mosaic, (size_t)room * sizeof *mosaic) : NULL;
    if (!sums || (t->mosaic && !mosaic))
        return false;
    t->mosaic = mosaic;
    t->room = room;
    return true;
}

// The index of a bin's sums, new ones where it had none; -1: no memory.
static int place_of(struct tally *t, int bin)
{
    if (t->slot[bin])
        return t->slot[bin] - 1;
    if (t->count == t->room && !grow(t))
        return -1;
    t->sums[t->count] = (struct bin_sums){0};
    if (t->mosaic)
        t->mosaic[t->count] = (struct mosaic_sums){0};
    t->slot[bin] = ++t->count;
    return t->count - 1;
}

static enum status out_of_memory(struct error *err)
{
    return cap_fail(err, STATUS_MEMORY, "no memory for bins");
}

static void add_sums(struct bin_sums *to, const struct bin_sums *from)
{
    to->count += from->count;
    to->w += from->w;
    to->w_systematic += from->w_systematic;
    to->w_tilt += from->w_tilt;
    to->w_disc += from->w_disc;
    to->ww += from->ww;
    to->w_back += from->w_back;
    for (int i = 0; i < 2; i++)
        to->w_spread[i] += from->w_spread[i];
    for (int c = 0; c < 3; c++) {
        to->w_f[c] += from->w_f[c];
        to->w_ff[c] += from->w_ff[c];
        to->w_angle[c] += from->w_angle[c];
        to->ww_noise[c] += from->ww_noise[c];
        to->w_f_back[c] += from->w_f_back[c];
        to->ww_noise_back[c] += from->ww_noise_back[c];
        to->w_bounced[c] += from->w_bounced[c];
    }
}

static void add_mosaic(struct mosaic_sums *to, const struct mosaic_sums *from)
{
    for (int c = 0; c < 3; c++) {
        to->own_w[c] += from->own_w[c];
        to->lent_w[c] += from->lent_w[c];
        to->lent_w_f[c] += from->lent_w_f[c];
        to->lent_w_noise[c] += from->lent_w_noise[c];
        for (int i = 0; i < 3; i++) {
            to->own_w_angle[c][i] += from->own_w_angle[c][i];
            to->lent_w_angle[c][i] += from->lent_w_angle[c][i];
        }
    }
}

enum status rec_tally_add_sums(struct tally *tally, int bin, const struct bin_sums *sums,
                               const struct mosaic_sums *mosaic, struct error *err)
{
    int place = place_of(tally, bin);
    if (place >= 0 && mosaic && !tally->mosaic)
        tally->mosaic = calloc((size_t)tally->room, sizeof *tally->mosaic);
    if (place < 0 || (mosaic && !tally->mosaic))
        return out_of_memory(err);
    add_sums(&tally->sums[place], sums);
    if (mosaic)
        add_mosaic(&tally->mosaic[place], mosaic);
    return STATUS_OK;
}

const struct mosaic_sums *rec_tally_mosaic(const struct tally *tally, int bin)
{
    return tally->mosaic ? &tally->mosaic[tally->slot[bin] - 1] : NULL;
}

// Into [low, high], a hair from either end: rounding must not carry a mean out of its bin.
static double keep_within(double x, double low, double high)
{
    double hair = 1e-12 * (high - low) + 1e-15;
    return fmin(fmax(x, low + hair), high - hair);
}

static half_diff centroid(const fixed128 w_angle[3], double w, struct grid grid, int bin)
{
    half_diff low, high;
    rec_grid_ranges(grid, bin, &low, &high);
    return (half_diff){
        .theta_h = keep_within(rec_unfix(w_angle[0]) / w, low.theta_h, high.theta_h),
        .theta_d = keep_within(rec_unfix(w_angle[1]) / w, low.theta_d, high.theta_d),
        .phi_d = keep_within(rec_unfix(w_angle[2]) / w, low.phi_d, high.phi_d),
    };
}

/** All sums of a bin. */
struct all_sums {
    const struct bin_sums *sums;
    const struct mosaic_sums *mosaic;  // NULL: none
};

static struct all_sums sums_of(const struct tally *tally, int bin)
{
    return (struct all_sums){&tally->sums[tally->slot[bin] - 1], rec_tally_mosaic(tally, bin)};
}

// All samples but those of other channels alone: the weight of a channel, and its angles.
static fixed128 weight_of(const struct all_sums *s, int c)
{
    const fixed128 *own = s->mosaic ? s->mosaic->own_w : NULL;
    return s->sums->w - (own ? own[(c + 1) % 3] + own[(c + 2) % 3] : 0);
}

static half_diff own_centroid(const struct all_sums *s, int c, struct grid grid, int bin)
{
    fixed128 w_angle[3];
    for (int i = 0; i < 3; i++) {
        w_angle[i] = s->sums->w_angle[i];
        for (int k = 1; k < 3 && s->mosaic; k++)
            w_angle[i] -= s->mosaic->own_w_angle[(c + k) % 3][i];
    }
    return centroid(w_angle, rec_unfix(weight_of(s, c)), grid, bin);
}

// A channel that no photosite in the bin measured, from those between whose neighbours it is known.
// Neighbours share photosites: their noise is taken as one.
static void finish_lent(struct bin *b, const struct mosaic_sums *s, struct grid grid, int c)
{
    double w = rec_unfix(s->lent_w[c]);
    b->lent[c] = true;
    b->mean[c] = rec_unfix(s->lent_w_f[c]) / w;
    b->noise[c] = rec_unfix(s->lent_w_noise[c]) / w;
    b->sigma[c] = hypot(b->noise[c], b->mean[c] * b->systematic);
    b->swapped[c] = b->swapped_noise[c] = NAN;
    b->own[c] = centroid(s->lent_w_angle[c], w, grid, b->index);
}

static bool has_channels(const struct mosaic_sums *m)
{
    return m && (m->own_w[0] > 0 || m->own_w[1] > 0 || m->own_w[2] > 0);
}

static void finish_channel(struct bin *b, const struct all_sums *all, struct grid grid, int c)
{
    const struct bin_sums *s = all->sums;
    double w = rec_unfix(weight_of(all, c)), back = rec_unfix(s->w_back);
    bool both = back > 0 && back < w && !has_channels(all->mosaic);
    b->mean[c] = rec_unfix(s->w_f[c]) / w;
    b->bounced[c] = rec_unfix(s->w_bounced[c]) / w;
    b->scatter[c] = sqrt(fmax(0, rec_unfix(s->w_ff[c]) / w - b->mean[c] * b->mean[c]));
    b->noise[c] = sqrt(rec_unfix(s->ww_noise[c])) / w;
    b->sigma[c] = hypot(b->noise[c], b->mean[c] * b->systematic);
    double forth = rec_unfix(s->w_f[c] - s->w_f_back[c]) / (w - back);
    double noise_forth = sqrt(rec_unfix(s->ww_noise[c] - s->ww_noise_back[c])) / (w - back);
    double noise_back = sqrt(rec_unfix(s->ww_noise_back[c])) / back;
    b->swapped[c] = both ? forth - rec_unfix(s->w_f_back[c]) / back : NAN;
    b->swapped_noise[c] = both ? hypot(noise_forth, noise_back) : NAN;
    b->own[c] = own_centroid(all, c, grid, b->index);
}

static struct bin finish_bin(const struct all_sums *all, struct grid grid, int index)
{
    const struct bin_sums *s = all->sums;
    double w = rec_unfix(s->w);
    struct bin b = {
        .index = index,
        .count = s->count > INT32_MAX ? INT32_MAX : (int32_t)s->count,
        .centroid = centroid(s->w_angle, w, grid, index),
        .systematic = rec_unfix(s->w_systematic) / w,
        .tilt = rec_unfix(s->w_tilt) / w,
        .spread = {rec_unfix(s->w_spread[0]) / w, rec_unfix(s->w_spread[1]) / w},
        .disc = rec_unfix(s->w_disc) / w,
        .alone = fmin(1, rec_unfix(s->ww) / (w * w)),
    };
    for (int c = 0; c < 3; c++)
        if (weight_of(all, c) > 0)
            finish_channel(&b, all, grid, c);
        else
            finish_lent(&b, all->mosaic, grid, c);
    return b;
}

static bool in_every_channel(struct all_sums s)
{
    bool all = true;
    for (int c = 0; c < 3 && s.mosaic; c++)
        all = all && (weight_of(&s, c) > 0 || s.mosaic->lent_w[c] > 0);
    return all;
}

enum status rec_tally_finish(struct bins *bins, const struct tally *tally, struct error *err)
{
    const size_t most = (size_t)tally->count + 1;
    struct bin *bin = malloc(most * sizeof *bin);
    int *index = malloc(most * sizeof *index), count = 0;
    if (!bin || !index) {
        free(bin);
        free(index);
        return out_of_memory(err);
    }
    for (int i = 0; i < rec_grid_bins(tally->grid); i++)
        if (tally->slot[i] && in_every_channel(sums_of(tally, i)))
            index[count++] = i;
#pragma omp parallel for schedule(static)
    for (int k = 0; k < count; k++) {
        const struct all_sums all = sums_of(tally, index[k]);
        bin[k] = finish_bin(&all, tally->grid, index[k]);
    }
    free(index);
    *bins = (struct bins){.bin = bin, .count = count, .grid = tally->grid};
    return STATUS_OK;
}

void rec_bins_free(struct bins *bins)
{
    free(bins->bin);
    *bins = (struct bins){0};
}

double rec_median_sigma(const struct bins *bins)
{
    double *relative = malloc((3 * (size_t)bins->count + 1) * sizeof *relative);
    int n = 0;
    for (int i = 0; relative && i < bins->count; i++)
        for (int c = 0; c < 3; c++)
            if (bins->bin[i].mean[c] > 0)
                relative[n++] = bins->bin[i].sigma[c] / bins->bin[i].mean[c];
    double median = rec_quantile(relative, relative ? n : 0, 0.5);
    free(relative);
    return median;
}
