/* shot_bins.c -- sums of one shot's samples per bin.
 *
 * Method.   One thread goes through a shot in the order of its photosites, so that plain sums in
 *           double are the same on every run; what all shots share is exact (bins.c). Samples of a
 *           bin are kept apart by the sign of phi_d and, of a mosaic, by channel: what differs
 *           between them is then a matter of which sum they are in.
 */
#include "shot_bins.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

enum { PLANES = 12 };  // 3 channels, lending or not, phi_d >= 0 and < 0

#define NOWHERE UINT32_MAX  // of lanes that are not in use: 12 x 2^28 bins are fewer

/** Sums of the samples of one bin, channel and sign of phi_d, times their weights: of 1, f, f^2 and
 *  so on. T_NOISE has the variances times the weights once more; of a mosaic only of the measured
 *  channel, and the standard deviations of those that are lent. */
enum term {
    T_W,
    T_SYSTEMATIC,
    T_TILT,
    T_DISC,
    T_SPREAD,
    T_ANGLE = T_SPREAD + 2,
    T_F = T_ANGLE + 3,
    T_FF = T_F + 3,
    T_NOISE = T_FF + 3,
    T_BOUNCED = T_NOISE + 3,
    T_END = T_BOUNCED + 3
};
static_assert((int)T_END <= (int)SHOT_TERMS, "a sum for each term");

struct shot_sums {
    double term[SHOT_TERMS];
    int bin, plane, channel, count;
};

void rec_shot_free(struct shot_bins *shot)
{
    free(shot->slot);
    free(shot->sums);
    *shot = (struct shot_bins){0};
}

// New sums; NULL: no memory.
static struct shot_sums *begin_sums(struct shot_bins *shot, int bin, int plane, int channel)
{
    if (shot->count == shot->room) {
        int room = shot->room ? 2 * shot->room : 4096;
        struct shot_sums *sums = realloc(shot->sums, (size_t)room * sizeof *sums);
        if (!sums)
            return NULL;
        shot->sums = sums;
        shot->room = room;
    }
    shot->sums[shot->count] = (struct shot_sums){.bin = bin, .plane = plane, .channel = channel};
    return &shot->sums[shot->count++];
}

static inline float at_most(float x, float most)
{
    return x < most ? x : most;
}

// The terms of a block of lanes, of which only the used ones have a meaning.
WIDE static void make_terms(float (*restrict term)[BLOCK], const struct strip *restrict s,
                            int begin)
{
    for (int k = 0; k < BLOCK; k++) {
        const int i = begin + k;
        term[T_W][k] = 1;
        term[T_SYSTEMATIC][k] = at_most(s->systematic[i], 1e3F);
        term[T_TILT][k] = at_most(s->tilt[i], (float)CAP_PI);
        term[T_DISC][k] = at_most(s->disc[i], 1);
        term[T_SPREAD][k] = at_most(s->spread[0][i], 1);
        term[T_SPREAD + 1][k] = at_most(s->spread[1][i], 1);
        term[T_ANGLE][k] = s->theta_h[i];
        term[T_ANGLE + 1][k] = s->theta_d[i];
        term[T_ANGLE + 2][k] = s->phi_d[i];
        for (int c = 0; c < 3; c++) {
            term[T_F + c][k] = s->f[c][i];
            term[T_FF + c][k] = s->f[c][i] * s->f[c][i];
            term[T_NOISE + c][k] = s->weight[i] * s->noise[c][i];
            term[T_BOUNCED + c][k] = s->bounced[c][i];
        }
        for (int t = T_END; t < SHOT_TERMS; t++)
            term[t][k] = 0;
    }
}

// What a mosaic's photosites lend is as unsure as their neighbours are, however many there are.
static void lend_noise(float (*term)[BLOCK], const struct strip *s, int begin)
{
    for (int k = 0; k < BLOCK; k++)
        for (int c = 0; c < 3 && s->channel[begin + k] >= 0; c++)
            if (s->channel[begin + k] != c)
                term[T_NOISE + c][k] = sqrtf(s->noise[c][begin + k]);
}

/** Numbers that are moved as one; they may lie anywhere. */
typedef float four __attribute__((vector_size(16), aligned(4), may_alias));
typedef double four_wide __attribute__((vector_size(32), aligned(8), may_alias));

// Terms side by side for each lane: 4 x 4 numbers at a time are turned over their diagonal.
WIDE static void turn_terms(float (*restrict lane)[SHOT_TERMS], const float (*restrict term)[BLOCK])
{
    for (int t = 0; t < SHOT_TERMS; t += 4)
        for (int k = 0; k < BLOCK; k += 4) {
            four a = *(const four *)(term[t] + k), b = *(const four *)(term[t + 1] + k);
            four c = *(const four *)(term[t + 2] + k), d = *(const four *)(term[t + 3] + k);
            four ab0 = __builtin_shufflevector(a, b, 0, 4, 2, 6);  // lanes 0 and 2 of both
            four ab1 = __builtin_shufflevector(a, b, 1, 5, 3, 7);
            four cd0 = __builtin_shufflevector(c, d, 0, 4, 2, 6);
            four cd1 = __builtin_shufflevector(c, d, 1, 5, 3, 7);
            *(four *)(lane[k] + t) = __builtin_shufflevector(ab0, cd0, 0, 1, 4, 5);
            *(four *)(lane[k + 1] + t) = __builtin_shufflevector(ab1, cd1, 0, 1, 4, 5);
            *(four *)(lane[k + 2] + t) = __builtin_shufflevector(ab0, cd0, 2, 3, 6, 7);
            *(four *)(lane[k + 3] + t) = __builtin_shufflevector(ab1, cd1, 2, 3, 6, 7);
        }
}

static void lane_terms(float (*lane)[SHOT_TERMS], const struct strip *s)
{
    float term[SHOT_TERMS][BLOCK];
    for (int begin = s->use.first; begin < s->use.end; begin += BLOCK) {
        make_terms(term, s, begin);
        lend_noise(term, s, begin);
        turn_terms(lane + begin, (const float(*)[BLOCK])term);
    }
}

static int index_of(struct grid grid, const struct strip *s, int i)
{
    return rec_grid_index(grid, (half_diff){s->theta_h[i], s->theta_d[i], s->phi_d[i]});
}

// Lanes beside each other that belong in the same bin, in their order.
WIDE static void add_run(double *restrict sum, const float (*restrict term)[SHOT_TERMS],
                         const float *restrict weight, int count)
{
    enum { PARTS = SHOT_TERMS / 4 };
    static_assert(SHOT_TERMS % 4 == 0, "whole vectors");
    four_wide part[PARTS];
    for (int k = 0; k < PARTS; k++)
        part[k] = *(const four_wide *)(sum + 4 * k);
    for (int i = 0; i < count; i++)
        for (int k = 0; k < PARTS; k++)
            part[k] += (double)weight[i]
                       * __builtin_convertvector(*(const four *)(term[i] + 4 * k), four_wide);
    for (int k = 0; k < PARTS; k++)
        *(four_wide *)(sum + 4 * k) = part[k];
}

/** Lanes beside each other that belong in the same sums. */
struct lane_run {
    int begin, end, place;  // place: index into sums
};

// Where samples belong, of all bins of all planes.
WIDE static void take_keys(uint32_t *restrict key, const struct strip *restrict s,
                           const int *restrict bin, uint32_t bins)
{
    FOR_LANES (i, s->use) {
        int mosaic = 4 * s->channel[i] + 2 * s->lends[i], back = s->phi_d[i] < 0 ? 1 : 0;
        int plane = (s->channel[i] >= 0 ? mosaic : 0) + back;
        uint32_t place = (uint32_t)plane * bins + (uint32_t)bin[i];
        key[i] = s->fate[i] == FATE_USED ? place : NOWHERE;
    }
}

static void find_keys(uint32_t key[LANES], const struct shot_bins *shot, const struct strip *s)
{
    const bool merl = memcmp(&shot->grid, &rec_merl_grid, sizeof shot->grid) == 0;
    int own[LANES];
    for (int i = s->use.first; i < s->use.end && !merl; i++)
        own[i] = s->fate[i] == FATE_USED ? index_of(shot->grid, s, i) : 0;
    take_keys(key, s, merl ? s->bin : own, (uint32_t)rec_grid_bins(shot->grid));
}

// Index into sums; -1: no memory.
static inline int place_of(struct shot_bins *shot, uint32_t key, int channel)
{
    int32_t *slot = &shot->slot[key];
    const uint32_t bins = (uint32_t)rec_grid_bins(shot->grid);
    if (!*slot && begin_sums(shot, (int)(key % bins), (int)(key / bins), channel))
        *slot = shot->count;
    return *slot - 1;
}

// Runs of the lanes in use, and how many; what is there is asked for at once. -1: no memory.
static int find_runs(struct lane_run run[LANES], struct shot_bins *shot, const struct strip *s)
{
    uint32_t key[LANES];
    int runs = 0;
    find_keys(key, shot, s);
    for (int begin = s->use.first, i; begin < s->use.end; begin = i) {
        for (i = begin + 1; i < s->use.end && key[i] == key[begin]; i++)
            ;
        if (key[begin] == NOWHERE)
            continue;
        assert(s->weight[begin] > 0 && s->weight[begin] <= 1 && s->channel[begin] < 3);
        int place = place_of(shot, key[begin], s->channel[begin]);
        if (place < 0)
            return -1;
        run[runs++] = (struct lane_run){begin, i, place};
        for (int k = 0; k < SHOT_TERMS; k += 8)
            __builtin_prefetch(&shot->sums[place].term[k], 1);
    }
    return runs;
}

enum status rec_shot_add(struct shot_bins *shot, const struct strip *s, struct error *err)
{
    float term[LANES][SHOT_TERMS];
    struct lane_run run[LANES];
    if (!shot->slot)
        shot->slot = calloc(PLANES * (size_t)rec_grid_bins(shot->grid), sizeof *shot->slot);
    int runs = shot->slot ? find_runs(run, shot, s) : -1;
    if (runs < 0)
        return cap_fail(err, STATUS_MEMORY, "no memory for a shot's bins");
    lane_terms(term, s);
    for (int k = 0; k < runs; k++) {
        struct shot_sums *to = &shot->sums[run[k].place];
        const int begin = run[k].begin, count = run[k].end - begin;
        add_run(to->term, (const float(*)[SHOT_TERMS])term + begin, s->weight + begin, count);
        to->count += count;
    }
    return STATUS_OK;
}

// What a channel that was measured enters.
static void exact_channel(struct bin_sums *b, const struct shot_sums *s, int c)
{
    fixed128 w_f = rec_fix(s->term[T_F + c]), noise = rec_fix(s->term[T_NOISE + c]);
    bool back = s->plane % 2;
    b->w_f[c] = w_f;
    b->w_ff[c] = rec_fix(s->term[T_FF + c]);
    b->ww_noise[c] = noise;
    b->w_bounced[c] = rec_fix(s->term[T_BOUNCED + c]);
    b->w_f_back[c] = back ? w_f : 0;
    b->ww_noise_back[c] = back ? noise : 0;
}

static struct bin_sums exact(const struct shot_sums *s)
{
    struct bin_sums b = {.count = s->count,
                         .w = rec_fix(s->term[T_W]),
                         .w_systematic = rec_fix(s->term[T_SYSTEMATIC]),
                         .w_tilt = rec_fix(s->term[T_TILT]),
                         .w_disc = rec_fix(s->term[T_DISC]),
                         .ww = rec_fix(s->term[T_W] * s->term[T_W])};
    b.w_back = s->plane % 2 ? b.w : 0;
    for (int i = 0; i < 2; i++)
        b.w_spread[i] = rec_fix(s->term[T_SPREAD + i]);
    const double turn = s->plane % 2 ? CAP_PI : 0;  // folds phi_d
    for (int i = 0; i < 3; i++)
        b.w_angle[i] = rec_fix(s->term[T_ANGLE + i] + (i < 2 ? 0 : turn * s->term[T_W]));
    for (int c = 0; c < 3; c++)
        if (s->channel < 0 || s->channel == c)
            exact_channel(&b, s, c);
    return b;
}

// What samples of one channel enter besides, and what they lend to the others.
static struct mosaic_sums exact_mosaic(const struct shot_sums *s, const struct bin_sums *b)
{
    struct mosaic_sums m = {0};
    bool lends = s->plane / 2 % 2;
    m.own_w[s->channel] = b->w;
    memcpy(m.own_w_angle[s->channel], b->w_angle, sizeof b->w_angle);
    for (int c = 0; c < 3 && lends; c++) {
        if (c == s->channel)
            continue;
        m.lent_w[c] = b->w;
        m.lent_w_f[c] = rec_fix(s->term[T_F + c]);
        m.lent_w_noise[c] = rec_fix(s->term[T_NOISE + c]);
        memcpy(m.lent_w_angle[c], b->w_angle, sizeof b->w_angle);
    }
    return m;
}

static enum status end_sums(struct tally *tally, const struct shot_sums *s, struct error *err)
{
    struct bin_sums sums = exact(s);
    if (s->channel < 0)
        return rec_tally_add_sums(tally, s->bin, &sums, NULL, err);
    struct mosaic_sums mosaic = exact_mosaic(s, &sums);
    return rec_tally_add_sums(tally, s->bin, &sums, &mosaic, err);
}

enum status rec_shot_end(struct shot_bins *shot, struct tally *tally, struct error *err)
{
    const size_t bins = (size_t)rec_grid_bins(shot->grid);
    enum status status = STATUS_OK;
    for (int k = 0; k < shot->count; k++) {
        const struct shot_sums *s = &shot->sums[k];
        shot->slot[(size_t)s->plane * bins + (size_t)s->bin] = 0;
        if (!status)
            status = end_sums(tally, s, err);
    }
    shot->count = 0;
    return status;
}
