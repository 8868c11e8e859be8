/* raster_spread.c -- photosites on a mesh that have a part of what lies beyond an edge.
 *
 * Method.   An edge between two photosites (raster.c) touches what a third one has a part of where
 *           both lie within its reach: where one with such a neighbour lies within the reach less
 *           one. That is looked for along columns, then along rows. Photosites that have a part of
 *           no more than their neighbours need no such look.
 */
#include "raster.h"

#include <stdlib.h>
#include <string.h>

/** So many whole photosites before and after, less one, for each place among those that share. */
struct window {
    int before, after;
};

static int whole(double reach)
{
    int n = (int)ceil(reach - 0.5) - 1;
    return n > 0 ? n : 0;
}

static struct window window_at(const struct viewing *v, int axis, int at)
{
    struct reach r = rec_reach(v, at, at);
    return (struct window){whole(r.before[axis]), whole(r.after[axis])};
}

// The plane's largest within the window along a row (stride 1) or a column, into another.
static void spread(float *to, const float *from, const struct raster *r, const struct viewing *v,
                   int axis)
{
    const int count[2] = {r->columns, r->rows}, begin[2] = {r->x0, r->y0};
    const int stride[2] = {1, r->columns}, other = 1 - axis;
    for (int at = 0; at < count[axis]; at++) {
        struct window w = window_at(v, axis, begin[axis] + at);
        int first = at > w.before ? at - w.before : 0;
        int last = at + w.after < count[axis] ? at + w.after : count[axis] - 1;
        for (int line = 0; line < count[other]; line++) {
            float most = 0;
            for (int k = first; k <= last; k++)
                most = fmaxf(most, from[line * stride[other] + k * stride[axis]]);
            to[line * stride[other] + at * stride[axis]] = most;
        }
    }
}

// What the eight around tell of each photosite.
static void take_neighbours(struct raster *r, float *rim, float *dusk, const struct viewing *v,
                            pixel_box box)
{
    const lane_span all = {0, LANES};
    struct patches p;
    for (int y = box.y0; y < box.y1; y++)
        for (int x0 = r->x0 + 1; x0 + LANES < r->x0 + r->columns; x0 += LANES) {
            const size_t at = (size_t)(y - r->y0) * (size_t)r->columns + (size_t)(x0 - r->x0);
            rec_raster_patches(&p, r, v, x0, y, all);
            for (int i = 0; i < LANES; i++) {
                rim[at + (size_t)i] = (float)p.rim[i];
                dusk[at + (size_t)i] = (float)p.dusk[i];
            }
        }
}

enum status rec_raster_spread(struct raster *r, const struct viewing *v, pixel_box box,
                              struct error *err)
{
    const size_t cells = (size_t)r->columns * (size_t)r->rows;
    if (whole(rec_farthest(v)) == 0)
        return STATUS_OK;
    float *work = calloc(2 * cells, sizeof *work);
    if (!work)
        return cap_fail(err, STATUS_MEMORY, "no memory for %d x %d rays", r->columns, r->rows);
    float *rim = work, *dusk = work + cells;
    take_neighbours(r, rim, dusk, v, box);
    spread(r->plane[RASTER_RIM], rim, r, v, 1);
    spread(rim, r->plane[RASTER_RIM], r, v, 0);
    memcpy(r->plane[RASTER_RIM], rim, cells * sizeof *rim);
    spread(r->plane[RASTER_DUSK], dusk, r, v, 1);
    spread(dusk, r->plane[RASTER_DUSK], r, v, 0);
    memcpy(r->plane[RASTER_DUSK], dusk, cells * sizeof *dusk);
    free(work);
    return STATUS_OK;
}
