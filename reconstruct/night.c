/* night.c -- light on the side of the sample that the lamp does not reach.
 *
 * Method.   Some 128 x 128 photosites over the sample, where neither outline nor terminator is
 *           near and nothing stands in the way, less the predicted light of the board; green, which
 *           every camera has most of. A shot tells the mean of each zone's middle half, so that
 *           the post and its like do not: room light and glare are as strong everywhere, what
 * shines through the sample fades away from the lit side.
 */
#include "night.h"

#include "bounce_map.h"

#include <float.h>
#include <stdlib.h>

enum { GRID = 128, ROOM = (GRID + 1) * (GRID + 1), WELL = 30, SHOTS_MIN = 3, GREEN = 1 };
static const double unit = 0x1p30;

// The zone of a place by the cosine of the lamp's angle to its normal; NIGHT_ZONES: none.
static enum night_zone zone_of(double cos_i)
{
    double below = asin(fmin(1, -cos_i)) * 180 / CAP_PI;
    return below >= 40 ? ZONE_NIGHT : below >= 5 && below < 20 ? ZONE_DUSK : NIGHT_ZONES;
}

static enum status begin(struct shot_night *shot, struct error *err)
{
    for (int z = 0; z < NIGHT_ZONES; z++) {
        if (!shot->dark[z])
            shot->dark[z] = malloc(2 * ROOM * sizeof *shot->dark[z]);
        if (!shot->dark[z])
            return cap_fail(err, STATUS_MEMORY, "no memory for the dark side");
        shot->bounced[z] = shot->dark[z] + ROOM;
    }
    return STATUS_OK;
}

static void add_place(struct shot_night *shot, const struct strip *s, int i,
                      const struct viewing *v, const struct radiance *map)
{
    size_t at = 3 * ((size_t)s->y * (size_t)map->width + (size_t)(s->x0 + i)) + GREEN;
    double value = (double)map->value[at], distance = s->distance[i];
    const sight a = {rec_lane(&s->point, i), rec_lane_wide(&s->normal, i),
                     rec_lane_wide(&s->wo, i)};
    enum night_zone zone = zone_of(vec3_dot(a.normal, rec_lane_wide(&s->wi, i)));
    bool tells = fabs(value) <= (double)FLT_MAX && (double)map->variance[at] <= (double)FLT_MAX;
    if (zone == NIGHT_ZONES || !tells || shot->count[zone] >= ROOM || rec_occluded(v, a.point))
        return;
    double full = v->light[GREEN] / (v->lamp->at_infinity ? 1 : distance * distance) / CAP_PI;
    double bounced = v->bounce ? rec_bounce_at(v->bounce, &a, s->x0 + i, s->y).radiance[GREEN] : 0;
    const double pixel[2] = {s->x0 + i, s->y};
    double left = cal_vignetting(v->camera, pixel);
    int k = shot->count[zone]++;
    shot->dark[zone][k] = (value / left - bounced) / full;
    shot->bounced[zone][k] = bounced / full;
}

enum status rec_night_add(struct shot_night *shot, const struct strip *s, const struct viewing *v,
                          const struct radiance *map, pixel_box box, struct error *err)
{
    const int wide = box.x1 - box.x0, high = box.y1 - box.y0;
    const int step = (wide > high ? wide : high) / GRID + 1;
    // Of a mosaic's two rows one has green where the other has not.
    const int phase = *map->cfa ? s->y / step % 2 : 0;
    if ((s->y - box.y0) % step > 0)
        return STATUS_OK;
    for (int i = s->from; i < s->to; i++) {
        bool ours = (s->x0 + i - box.x0 + phase) % step == 0 && s->hit[i] > 0 && s->inner[i] > 0
                    && s->fate[i] == FATE_DARK;
        bool green = !*map->cfa || cap_radiance_channel(map, s->x0 + i, s->y) == GREEN;
        if (!ours || !green)
            continue;
        enum status status = begin(shot, err);
        if (status)
            return status;
        add_place(shot, s, i, v, map);
    }
    return STATUS_OK;
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// The mean of the middle half: as deaf to strays as the median, but not to what lies between the
// sensor's levels.
static double midmean(double *value, int count)
{
    double sum = 0;
    qsort(value, (size_t)count, sizeof *value, by_size);
    for (int i = count / 4; i < count - count / 4; i++)
        sum += value[i];
    return sum / (count - 2 * (count / 4));
}

static void enter(struct cell *cell, double *value, int count)
{
    double mean = fmax(-10, fmin(10, midmean(value, count)));
    cell->shots++;
    cell->sum += llround(mean * unit);
    cell->squares += llround(mean * mean * unit);
}

void rec_night_end_shot(struct night *to, struct shot_night *shot)
{
    for (int z = 0; z < NIGHT_ZONES; z++) {
        if (shot->count[z] >= WELL) {
            enter(&to->dark[z], shot->dark[z], shot->count[z]);
            enter(&to->bounced[z], shot->bounced[z], shot->count[z]);
        }
        free(shot->dark[z]);
    }
    *shot = (struct shot_night){0};
}

void rec_night_merge(struct night *to, const struct night *from)
{
    rec_cells_merge(to->dark, from->dark, NIGHT_ZONES);
    rec_cells_merge(to->bounced, from->bounced, NIGHT_ZONES);
}

darkness rec_darkness(const struct night *night, enum night_zone zone, double bounce_sigma)
{
    const struct cell *cell = &night->dark[zone];
    double n = (double)cell->shots;
    if (n < SHOTS_MIN)
        return (darkness){0, NAN, (int)n};
    double mean = (double)cell->sum / unit / n;
    double scatter2 = fmax(0, (double)cell->squares / unit / n - mean * mean) / (n - 1);
    double bounced = bounce_sigma * (double)night->bounced[zone].sum / unit / n;
    return (darkness){mean, sqrt(scatter2 + bounced * bounced), (int)n};
}
