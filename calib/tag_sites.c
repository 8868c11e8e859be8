/* tag_sites.c -- the photosites of a map that see a tag's pattern.
 *
 * Method.   The pixels about the tag that lie within its pattern and the ring around it, a margin
 *           from the rim; those that see no edge thinned to one in 16, those of very large tags to
 *           a lattice.
 */
#include "tag_sites.h"

#include <stdlib.h>

// Is a point of the square, in cells, within the pattern and its ring, `margin` from the rim?
static bool within(const struct tag_pattern *p, const double st[2], const double margin[2])
{
    for (int i = 0; i < 2; i++) {
        double u = st[i] * p->side;
        if (!(u > margin[i] - 1 && u < p->side + 1 - margin[i]))
            return false;
    }
    return true;
}

// Of the photosites that see no edge one in 16 is enough to know the levels.
static bool dull(const struct tag_image *image, const double q[2], int x, int y)
{
    double st[2];
    struct whiteness g;
    if (((x | y) & 3) == 0)
        return false;
    return !tag_image_whiteness(image, q, st, &g) || fabs(g.by_s) + fabs(g.by_t) < 1e-6;
}

static bool tag_box(const struct tag_image *image, const struct camera *camera,
                    const struct radiance *map, int low[2], int high[2])
{
    double ring = 1.0 / image->pattern->side, lo[2] = {INFINITY, INFINITY},
           hi[2] = {-INFINITY, -INFINITY};
    const int size[2] = {map->width, map->height};
    for (int k = 0; k < 4; k++) {
        double p[2], q[2], pixel[2], j[2][2];
        tag_image_distort(camera, image->corner[k], pixel, j);
        for (int i = 0; i < 2; i++) {
            if (!(pixel[i] >= 1 && pixel[i] <= size[i] - 2))
                return false;  // part of the black square is outside the image
            p[i] = tag_image_corner[k][i] * (1 + 2 * ring) - ring;
        }
        tag_image_apply(&image->q_from_square, p, q, j);
        tag_image_distort(camera, q, pixel, j);
        for (int i = 0; i < 2; i++) {
            lo[i] = fmin(lo[i], pixel[i]);
            hi[i] = fmax(hi[i], pixel[i]);
        }
    }
    for (int i = 0; i < 2; i++) {
        low[i] = (int)fmax(0, floor(lo[i]) - 1);
        high[i] = (int)fmin(size[i] - 1, ceil(hi[i]) + 1);
    }
    return true;
}

// So many photosites fix a tag to a part of what print and paper leave; more only cost time.
static const double sites_wanted = 16384;

// Of a large tag, the photosites of a lattice without straight rows: its edges, which often run
// along rows or columns, are then met at all phases.
static bool on_lattice(int x, int y, int every)
{
    int turn = (int)(0.618 * every);
    return (x + turn * y) % every == 0;
}

// A pixel without distortion, if it lies in the pattern at least margin_px from its rim.
static bool in_pattern(const struct tag_image *image, const struct camera *camera, int x, int y,
                       double margin_px, double q[2])
{
    double pixel[2] = {x, y}, st[2], by_q[2][2], margin[2];
    tag_image_undistort(camera, pixel, q);
    tag_image_apply(&image->square_from_q, q, st, by_q);
    for (int i = 0; i < 2; i++)
        margin[i] = margin_px * image->pattern->side
                    * sqrt(by_q[i][0] * by_q[i][0] + by_q[i][1] * by_q[i][1]);
    return within(image->pattern, st, margin);
}

// A mosaic's photosite is one of three channels, and paper and ink are gray: what the channels'
// means over the tag differ by is taken out. They sample the same pattern, some hundred times each.
struct channels {
    double scale[3];
};

static struct channels channels_of(const struct tag_image *image, const struct camera *camera,
                                   const struct radiance *map, const int low[2], const int high[2])
{
    struct channels all = {{1, 1, 1}};
    double sum[3] = {0}, count[3] = {0}, q[2];
    for (int y = low[1]; *map->cfa && y <= high[1]; y++)
        for (int x = low[0]; x <= high[0]; x++) {
            int c = cap_radiance_channel(map, x, y);
            float value[3], variance[3];
            if (!in_pattern(image, camera, x, y, 0, q))
                continue;
            cap_radiance_at(map, x, y, value, variance);
            if (!isfinite(variance[c]))
                continue;
            sum[c] += (double)value[c];
            count[c]++;
        }
    double whole = sum[0] + sum[1] + sum[2], sites = count[0] + count[1] + count[2];
    for (int c = 0; c < 3; c++)
        if (sum[c] > 0)
            all.scale[c] = whole / sites * count[c] / sum[c];
    return all;
}

// Value and variance of a photosite: the mean of its channels, or the one it measured, scaled.
static void measure(struct photosite *s, const struct radiance *map, int x, int y,
                    const struct channels *channels)
{
    float value[3], variance[3];
    int own = cap_radiance_channel(map, x, y);
    cap_radiance_at(map, x, y, value, variance);
    for (int c = 0; c < 3; c++) {
        double part = own < 0 ? 1.0 / 3 : c == own ? channels->scale[c] : 0;
        if (part > 0) {
            s->value += part * (double)value[c];
            s->variance += part * part * (double)variance[c];
        }
    }
}

bool tag_sites_gather(struct tag_sites *sites, const struct tag_image *image,
                      const struct camera *camera, const struct radiance *map, double margin_px)
{
    int low[2], high[2];
    if (!tag_box(image, camera, map, low, high))
        return false;
    size_t room = (size_t)(high[0] - low[0] + 1) * (size_t)(high[1] - low[1] + 1);
    struct photosite *site = realloc(sites->site, room * sizeof *site);
    if (!site)
        return false;
    sites->site = site;
    sites->count = 0;
    int every = (int)ceil((double)room / sites_wanted);
    const struct channels channels = channels_of(image, camera, map, low, high);
    for (int y = low[1]; y <= high[1]; y++)
        for (int x = low[0]; x <= high[0]; x++) {
            struct photosite s = {0};
            if (!on_lattice(x, y, every) || !in_pattern(image, camera, x, y, margin_px, s.q)
                || dull(image, s.q, x, y))
                continue;
            measure(&s, map, x, y, &channels);
            if (isfinite(s.value) && isfinite(s.variance) && s.variance >= 0)
                site[sites->count++] = s;
        }
    return true;
}

void tag_sites_free(struct tag_sites *sites)
{
    free(sites->site);
    *sites = (struct tag_sites){0};
}
