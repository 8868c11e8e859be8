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

/** Sums of the samples of one bin, channel and sign of phi_d. Of a mosaic T_NOISE has the variances
 *  of the measured channel, and the standard deviations of those that are lent. */
enum term {
    T_COUNT,
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
    int bin, plane, channel;
};

void rec_shot_free(struct shot_bins *shot)
{
    free(shot->slot);
    free(shot->sums);
    *shot = (struct shot_bins){0};
}

static enum status out_of_memory(struct error *err)
{
    return cap_fail(err, STATUS_MEMORY, "no memory for a shot's bins");
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

static inline double at_most(double x, double most)
{
    return x < most ? x : most;
}

// The terms of a block of lanes, of which only the used ones have a meaning.
WIDE static void make_terms(double (*restrict term)[BLOCK], const struct strip *restrict s,
                            int begin)
{
    for (int k = 0; k < BLOCK; k++) {
        const int i = begin + k;
        double w = s->weight[i], phi_d = s->phi_d[i];
        term[T_COUNT][k] = 1;
        term[T_W][k] = w;
        term[T_SYSTEMATIC][k] = w * at_most(s->systematic[i], 1e3);
        term[T_TILT][k] = w * at_most(s->tilt[i], CAP_PI);
        term[T_DISC][k] = w * at_most(s->disc[i], 1);
        term[T_SPREAD][k] = w * at_most(s->spread[0][i], 1);
        term[T_SPREAD + 1][k] = w * at_most(s->spread[1][i], 1);
        term[T_ANGLE][k] = w * s->theta_h[i];
        term[T_ANGLE + 1][k] = w * s->theta_d[i];
        term[T_ANGLE + 2][k] = w * (phi_d < 0 ? phi_d + CAP_PI : phi_d);
        for (int c = 0; c < 3; c++) {
            term[T_F + c][k] = w * s->f[c][i];
            term[T_FF + c][k] = w * s->f[c][i] * s->f[c][i];
            term[T_NOISE + c][k] = w * (w * s->noise[c][i]);
            term[T_BOUNCED + c][k] = w * s->bounced[c][i];
        }
    }
}

// What a mosaic's photosites lend is as unsure as their neighbours are, however many there are.
static void lend_noise(double (*term)[BLOCK], const struct strip *s, int begin)
{
    for (int k = 0; k < BLOCK; k++)
        for (int c = 0; c < 3 && s->channel[begin + k] >= 0; c++)
            if (s->channel[begin + k] != c)
                term[T_NOISE + c][k] = s->weight[begin + k] * sqrt(s->noise[c][begin + k]);
}

/** Numbers that are moved as one; they may lie anywhere. */
typedef double four __attribute__((vector_size(32), aligned(8), may_alias));
typedef double eight __attribute__((vector_size(64), aligned(8), may_alias));

// Terms side by side for each lane: 4 x 4 numbers at a time are turned over their diagonal.
WIDE static void turn_terms(double (*restrict lane)[SHOT_TERMS],
                            const double (*restrict term)[BLOCK])
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

static void lane_terms(double (*lane)[SHOT_TERMS], const struct strip *s)
{
    double term[SHOT_TERMS][BLOCK];
    memset(term[T_END], 0, (SHOT_TERMS - T_END) * sizeof *term);
    for (int begin = s->use.first; begin < s->use.end; begin += BLOCK) {
        make_terms(term, s, begin);
        lend_noise(term, s, begin);
        turn_terms(lane + begin, (const double(*)[BLOCK])term);
    }
}

static int index_of(struct grid grid, const struct strip *s, int i)
{
    return rec_grid_index(grid, (half_diff){s->theta_h[i], s->theta_d[i], s->phi_d[i]});
}

// Lanes beside each other that belong in the same bin, in their order.
WIDE static void add_run(double *sum, const double (*term)[SHOT_TERMS], int count)
{
    static_assert(SHOT_TERMS == 24, "three times eight");
    eight a = *(eight *)sum, b = *(eight *)(sum + 8), c = *(eight *)(sum + 16);
    for (int i = 0; i < count; i++) {
        a += *(const eight *)term[i];
        b += *(const eight *)(term[i] + 8);
        c += *(const eight *)(term[i] + 16);
    }
    *(eight *)sum = a;
    *(eight *)(sum + 8) = b;
    *(eight *)(sum + 16) = c;
}

// Where a sample belongs: index into sums; -1: no memory.
static inline int place_of(struct shot_bins *shot, const struct strip *s, int i, bool merl,
                           size_t bins)
{
    bool mosaic = s->channel[i] >= 0;
    int plane = 4 * (mosaic ? s->channel[i] : 0) + 2 * (mosaic && s->lends[i]) + (s->phi_d[i] < 0);
    int bin = merl ? s->bin[i] : index_of(shot->grid, s, i);
    int32_t *slot = &shot->slot[(size_t)plane * bins + (size_t)bin];
    if (!*slot && begin_sums(shot, bin, plane, s->channel[i]))
        *slot = shot->count;
    return *slot - 1;
}

// The places of all lanes, -1 of those that are not in use; what is there is asked for at once.
static enum status find_places(int place[LANES + 1], struct shot_bins *shot, const struct strip *s,
                               struct error *err)
{
    const bool merl = memcmp(&shot->grid, &rec_merl_grid, sizeof shot->grid) == 0;
    const size_t bins = (size_t)rec_grid_bins(shot->grid);
    int last = -1;
    place[s->use.end] = -1;
    for (int i = s->use.first; i < s->use.end; i++) {
        place[i] = -1;
        if (s->fate[i] != FATE_USED)
            continue;
        assert(s->weight[i] > 0 && s->weight[i] <= 1 && s->channel[i] < 3);
        place[i] = place_of(shot, s, i, merl, bins);
        if (place[i] < 0)
            return out_of_memory(err);
        if (place[i] != last)
            for (int k = 0; k < SHOT_TERMS; k += 8)
                __builtin_prefetch(&shot->sums[place[i]].term[k], 1);
        last = place[i];
    }
    return STATUS_OK;
}

enum status rec_shot_add(struct shot_bins *shot, const struct strip *s, struct error *err)
{
    double term[LANES][SHOT_TERMS];
    int place[LANES + 1];
    if (!shot->slot)
        shot->slot = calloc(PLANES * (size_t)rec_grid_bins(shot->grid), sizeof *shot->slot);
    if (!shot->slot)
        return out_of_memory(err);
    enum status status = find_places(place, shot, s, err);
    if (status)
        return status;
    lane_terms(term, s);
    for (int begin = s->use.first, i = begin + 1; begin < s->use.end; begin = i++) {
        while (place[begin] >= 0 && place[i] == place[begin])
            i++;
        if (place[begin] >= 0)
            add_run(shot->sums[place[begin]].term, (const double(*)[SHOT_TERMS])term + begin,
                    i - begin);
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
    struct bin_sums b = {.count = (int64_t)s->term[T_COUNT],
                         .w = rec_fix(s->term[T_W]),
                         .w_systematic = rec_fix(s->term[T_SYSTEMATIC]),
                         .w_tilt = rec_fix(s->term[T_TILT]),
                         .w_disc = rec_fix(s->term[T_DISC]),
                         .ww = rec_fix(s->term[T_W] * s->term[T_W])};
    b.w_back = s->plane % 2 ? b.w : 0;
    for (int i = 0; i < 2; i++)
        b.w_spread[i] = rec_fix(s->term[T_SPREAD + i]);
    for (int i = 0; i < 3; i++)
        b.w_angle[i] = rec_fix(s->term[T_ANGLE + i]);
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
