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

// The terms of all lanes, of which only the used ones have a meaning: [lane][term].
WIDE static void make_terms(double (*term)[SHOT_TERMS], const struct strip *s)
{
    for (int i = 0; i < LANES; i++) {
        double w = s->weight[i], phi_d = s->phi_d[i];
        term[i][T_COUNT] = 1;
        term[i][T_W] = w;
        term[i][T_SYSTEMATIC] = w * at_most(s->systematic[i], 1e3);
        term[i][T_TILT] = w * at_most(s->tilt[i], CAP_PI);
        term[i][T_DISC] = w * at_most(s->disc[i], 1);
        term[i][T_SPREAD] = w * at_most(s->spread[0][i], 1);
        term[i][T_SPREAD + 1] = w * at_most(s->spread[1][i], 1);
        term[i][T_ANGLE] = w * s->theta_h[i];
        term[i][T_ANGLE + 1] = w * s->theta_d[i];
        term[i][T_ANGLE + 2] = w * (phi_d < 0 ? phi_d + CAP_PI : phi_d);
        for (int c = 0; c < 3; c++) {
            double f = s->f[c][i];
            term[i][T_F + c] = w * f;
            term[i][T_FF + c] = w * f * f;
            bool measured = (s->channel[i] < 0) | (s->channel[i] == c);
            term[i][T_NOISE + c] = w * (measured ? w * s->noise[c][i] : sqrt(s->noise[c][i]));
            term[i][T_BOUNCED + c] = w * s->bounced[c][i];
        }
        for (int k = T_END; k < SHOT_TERMS; k++)
            term[i][k] = 0;
    }
}

static int index_of(struct grid grid, const struct strip *s, int i)
{
    return rec_grid_index(grid, (half_diff){s->theta_h[i], s->theta_d[i], s->phi_d[i]});
}

enum status rec_shot_add(struct shot_bins *shot, const struct strip *s, struct error *err)
{
    const bool merl = memcmp(&shot->grid, &rec_merl_grid, sizeof shot->grid) == 0;
    const int bins = rec_grid_bins(shot->grid);
    double term[LANES][SHOT_TERMS];
    if (!shot->slot)
        shot->slot = calloc(PLANES * (size_t)bins, sizeof *shot->slot);
    if (!shot->slot)
        return out_of_memory(err);
    make_terms(term, s);
    for (int i = 0; i < LANES; i++) {
        if (s->fate[i] != FATE_USED)
            continue;
        assert(s->weight[i] > 0 && s->weight[i] <= 1 && s->channel[i] < 3);
        bool mosaic = s->channel[i] >= 0;
        int plane =
            4 * (mosaic ? s->channel[i] : 0) + 2 * (mosaic && s->lends[i]) + (s->phi_d[i] < 0);
        int bin = merl ? s->bin[i] : index_of(shot->grid, s, i);
        int32_t *slot = &shot->slot[(size_t)plane * (size_t)bins + (size_t)bin];
        if (!*slot) {
            if (!begin_sums(shot, bin, plane, s->channel[i]))
                return out_of_memory(err);
            *slot = shot->count;
        }
        double *sum = shot->sums[*slot - 1].term;
        for (int k = 0; k < SHOT_TERMS; k++)
            sum[k] += term[i][k];
    }
    return STATUS_OK;
}

// What a channel of the sums enters.
static void exact_channel(struct bin_sums *b, const struct shot_sums *s, int c)
{
    fixed128 w_f = rec_fix(s->term[T_F + c]), noise = rec_fix(s->term[T_NOISE + c]);
    bool back = s->plane % 2, lends = s->plane / 2 % 2;
    if (s->channel < 0 || s->channel == c) {
        b->w_f[c] = w_f;
        b->w_ff[c] = rec_fix(s->term[T_FF + c]);
        b->ww_noise[c] = noise;
        b->w_bounced[c] = rec_fix(s->term[T_BOUNCED + c]);
        b->w_f_back[c] = back ? w_f : 0;
        b->ww_noise_back[c] = back ? noise : 0;
    } else if (lends) {
        b->lent_w[c] = b->w;
        b->lent_w_f[c] = w_f;
        b->lent_w_noise[c] = noise;
        memcpy(b->lent_w_angle[c], b->w_angle, sizeof b->w_angle);
    }
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
        exact_channel(&b, s, c);
    if (s->channel >= 0) {
        b.own_w[s->channel] = b.w;
        memcpy(b.own_w_angle[s->channel], b.w_angle, sizeof b.w_angle);
    }
    return b;
}

enum status rec_shot_end(struct shot_bins *shot, struct tally *tally, struct error *err)
{
    const size_t bins = (size_t)rec_grid_bins(shot->grid);
    enum status status = STATUS_OK;
    for (int k = 0; k < shot->count; k++) {
        const struct shot_sums *s = &shot->sums[k];
        shot->slot[(size_t)s->plane * bins + (size_t)s->bin] = 0;
        struct bin_sums sums = exact(s);
        if (!status)
            status = rec_tally_add_sums(tally, s->bin, &sums, err);
    }
    shot->count = 0;
    return status;
}
