/* samples.c -- photosites become reflectance samples.
 *
 * Method.   f = L / (V light cos(theta_i)/r^2), with the directions and the irradiance of the
 *           footprint (footprint.c) and L the radiance of the map.
 *           What the lit board adds to L is taken out first (bounce_map.c).
 * Errors.   Noise is the map's. What a wrong sphere, pose or lamp does (sample_errors.c) neighbours
 *           share: it is kept apart from noise and never averages out (bins.c).
 */
#include "strip.h"

#include <float.h>

// Does the segment between two points pass through the board?
static bool behind_board(const struct board_extent *board, vec3 a, vec3 b)
{
    if (!board || (a.z > 0) == (b.z > 0))
        return false;
    double t = a.z / (a.z - b.z);
    double x = a.x + t * (b.x - a.x), y = a.y + t * (b.y - a.y);
    return x > board->low[0] && x < board->high[0] && y > board->low[1] && y < board->high[1];
}

// What stands in the way is avoided by so much, mm.
static double berth(const struct viewing *v, vec3 point)
{
    return v->photosite * vec3_length(vec3_sub(v->eye, point));
}

static bool any_blocker(const struct viewing *v)
{
    return v->blockers && v->blockers->count > 0;
}

bool rec_occluded(const struct viewing *v, vec3 point)
{
    return behind_board(v->board, v->eye, point)
           || (any_blocker(v) && rec_blocked(v->blockers, v->eye, point, berth(v, point)));
}

static bool shadowed(const struct viewing *v, vec3 point)
{
    if (!v->lamp->at_infinity && behind_board(v->board, v->lamp_position, point))
        return true;
    vec3 lamp = cal_lamp_position(v->lamp, v->view->view_from_world);
    return any_blocker(v) && rec_blocked(v->blockers, lamp, point, berth(v, point));
}

// What keeps a used photosite from being seen or lit; FATE_USED: nothing.
static enum fate blocked(const struct viewing *v, vec3 point)
{
    return rec_occluded(v, point) ? FATE_OCCLUDED : shadowed(v, point) ? FATE_SHADOWED : FATE_USED;
}

void rec_strip_block(struct strip *s, const struct viewing *v)
{
    bool free_way = !v->board && !any_blocker(v);
    for (int i = 0; i < LANES && !free_way; i++)
        if (s->fate[i] == FATE_USED)
            s->fate[i] = blocked(v, rec_lane(&s->point, i));
}

/** Sums over three rows of the map, [3 + 3 i + c] is channel c of lane i; and of these over
 * channels, [1 + i] is lane i's. Photosites that were saturated in all frames, and the other
 * channels of a mosaic, have nothing to tell. */
struct rows {
    float value[3 * (LANES + 2)], variance[3 * (LANES + 2)], count[3 * (LANES + 2)];
};
struct columns {
    float value[LANES + 2], variance[LANES + 2], count[LANES + 2];
};

/** Three rows of the map. most: the largest variance that tells, -1 where there is no such row. */
struct three_rows {
    const float *value[3], *variance[3];
    float most[3];
};

static inline void add_number(float sum[3], float x, float variance, float most)
{
    bool tells = (x <= FLT_MAX) & (x >= -FLT_MAX) & (variance <= most);
    sum[0] += tells ? x : 0;
    sum[1] += tells ? variance : 0;
    sum[2] += tells ? 1 : 0;
}

// `count` numbers, the first of which goes to [first].
WIDE static void add_rows(struct rows *restrict to, const struct three_rows *of, int first,
                          int count)
{
    const float *x0 = of->value[0], *x1 = of->value[1], *x2 = of->value[2];
    const float *v0 = of->variance[0], *v1 = of->variance[1], *v2 = of->variance[2];
    const float m0 = of->most[0], m1 = of->most[1], m2 = of->most[2];
    for (int k = 0; k < count; k++) {
        float sum[3] = {0};
        add_number(sum, x0[k], v0[k], m0);
        add_number(sum, x1[k], v1[k], m1);
        add_number(sum, x2[k], v2[k], m2);
        to->value[first + k] = sum[0];
        to->variance[first + k] = sum[1];
        to->count[first + k] = sum[2];
    }
}

WIDE static void add_channels(struct columns *restrict to, const struct rows *restrict from,
                              int first, int end)
{
    for (int i = first; i < end; i++) {
        to->value[i] = from->value[3 * i] + from->value[3 * i + 1] + from->value[3 * i + 2];
        to->variance[i] =
            from->variance[3 * i] + from->variance[3 * i + 1] + from->variance[3 * i + 2];
        to->count[i] = from->count[3 * i] + from->count[3 * i + 1] + from->count[3 * i + 2];
    }
}

// What the next strip reads of the row below is on its way meanwhile.
static void ask_for_next(const struct strip *s, const struct radiance *map)
{
    enum { CACHE_LINE = 64 / sizeof(float) };
    const size_t at = (size_t)(s->y + 1) * (size_t)map->width + (size_t)(s->x0 + LANES);
    if (at + LANES > (size_t)map->width * (size_t)map->height)
        return;
    for (size_t k = 3 * at; k < 3 * (at + LANES); k += CACHE_LINE) {
        __builtin_prefetch(map->value + k);
        __builtin_prefetch(map->variance + k);
    }
}

// Lanes in use, and one more each way, as far as there are.
static void look_about(struct columns *around, const struct strip *s, const struct radiance *map)
{
    const int first = s->use.first, end = s->use.end + 2, left = s->x0 + first - 1;
    const int x0 = left > 0 ? left : 0, x1 = s->x0 + end - 1;
    const int count = 3 * ((x1 < map->width ? x1 : map->width) - x0);
    struct rows rows;
    struct three_rows three;
    for (int k = 0; k < 3; k++) {
        const int y = s->y + k - 1;
        const bool there = y >= 0 && y < map->height;
        const size_t at = 3 * ((size_t)(there ? y : s->y) * (size_t)map->width + (size_t)x0);
        three.value[k] = map->value + at;
        three.variance[k] = map->variance + at;
        three.most[k] = there ? FLT_MAX : -1;
    }
    ask_for_next(s, map);
    const int begin = 3 * (x0 - s->x0 + 1);
    for (int k = 3 * first; k < begin; k++)
        rows.value[k] = rows.variance[k] = rows.count[k] = 0;
    add_rows(&rows, &three, begin, count);
    for (int k = begin + count; k < 3 * end; k++)
        rows.value[k] = rows.variance[k] = rows.count[k] = 0;
    add_channels(around, &rows, first, end);
}

// Noise of each photosite's surroundings relative to their radiance, squared: what its own is
// expected to be. Weights are of it, so that they are no function of the photosite's own noise:
// inverse variances in units of the best that counts. No sample is trusted beyond 0.1 %; weights
// lie in (0, 1] and a bin's fixed-point sums cannot overflow.
WIDE static void weigh(struct strip *restrict s, const struct columns *restrict around)
{
    const float best = 1e-6F, worst = 1e4F;
    FOR_LANES (i, s->use) {
        float value = around->value[i] + around->value[i + 1] + around->value[i + 2];
        float variance = around->variance[i] + around->variance[i + 1] + around->variance[i + 2];
        float count = around->count[i] + around->count[i + 1] + around->count[i + 2];
        float noise = value > 0 ? variance * count / (value * value) : 1;
        float sum = s->bounced[0][i] + s->bounced[1][i] + s->bounced[2][i];
        float bounced = s->channel[i] < 0 ? sum / 3 : sum, doubt = s->doubt[i] * bounced;
        float total = noise + s->systematic[i] * s->systematic[i] + doubt * doubt;
        total = total < best ? best : total;
        s->weight[i] = best / (total < worst ? total : worst);
    }
}

// The board's light errs by as much at all photosites: a shared error of f.
WIDE static void share_bounced(struct strip *s, double bounce_sigma)
{
    const float some = (float)(bounce_sigma * bounce_sigma);
    FOR_LANES (i, s->use) {
        float sum = s->bounced[0][i] + s->bounced[1][i] + s->bounced[2][i];
        float bounced = s->channel[i] < 0 ? sum / 3 : sum, own = s->systematic[i];
        s->systematic[i] = sqrtf(own * own + some * bounced * bounced);
    }
}

// A glossy sample shows the board in its mirror direction, brighter than what the lamp makes of the
// place itself. What is left after such a subtraction is no measurement of f. Samples agree on that
// light as a whole, not on what a mirror shows: of caution, they take nothing.
static void find_bounced(struct strip *s, double caution)
{
    const float most = 0.3F,
                shared = (float)(caution * caution);  // 1 sigma of f by the subtraction alone
    FOR_LANES (i, s->use) {
        float sigma2 = shared + s->doubt[i] * s->doubt[i];
        float sum = s->bounced[0][i] + s->bounced[1][i] + s->bounced[2][i];
        float bounced = s->channel[i] < 0 ? sum / 3 : sum;
        if (s->fate[i] == FATE_USED && sigma2 * bounced * bounced > most * most)
            s->fate[i] = FATE_BOUNCED;
    }
}

static void weigh_strip(struct strip *s, const struct viewing *v, const struct radiance *map)
{
    struct columns around;
    look_about(&around, s, map);
    if (v->bounce)
        share_bounced(s, v->bounce_sigma);
    weigh(s, &around);
}

// Photosites too far from what the neighbours of their bins say.
static void find_strays(struct strip *s, const struct consensus *consensus)
{
    s->compared = consensus != NULL;
    for (int i = s->use.first; i < s->use.end && consensus; i++) {
        s->unlike[i] = (comparison){.residual = NAN};
        if (s->fate[i] == FATE_USED) {
            candidate m = {{s->theta_h[i], s->theta_d[i], s->phi_d[i]},
                           s->channel[i],
                           {s->f[0][i], s->f[1][i], s->f[2][i]},
                           {s->noise[0][i], s->noise[1][i], s->noise[2][i]},
                           {s->bounced[0][i], s->bounced[1][i], s->bounced[2][i]}};
            if (!rec_consensus_allows(consensus, s->bin[i], &m, &s->unlike[i]))
                s->fate[i] = FATE_STRAY;
        }
    }
}

void rec_strip_make(struct strip *s, const struct viewing *v, const struct radiance *map)
{
    rec_strip_footprints(s, v);
    rec_strip_block(s, v);
    if (!rec_strip_narrow(s))
        return;
    rec_strip_angles(s);
    rec_strip_errors(s, v);
    rec_strip_read(s, v, map);
    if (v->bounce)
        find_bounced(s, v->bounce_caution);
    weigh_strip(s, v, map);
    find_strays(s, v->consensus);
}

reflectance_sample rec_strip_sample(const struct strip *s, int i)
{
    reflectance_sample a = {
        .angles = {s->theta_h[i], s->theta_d[i], s->phi_d[i]},
        .channel = s->channel[i],
        .systematic = s->systematic[i],
        .tilt = s->tilt[i],
        .spread = {s->spread[0][i], s->spread[1][i]},
        .disc = s->disc[i],
        .weight = s->weight[i],
        .point = rec_lane(&s->point, i),
        .normal = rec_lane_wide(&s->normal, i),
        .wi = rec_lane_wide(&s->wi, i),
        .wo = rec_lane_wide(&s->wo, i),
        .residual = NAN,
    };
    if (s->compared) {
        a.residual = s->unlike[i].residual;
        a.others = s->unlike[i].others;
        a.excess = s->unlike[i].excess;
    }
    for (int c = 0; c < 3; c++) {
        bool measured = a.channel < 0 || a.channel == c;
        a.f[c] = measured ? s->f[c][i] : 0;
        a.noise[c] = measured ? s->noise[c][i] : 0;
        a.bounced[c] = s->bounced[c][i];
    }
    return a;
}
