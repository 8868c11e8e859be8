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

/** Sums over columns of three photosites in all channels: [1 + i] is lane i's. Photosites that were
 *  saturated in all frames, and the other channels of a mosaic, have nothing to tell. */
struct columns {
    float value[LANES + 2], variance[LANES + 2], count[LANES + 2];
};

static inline void add_pixel(struct columns *to, const float *value, const float *variance, int i)
{
    for (int c = 0; c < 3; c++) {
        float x = value[3 * i + c], v = variance[3 * i + c];
        bool tells = (x <= FLT_MAX) & (x >= -FLT_MAX) & (v <= FLT_MAX);
        to->value[1 + i] += tells ? x : 0;
        to->variance[1 + i] += tells ? v : 0;
        to->count[1 + i] += tells ? 1 : 0;
    }
}

WIDE static void add_pixels(struct columns *restrict to, const float *restrict value,
                            const float *restrict variance, lane_span span)
{
    FOR_LANES (i, span)
        add_pixel(to, value, variance, i);
}

// A row of the map: lanes in use, and one more each way.
static void add_row(struct columns *to, const struct strip *s, const struct radiance *map, int y)
{
    const size_t at = 3 * ((size_t)y * (size_t)map->width + (size_t)s->x0);
    const float *value = map->value + at, *variance = map->variance + at;
    const lane_span whole = rec_strip_whole(s, map);
    const int left = map->width - s->x0, end = s->use.end + 1 < left ? s->use.end + 1 : left;
    if (s->x0 + s->use.first > 0)
        add_pixel(to, value, variance, s->use.first - 1);
    add_pixels(to, value, variance, whole);
    for (int i = whole.end; i < end; i++)
        add_pixel(to, value, variance, i);
}

// Noise of each photosite's surroundings relative to their radiance, squared: what its own is
// expected to be. Weights are of it, so that they are no function of the photosite's own noise:
// inverse variances in units of the best that counts. No sample is trusted beyond 0.1 %; weights
// lie in (0, 1] and a bin's fixed-point sums cannot overflow.
WIDE static void weigh(struct strip *s, const struct columns *around)
{
    const double best = 1e-6, worst = 1e4;
    FOR_LANES (i, s->use) {
        double value = (double)(around->value[i] + around->value[i + 1] + around->value[i + 2]);
        double variance =
            (double)(around->variance[i] + around->variance[i + 1] + around->variance[i + 2]);
        double count = (double)(around->count[i] + around->count[i + 1] + around->count[i + 2]);
        double noise = value > 0 ? variance * count / (value * value) : 1;
        double sum = s->bounced[0][i] + s->bounced[1][i] + s->bounced[2][i];
        double bounced = s->channel[i] < 0 ? sum / 3 : sum, doubt = s->doubt[i] * bounced;
        double total = noise + s->systematic[i] * s->systematic[i] + doubt * doubt;
        total = total < best ? best : total;
        s->weight[i] = best / (total < worst ? total : worst);
    }
}

// The board's light errs by as much at all photosites: a shared error of f.
WIDE static void share_bounced(struct strip *s, double bounce_sigma)
{
    const double some = bounce_sigma * bounce_sigma;
    FOR_LANES (i, s->use) {
        double sum = s->bounced[0][i] + s->bounced[1][i] + s->bounced[2][i];
        double bounced = s->channel[i] < 0 ? sum / 3 : sum, own = s->systematic[i];
        s->systematic[i] = sqrt(own * own + some * bounced * bounced);
    }
}

// A glossy sample shows the board in its mirror direction, brighter than what the lamp makes of the
// place itself. What is left after such a subtraction is no measurement of f. Samples agree on that
// light as a whole, not on what a mirror shows: of caution, they take nothing.
static void find_bounced(struct strip *s, double caution)
{
    const double most = 0.3;  // 1 sigma of f by the subtraction alone
    FOR_LANES (i, s->use) {
        double sigma2 = caution * caution + s->doubt[i] * s->doubt[i];
        double sum = s->bounced[0][i] + s->bounced[1][i] + s->bounced[2][i];
        double bounced = s->channel[i] < 0 ? sum / 3 : sum;
        if (s->fate[i] == FATE_USED && sigma2 * bounced * bounced > most * most)
            s->fate[i] = FATE_BOUNCED;
    }
}

static void weigh_strip(struct strip *s, const struct viewing *v, const struct radiance *map)
{
    struct columns around = {0};
    for (int y = s->y > 0 ? s->y - 1 : 0; y <= s->y + 1 && y < map->height; y++)
        add_row(&around, s, map, y);
    if (v->bounce)
        share_bounced(s, v->bounce_sigma);
    weigh(s, &around);
}

// Photosites too far from what the neighbours of their bins say.
static void find_strays(struct strip *s, const struct consensus *consensus)
{
    FOR_LANES (i, s->use) {
        s->unlike[i] = (comparison){.residual = NAN};
        if (s->fate[i] == FATE_USED && consensus) {
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
        .normal = rec_lane(&s->normal, i),
        .wi = rec_lane(&s->wi, i),
        .wo = rec_lane(&s->wo, i),
        .residual = s->unlike[i].residual,
        .others = s->unlike[i].others,
        .excess = s->unlike[i].excess,
    };
    for (int c = 0; c < 3; c++) {
        bool measured = a.channel < 0 || a.channel == c;
        a.f[c] = measured ? s->f[c][i] : 0;
        a.noise[c] = measured ? s->noise[c][i] : 0;
        a.bounced[c] = s->bounced[c][i];
    }
    return a;
}
