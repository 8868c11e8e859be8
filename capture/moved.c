/* moved.c -- frames of a bracket that moved against each other.
 *
 * Method.   Neighbouring frames a and b, brought to the same exposure, differ by
 *
 *               b - a = k + s m + q m^2 + u dm/dx + v dm/dy,     m = (a + b) / 2,
 *
 *           where the second moved by (-u, -v) pixels and the light changed by s (Lucas and Kanade
 *           1981); k and q are what levels and a response that are a little wrong do, which in a
 *           smooth image would pass for a step: least squares over the sampled photosites that are
 * well exposed in both, gradients by central differences. Frames without a step between them,
 * neighbours or next but one, stand together; the largest such group of a shot is where it stands.
 * Accuracy. Hundredths of a pixel for small steps. Steps beyond the width of the image's edges come
 *           out too short, but not as none, and to find them is all that is asked.
 */
#include "moved.h"
#include "solve.h"

#include <stdlib.h>
#include <string.h>

// Pixels: a third of the footprint of a tag's edge. Smaller steps cost less than the edge's own
// blur.
static const double step_limit = 0.3;

struct step {
    double x, y, sigma;
};

/* Photosites of one channel on a square grid, `pitch` pixels apart: in a mosaic those of its cell
 * that repeat in the shortest steps, every 2 of Bayer's, every 3 of X-Trans's green ones. */
struct grid {
    int channel, pitch, width, rows;
    size_t *site;     // [rows][width] of a band, among the channel's photosites there
    size_t per_band;  // photosites of the channel in a band
};

/* Are all photosites that lie whole steps of pitch from (x, y) of its channel? */
static bool repeats(const char *cfa, int x, int y, int pitch)
{
    int side = cap_cfa_side(cfa), c = cap_cfa_channel(cfa, x, y);
    for (int v = y; v < y + side * pitch; v += pitch)
        for (int u = x; u < x + side * pitch; u += pitch)
            if (cap_cfa_channel(cfa, u, v) != c)
                return false;
    return true;
}

/* The first place (*x, *y) from which a channel repeats in steps of pitch. */
static bool find_place(int *x, int *y, const char *cfa, int channel, int pitch)
{
    for (*y = 0; *y < pitch; ++*y)
        for (*x = 0; *x < pitch; ++*x)
            if ((channel < 0 || cap_cfa_channel(cfa, *x, *y) == channel)
                && repeats(cfa, *x, *y, pitch))
                return true;
    return false;
}

/* false: out of memory. */
static bool fill_grid(struct grid *grid, const struct sample_set *set, int left, int top)
{
    const int p = grid->pitch;
    grid->width = (set->width - left + p - 1) / p;
    grid->rows = (set->rows - top + p - 1) / p;
    grid->site = calloc((size_t)grid->width * (size_t)grid->rows + 1, sizeof *grid->site);
    size_t *next = grid->site;
    for (int y = 0; grid->site && y < set->rows; y++)
        for (int x = 0; x < set->width; x++) {
            if (*set->cfa && cap_cfa_channel(set->cfa, x, y) != grid->channel)
                continue;
            if (x % p == left && y % p == top)
                *next++ = grid->per_band;
            grid->per_band++;
        }
    return grid->site != NULL;
}

/* Red and blue where they are as dense as any; else whatever is densest. */
static int make_grids(struct grid grid[2], const struct sample_set *set)
{
    int pitch = 1, x = 0, y = 0, grids = 0;
    while (*set->cfa && !find_place(&x, &y, set->cfa, -1, pitch))
        pitch++;
    int densest = *set->cfa ? cap_cfa_channel(set->cfa, x, y) : 0;
    for (int c = 0; c < 3; c += 2) {
        grid[grids] = (struct grid){.channel = c, .pitch = pitch};
        if (*set->cfa && !find_place(&x, &y, set->cfa, c, pitch))
            continue;
        grids += fill_grid(&grid[grids], set, x, y);
    }
    if (grids == 0 && *set->cfa && find_place(&x, &y, set->cfa, densest, pitch)) {
        grid[0] = (struct grid){.channel = densest, .pitch = pitch};
        grids = fill_grid(&grid[0], set, x, y);
    }
    return grids;
}

/* Normal equations for (u, v, k, s, q); m in parts of the range. */
enum { UNKNOWNS = 5 };
struct equations {
    double a[UNKNOWNS][UNKNOWNS], b[UNKNOWNS], rest2, count;
};

static void add_site(struct equations *e, const double m[5], double d, double range)
{
    double part = m[0] / range;
    double term[UNKNOWNS] = {0.5 * (m[2] - m[1]), 0.5 * (m[4] - m[3]), 1, part, part * part};
    double w = 1 / m[0];  // photon noise
    for (int i = 0; i < UNKNOWNS; i++) {
        e->b[i] += w * term[i] * d;
        for (int j = 0; j <= i; j++)
            e->a[i][j] += w * term[i] * term[j];
    }
    e->rest2 += w * d * d;
    e->count++;
}

static void add_grid(struct equations *e, const struct bracket_sample *s, const struct grid *grid,
                     int from, int to, double black, double range)
{
    const double scale = s->time[to] / s->time[from];
    const size_t width = (size_t)grid->width, bands = s->photosites / grid->per_band;
    for (size_t k = 0; k < bands * (size_t)grid->rows; k++) {
        const size_t row = k % (size_t)grid->rows, first = k / (size_t)grid->rows * grid->per_band;
        const float *da = s->dn[from] + first, *db = s->dn[to] + first;
        if (row == 0 || row + 1 == (size_t)grid->rows)
            continue;
        for (size_t x = 1; x + 1 < width; x++) {
            const size_t *at = grid->site + row * width + x;
            const size_t near[5] = {*at, at[-1], at[1], *(at - width), at[width]};
            double m[5];
            bool good = true;
            for (int i = 0; i < 5; i++) {
                double a = (double)da[near[i]] - black, b = (double)db[near[i]] - black;
                good = good && b < 0.9 * range && b > 0.02 * range;
                m[i] = 0.5 * (scale * a + b);
            }
            if (good)
                add_site(e, m, (double)db[*at] - black - scale * ((double)da[*at] - black), range);
        }
    }
}

/* Where steps are looked for. */
struct look {
    const struct sample_set *set;
    const struct sensor *sensor;
    struct grid grid[2];
    int grids;
};

/* false: nothing tells. */
static bool measure_step(struct step *step, const struct look *look, int sample, int from, int to)
{
    enum { COUNT_MIN = 1000 };
    struct equations e = {0};
    for (int k = 0; k < look->grids; k++) {
        const struct sensor *sensor = look->sensor;
        const int c = look->grid[k].channel;
        double range = fmin(sensor->usable[c], sensor->white[c]) - sensor->black[c];
        add_grid(&e, &look->set->channel[c][sample], &look->grid[k], from, to, sensor->black[c],
                 range);
    }
    double a[UNKNOWNS * UNKNOWNS], x[UNKNOWNS], energy = fmin(e.a[0][0], e.a[1][1]);
    memcpy(a, e.a, sizeof a);
    memcpy(x, e.b, sizeof x);
    if (e.count < COUNT_MIN || !(energy > 0) || !solve_spd(a, x, UNKNOWNS))
        return false;
    double explained = 0;
    for (int i = 0; i < UNKNOWNS; i++)
        explained += x[i] * e.b[i];
    double variance = fmax(e.rest2 - explained, 0) / e.count;
    const int pitch = look->grid[0].pitch;
    *step = (struct step){-x[0] * pitch, -x[1] * pitch, sqrt(variance / energy) * pitch};
    return true;
}

/* Which frames stand together, and how far a frame is from the one before it. */
struct groups {
    int group[64];
    double step[64];
};

static void join(struct groups *g, int frames, int i, int j)
{
    int from = g->group[j], to = g->group[i];
    for (int f = 0; f < frames; f++)
        if (g->group[f] == from)
            g->group[f] = to;
}

static struct groups find_groups(const struct look *look, int sample, int frames)
{
    struct groups g = {{0}, {0}};
    for (int f = 0; f < frames; f++)
        g.group[f] = f;
    for (int f = 1; f < frames; f++) {
        struct step step = {0};
        // Frames that cannot be compared stand together: nothing speaks against it.
        bool told = measure_step(&step, look, sample, f - 1, f);
        g.step[f] = hypot(step.x, step.y);
        if (!told || g.step[f] < step_limit + 6 * step.sigma)
            join(&g, frames, f - 1, f);
    }
    for (int f = 2; f < frames; f++) {
        struct step step;
        if (g.group[f] != g.group[f - 2] && measure_step(&step, look, sample, f - 2, f)
            && hypot(step.x, step.y) < step_limit + 6 * step.sigma)
            join(&g, frames, f - 2, f);
    }
    return g;
}

static int size_of(const struct groups *g, int frames, int group)
{
    int size = 0;
    for (int f = 0; f < frames; f++)
        size += g->group[f] == group;
    return size;
}

void moved_find(bool *left_out, const struct capture *capture, const struct sample_set *set,
                const struct sensor *sensor, struct run *run)
{
    struct look look = {.set = set, .sensor = sensor};
    look.grids = make_grids(look.grid, set);
    for (int k = 0; k < set->samples; k++) {
        const struct bracket_sample *s = &set->channel[0][k];
        int frames = s->frames < 64 ? s->frames : 64, home = 0;
        struct groups g = find_groups(&look, k, frames);
        for (int f = 1; f < frames; f++)  // of equals the longer exposures, which say more
            if (size_of(&g, frames, g.group[f]) >= size_of(&g, frames, g.group[home]))
                home = f;
        for (int f = 0; f < frames; f++) {
            if (g.group[f] == g.group[home])
                continue;
            double step = f > 0 && g.step[f] > 0 ? g.step[f] : g.step[f + 1 < frames ? f + 1 : f];
            left_out[s->photo[f]] = true;
            cap_warn(run,
                     "%s: moved by about %.1f pixels against the rest of shot %s: this photograph "
                     "is left out",
                     capture->photo[s->photo[f]].name, step, capture->shot[s->shot].name);
        }
    }
    for (int k = 0; k < look.grids; k++)
        free(look.grid[k].site);
}
