/* facet_sums.c -- the radiance of small pieces of surface.
 *
 * Method.   The mean over a facet's photosites. A plane through them takes the slope of its shading
 *           out of their scatter: that is no noise of the mean. On a curved sample the mean of a
 *           block is not the radiance in its middle: it is off by half of L'' times the variance of
 *           place (a block's side, and the lens's blur) along both axes. By how much a block that
 *           is ARM photosites longer at both ends is above it tells L''.
 * Accuracy. Of a ball 100 photosites wide, blocks of 4 are off by 0.1 % and more near the outline
 *           and the terminator with the bend left in, all to the same side: its centre by 10 um.
 */
#include "facet_sums.h"
#include "view_map.h"

static const double SNR_MIN = 20;  // below it, the mean of a logarithm is biased
enum { ARM = 2 };                  // photosites: as far as a block is known to lie on the sample

static void channel_add(struct channel_sums *s, double x, double y, double value, double variance)
{
    s->count++;
    s->value += value;
    s->square += value * value;
    s->variance += variance;
    s->place[0] += x;
    s->place[1] += y;
    s->spread[0] += x * x;
    s->spread[1] += x * y;
    s->spread[2] += y * y;
    s->slope[0] += x * value;
    s->slope[1] += y * value;
}

void facet_sums_add(struct facet_sums *s, const struct radiance *map, int x, int y, double a,
                    double b)
{
    float value[3], variance[3];
    bool measured[3];
    cap_radiance_at(map, x, y, value, variance);
    if (!cal_measured(map, variance, measured))
        return;
    double mean = ((double)value[0] + value[1] + value[2]) / 3;
    if (s->count == 0) {
        s->first[0] = x;
        s->first[1] = y;
    }
    for (int c = 0; c < 3; c++)
        if (measured[c])
            channel_add(&s->channel[c], x - s->first[0], y - s->first[1], value[c], variance[c]);
    s->pixel[0] += x;
    s->pixel[1] += y;
    s->place[0] += a;
    s->place[1] += b;
    s->spread[0] += a * a;
    s->spread[1] += a * b;
    s->spread[2] += b * b;
    s->low = s->count ? fmin(s->low, mean) : mean;
    s->high = s->count ? fmax(s->high, mean) : mean;
    s->count++;
}

/** What the plane through a channel's values leaves of their variance; *at: the plane's value at
 *  the photosite `middle`, counted as places are. Too few or too narrow for a plane: their mean. */
static double off_plane(const struct channel_sums *s, const double middle[2], double *at)
{
    const double n = s->count, mean = s->value / n, x = s->place[0] / n, y = s->place[1] / n;
    const double xx = s->spread[0] / n - x * x, xy = s->spread[1] / n - x * y;
    const double yy = s->spread[2] / n - y * y, vv = fmax(s->square / n - mean * mean, 0);
    const double xv = s->slope[0] / n - x * mean, yv = s->slope[1] / n - y * mean;
    const double det = xx * yy - xy * xy;
    *at = mean;
    if (s->count <= 3 || det < 1e-3)
        return vv;
    const double gx = (yy * xv - xy * yv) / det, gy = (xx * yv - xy * xv) / det;
    *at += gx * (middle[0] - x) + gy * (middle[1] - y);
    return fmax(vv - gx * xv - gy * yv, 0) * n / (n - 3);
}

bool facet_of_sums(const struct facet_sums *s, double spread_max, struct facet *facet)
{
    facet->bright = true;
    if (s->count < 1)
        return false;
    for (int a = 0; a < 2; a++)
        facet->pixel[a] = s->pixel[a] / s->count;
    const double middle[2] = {facet->pixel[0] - s->first[0], facet->pixel[1] - s->first[1]};
    for (int c = 0; c < 3; c++) {
        const struct channel_sums *of = &s->channel[c];
        if (of->count < 1)
            return false;
        double n = of->count, mean = of->value / n, noise = of->variance / n;
        double scatter = of->square / n - mean * mean;
        if (scatter > noise * 4 + spread_max * spread_max * mean * mean)
            return false;
        double left = off_plane(of, middle, &facet->mean[c]);
        facet->noise[c] = sqrt(fmax(noise, left) / n);
        facet->bright = facet->bright && facet->noise[c] * SNR_MIN < facet->mean[c];
    }
    for (int c = 0; c < 3 && facet->bright; c++) {
        facet->log_value[c] = facet->log_seen[c] = log(facet->mean[c]);
        facet->sigma[c] = facet->sigma_seen[c] = facet->noise[c] / facet->mean[c];
    }
    return true;
}

void facet_of_place(const struct facet_sums *s, vec3 origin, vec3 right, vec3 up,
                    struct facet *facet)
{
    const double n = s->count, a = s->place[0] / n, b = s->place[1] / n;
    const double aa = fmax(s->spread[0] / n - a * a, 1e-12), ab = s->spread[1] / n - a * b;
    const double bb = s->spread[2] / n - b * b, l = sqrt(aa);
    facet->point = vec3_add(origin, vec3_add(vec3_scale(right, a), vec3_scale(up, b)));
    facet->spread[0] = vec3_add(vec3_scale(right, l), vec3_scale(up, ab / l));
    facet->spread[1] = vec3_scale(up, sqrt(fmax(bb - ab * ab / aa, 0)));
}

/** The sums of `columns` x `rows` photosites from (x, y); false: some are not measured, or lie
 *  outside of the map. */
static bool block_sums(struct facet_sums *s, const struct radiance *map, int x, int y, int columns,
                       int rows)
{
    *s = (struct facet_sums){.count = 0};
    if (x < 0 || y < 0 || x + columns > map->width || y + rows > map->height)
        return false;
    for (int j = 0; j < rows; j++)
        for (int i = 0; i < columns; i++)
            facet_sums_add(s, map, x + i, y + j, 0, 0);
    return s->count == columns * rows && s->channel[0].count > 0 && s->channel[1].count > 0
           && s->channel[2].count > 0;
}

static double mean_of(const struct channel_sums *s)
{
    return s->value / s->count;
}

/** Variance of the places of a channel's photosites along x or y, px^2. */
static double width_of(const struct channel_sums *s, int axis)
{
    double mean = s->place[axis] / s->count;
    return s->spread[2 * axis] / s->count - mean * mean;
}

bool facet_bend(const struct radiance *map, int x, int y, int side, double blur_px, double bend[3])
{
    const int longer = side + 2 * ARM;
    struct facet_sums block, along[2];
    if ((*map->cfa && cap_cfa_side(map->cfa) > ARM) || !block_sums(&block, map, x, y, side, side)
        || !block_sums(&along[0], map, x - ARM, y, longer, side)
        || !block_sums(&along[1], map, x, y - ARM, side, longer))
        return false;
    for (int c = 0; c < 3; c++) {
        const struct channel_sums *in = &block.channel[c];
        bend[c] = 0;
        for (int a = 0; a < 2; a++) {  // a photosite's own width adds 1/12
            const struct channel_sums *out = &along[a].channel[c];
            double width = width_of(in, a), more = width_of(out, a) - width;
            bend[c] += (width + 1.0 / 12 + blur_px * blur_px) / more * (mean_of(out) - mean_of(in));
        }
    }
    return true;
}
