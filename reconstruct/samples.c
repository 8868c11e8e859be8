/* samples.c -- photosites become reflectance samples.
 *
 * Method.   f = L / (V light cos(theta_i)/r^2), with the directions and the irradiance of the
 *           footprint (footprint.c) and L the radiance of the map.
 *           What the lit board adds to L is taken out first (bounce_map.c).
 * Errors.   Noise is the map's. What a wrong sphere, pose or lamp does (sample_errors.c) neighbours
 *           share: it is kept apart from noise and never averages out (bins.c).
 */
#include "bounce_map.h"
#include "strip.h"

#include <float.h>
#include <string.h>

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

/** What the photosites of a strip read. */
struct reading {
    float value[3][LANES], variance[3][LANES];
    float mine[3][LANES];  // 1: measured by this photosite; 0: another channel of a mosaic's
};

/** Lanes that are no measurement, by cause; 1 or 0. */
struct failures {
    float saturated[LANES], unusable[LANES];
    float unlent[LANES];  // another channel of a mosaic is not known here
};

// The variance of a mosaic's channel c between photosites: capture/ interpolated the value as the
// mean of those next to it. INFINITY: not all of them tell.
static float variance_between(const struct radiance *map, int x, int y, int c)
{
    float sum = 0, count = 0;
    for (int j = y > 0 ? y - 1 : 0; j <= y + 1 && j < map->height; j++)
        for (int i = x > 0 ? x - 1 : 0; i <= x + 1 && i < map->width; i++)
            if (cap_radiance_channel(map, i, j) == c) {
                sum += map->variance[3 * ((size_t)j * (size_t)map->width + (size_t)i) + (size_t)c];
                count++;
            }
    return count > 0 ? sum / (count * count) : INFINITY;
}

// Whole blocks, of pixels that lie side by side from value and variance on.
WIDE static void part_channels(struct reading *to, const float *restrict value,
                               const float *restrict variance, lane_span span)
{
    FOR_LANES (i, span)
        for (int c = 0; c < 3; c++) {
            to->value[c][i] = value[3 * i + c];
            to->variance[c][i] = variance[3 * i + c];
            to->mine[c][i] = 1;
        }
}

// Blocks in use that lie in the image as a whole.
static lane_span whole_blocks(const struct strip *s, const struct radiance *map)
{
    const int left = map->width - s->x0, whole = left < LANES ? left & -BLOCK : LANES;
    const int end = s->use.end < whole ? s->use.end : whole;
    return (lane_span){s->use.first, end > s->use.first ? end : s->use.first};
}

// Beyond the image's end its last pixel is repeated.
static void read_pixels(struct reading *to, const struct strip *s, const struct radiance *map)
{
    const size_t at = 3 * ((size_t)s->y * (size_t)map->width + (size_t)s->x0);
    const lane_span whole = whole_blocks(s, map);
    const int left = map->width - s->x0;
    part_channels(to, map->value + at, map->variance + at, whole);
    for (int i = whole.end; i < s->use.end; i++)
        for (int c = 0; c < 3; c++) {
            size_t k = at + 3 * (size_t)(i < left ? i : left - 1) + (size_t)c;
            to->value[c][i] = map->value[k];
            to->variance[c][i] = map->variance[k];
            to->mine[c][i] = 1;
        }
}

static void read_mosaic(struct reading *to, const struct strip *s, const struct radiance *map)
{
    for (int i = s->use.first; i < s->use.end && s->x0 + i < map->width; i++)
        for (int c = 0; c < 3; c++) {
            to->mine[c][i] = s->channel[i] == c;
            if (s->channel[i] != c && s->fate[i] == FATE_USED)
                to->variance[c][i] = variance_between(map, s->x0 + i, s->y, c);
        }
}

// f of one channel and its noise. gain: 1 / (vignetting irradiance).
WIDE static void take_channel(struct strip *s, struct failures *failed, const struct reading *r,
                              const double *vignetting, const double *gain, int c, double per_light)
{
    const double limit = 1e5;  // 1/sr: a mirror whose lobe is 0.1 degrees wide; see bins.c
    FOR_LANES (i, s->use) {
        double value = (double)r->value[c][i], variance = (double)r->variance[c][i];
        double extra = vignetting[i] * s->bounced[c][i];
        double scale = gain[i] * per_light, f = (value - extra) * scale;
        double doubt = s->doubt[i] * extra, noise = (variance + doubt * doubt) * scale * scale;
        double size = f < 0 ? -f : f;
        bool mine = r->mine[c][i] > 0;
        bool good = (size < limit) & (noise >= 0) & (noise < limit * limit);
        failed->saturated[i] = (mine & (variance > (double)FLT_MAX)) ? 1 : failed->saturated[i];
        failed->unusable[i] = (mine & !good) ? 1 : failed->unusable[i];
        failed->unlent[i] = (mine | good) ? failed->unlent[i] : 1;
        s->f[c][i] = f;
        s->noise[c][i] = noise;
    }
}

// Takes bounced radiance, and leaves the part of the lamp's light that it was.
WIDE static void take_part(struct strip *s, const struct reading *r, const double *vignetting,
                           int c)
{
    const double most = 49;  // 98 % of the light
    FOR_LANES (i, s->use) {
        double extra = vignetting[i] * s->bounced[c][i], rest = (double)r->value[c][i] - extra;
        double least = extra / most, part = extra / (rest > least ? rest : least);
        s->bounced[c][i] = ((r->mine[c][i] > 0) & (extra > 0)) ? part : 0;
    }
}

// What the lens leaves of the light (cal_vignetting, side by side), and 1 / (that, irradiance).
WIDE static void find_vignetting(double *restrict left, double *restrict gain,
                                 const struct strip *s, const struct camera *camera)
{
    const double w = camera->width, h = camera->height, scale = 4 / (w * w + h * h);
    const double dy = s->y - camera->center[1], x0 = s->x0 - camera->center[0];
    const double a = camera->vignetting[0], b = camera->vignetting[1];
    FOR_LANES (i, s->use) {
        double dx = x0 + i, q = scale * (dx * dx + dy * dy), v = 1 + q * (a + q * b);
        v = v > 1e-3 ? v : 1e-3;
        v = v < 1 ? v : 1;
        left[i] = v;
        gain[i] = 1 / (v * s->irradiance[i]);
    }
}

static void find_channels(struct strip *s, const struct radiance *map)
{
    FOR_LANES (i, s->use) {
        s->channel[i] = *map->cfa ? cap_radiance_channel(map, s->x0 + i, s->y) : -1;
        s->lends[i] = false;
    }
}

// The light that the board brings: radiance, and how sure it is.
static void find_bounced_light(struct strip *s, const struct viewing *v)
{
    memset(s->bounced, 0, sizeof s->bounced);
    memset(s->doubt, 0, sizeof s->doubt);
    for (int i = s->use.first; i < s->use.end && v->bounce; i++) {
        if (s->fate[i] != FATE_USED)
            continue;
        const sight at = {rec_lane(&s->point, i), rec_lane(&s->normal, i), rec_lane(&s->wo, i)};
        struct bounced_light light = rec_bounce_at(v->bounce, &at, s->x0 + i, s->y);
        s->doubt[i] = hypot(v->bounce_scatter, light.doubt);
        for (int c = 0; c < 3; c++)
            s->bounced[c][i] = light.radiance[c];
    }
}

// Which photosites of a mosaic lend the channels that they did not measure.
static void lend(struct strip *s, const struct failures *failed)
{
    FOR_LANES (i, s->use) {
        s->lends[i] = s->channel[i] >= 0 && s->inner[i] && !(failed->unlent[i] > 0);
        for (int c = 0; c < 3 && s->channel[i] >= 0; c++)
            if (c != s->channel[i] && !s->lends[i])
                s->f[c][i] = s->noise[c][i] = 0;
    }
}

static void read_strip(struct strip *s, const struct viewing *v, const struct radiance *map)
{
    struct failures failed = {0};
    struct reading reading;
    double vignetting[LANES], gain[LANES];
    find_vignetting(vignetting, gain, s, v->camera);
    find_channels(s, map);
    find_bounced_light(s, v);
    read_pixels(&reading, s, map);
    if (*map->cfa)
        read_mosaic(&reading, s, map);
    for (int c = 0; c < 3; c++) {
        take_channel(s, &failed, &reading, vignetting, gain, c, 1 / v->light[c]);
        if (v->bounce)
            take_part(s, &reading, vignetting, c);
    }
    if (*map->cfa)
        lend(s, &failed);
    FOR_LANES (i, s->use)
        if (s->fate[i] == FATE_USED)
            s->fate[i] = failed.saturated[i] > 0  ? FATE_SATURATED
                         : failed.unusable[i] > 0 ? FATE_UNUSABLE
                                                  : FATE_USED;
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
    const lane_span whole = whole_blocks(s, map);
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
    read_strip(s, v, map);
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
