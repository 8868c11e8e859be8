/* strip_read.c -- what a strip's photosites measured: f and its noise, in each channel. */
#include "bounce_map.h"
#include "strip.h"

#include <float.h>
#include <string.h>

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

// Beyond the image's end its last pixel is repeated.
static void read_pixels(struct reading *to, const struct strip *s, const struct radiance *map)
{
    const size_t at = 3 * ((size_t)s->y * (size_t)map->width + (size_t)s->x0);
    const lane_span whole = rec_strip_whole(s, map);
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
WIDE static void take_channel(struct strip *restrict s, struct failures *restrict failed,
                              const struct reading *restrict r, const float *restrict vignetting,
                              const float *restrict gain, int c, float per_light)
{
    const float limit = 1e5F;  // 1/sr: a mirror whose lobe is 0.1 degrees wide; see bins.c
    FOR_LANES (i, s->use) {
        float value = r->value[c][i], variance = r->variance[c][i];
        float extra = vignetting[i] * s->bounced[c][i];
        float scale = gain[i] * per_light, f = (value - extra) * scale;
        float doubt = s->doubt[i] * extra, noise = (variance + doubt * doubt) * scale * scale;
        float size = f < 0 ? -f : f;
        bool mine = r->mine[c][i] > 0;
        bool good = (size < limit) & (noise >= 0) & (noise < limit * limit);
        failed->saturated[i] = (mine & (variance > FLT_MAX)) ? 1 : failed->saturated[i];
        failed->unusable[i] = (mine & !good) ? 1 : failed->unusable[i];
        failed->unlent[i] = (mine | good) ? failed->unlent[i] : 1;
        s->f[c][i] = f;
        s->noise[c][i] = noise;
    }
}

// Takes bounced radiance, and leaves the part of the lamp's light that it was.
WIDE static void take_part(struct strip *restrict s, const struct reading *restrict r,
                           const float *restrict vignetting, int c)
{
    const float most = 49;  // 98 % of the light
    FOR_LANES (i, s->use) {
        float extra = vignetting[i] * s->bounced[c][i], rest = r->value[c][i] - extra;
        float least = extra / most, part = extra / (rest > least ? rest : least);
        s->bounced[c][i] = ((r->mine[c][i] > 0) & (extra > 0)) ? part : 0;
    }
}

// What the lens leaves of the light (cal_vignetting, side by side), and 1 / (that, irradiance).
WIDE static void find_vignetting(float *restrict left, float *restrict gain, const struct strip *s,
                                 const struct camera *camera)
{
    const double w = camera->width, h = camera->height, y = s->y - camera->center[1];
    const float scale = (float)(4 / (w * w + h * h)), dy = (float)y;
    const float x0 = (float)(s->x0 - camera->center[0]);
    const float a = (float)camera->vignetting[0], b = (float)camera->vignetting[1];
    FOR_LANES (i, s->use) {
        float dx = x0 + (float)i, q = scale * (dx * dx + dy * dy), v = 1 + q * (a + q * b);
        v = v > 1e-3F ? v : 1e-3F;
        v = v < 1 ? v : 1;
        left[i] = v;
        gain[i] = 1 / (v * s->irradiance[i]);
    }
}

static void find_channels(struct strip *s, const struct radiance *map)
{
    FOR_LANES (i, s->use) {
        s->channel[i] = -1;
        s->lends[i] = 0;
    }
    for (int i = s->use.first; i < s->use.end && *map->cfa; i++)
        s->channel[i] = cap_radiance_channel(map, s->x0 + i, s->y);
}

// The light that the board brings: radiance, and how sure it is.
static void find_bounced_light(struct strip *s, const struct viewing *v)
{
    FOR_LANES (i, s->use)
        s->bounced[0][i] = s->bounced[1][i] = s->bounced[2][i] = s->doubt[i] = 0;
    for (int i = s->use.first; i < s->use.end && v->bounce; i++) {
        if (s->fate[i] != FATE_USED)
            continue;
        const sight at = {rec_lane(&s->point, i), rec_lane_wide(&s->normal, i),
                          rec_lane_wide(&s->wo, i)};
        struct bounced_light light = rec_bounce_seen(v->bounce, &at, s->x0 + i, s->y);
        s->doubt[i] = (float)hypot(v->bounce_scatter, light.doubt);
        for (int c = 0; c < 3; c++)
            s->bounced[c][i] = (float)light.radiance[c];
    }
}

// Which photosites of a mosaic lend the channels that they did not measure.
static void lend(struct strip *s, const struct failures *failed)
{
    FOR_LANES (i, s->use) {
        s->lends[i] = s->channel[i] >= 0 && s->inner[i] > 0 && !(failed->unlent[i] > 0);
        for (int c = 0; c < 3 && s->channel[i] >= 0; c++)
            if (c != s->channel[i] && !s->lends[i])
                s->f[c][i] = s->noise[c][i] = 0;
    }
}

WIDE static void take_failures(struct strip *restrict s, const struct failures *restrict failed)
{
    FOR_LANES (i, s->use) {
        enum fate fate = failed->unusable[i] > 0 ? FATE_UNUSABLE : FATE_USED;
        fate = failed->saturated[i] > 0 ? FATE_SATURATED : fate;
        s->fate[i] = s->fate[i] == FATE_USED ? fate : s->fate[i];
    }
}

void rec_strip_read(struct strip *s, const struct viewing *v, const struct radiance *map)
{
    struct failures failed;
    struct reading reading;
    float vignetting[LANES], gain[LANES];
    FOR_LANES (i, s->use)
        failed.saturated[i] = failed.unusable[i] = failed.unlent[i] = 0;
    find_vignetting(vignetting, gain, s, v->camera);
    find_channels(s, map);
    find_bounced_light(s, v);
    read_pixels(&reading, s, map);
    if (*map->cfa)
        read_mosaic(&reading, s, map);
    for (int c = 0; c < 3; c++) {
        take_channel(s, &failed, &reading, vignetting, gain, c, (float)(1 / v->light[c]));
        if (v->bounce)
            take_part(s, &reading, vignetting, c);
    }
    if (*map->cfa)
        lend(s, &failed);
    take_failures(s, &failed);
}
