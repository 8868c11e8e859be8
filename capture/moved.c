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

/* Normal equations for (u, v, k, s, q); m in parts of the range. */
enum { UNKNOWNS = 5 };
struct equations {
    double a[UNKNOWNS][UNKNOWNS], b[UNKNOWNS], rest2, count;
};

static void add_channel(struct equations *e, const struct bracket_sample *s, int from, int to,
                        double black, double range, int width, int rows)
{
    double scale = s->time[to] / s->time[from];
    size_t bands = s->photosites / ((size_t)width * (size_t)rows);
    const float *da = s->dn[from], *db = s->dn[to];
    for (size_t k = 0; k < bands * (size_t)rows; k++) {
        if ((int)(k % (size_t)rows) == 0 || (int)(k % (size_t)rows) == rows - 1)
            continue;
        for (int x = 1; x < width - 1; x++) {
            size_t at = k * (size_t)width + (size_t)x;
            const size_t near[5] = {at, at - 1, at + 1, at - (size_t)width, at + (size_t)width};
            double m[5];
            bool good = true;
            for (int i = 0; i < 5; i++) {
                double a = (double)da[near[i]] - black, b = (double)db[near[i]] - black;
                good = good && b < 0.9 * range && b > 0.02 * range;
                m[i] = 0.5 * (scale * a + b);
            }
            if (!good)
                continue;
            double part = m[0] / range;
            double term[UNKNOWNS] = {0.5 * (m[2] - m[1]), 0.5 * (m[4] - m[3]), 1, part,
                                     part * part};
            double d = (double)db[at] - black - scale * ((double)da[at] - black);
            double w = 1 / m[0];  // photon noise
            for (int i = 0; i < UNKNOWNS; i++) {
                e->b[i] += w * term[i] * d;
                for (int j = 0; j <= i; j++)
                    e->a[i][j] += w * term[i] * term[j];
            }
            e->rest2 += w * d * d;
            e->count++;
        }
    }
}

/* false: nothing tells. */
static bool measure_step(struct step *step, const struct sample_set *set, int sample, int from,
                         int to, const struct sensor *sensor)
{
    enum { COUNT_MIN = 1000 };
    struct equations e = {0};
    for (int c = 0; c < 3; c += 2) {  // red and blue: of a mosaic, they are on square grids
        double range = fmin(sensor->usable[c], sensor->white[c]) - sensor->black[c];
        add_channel(&e, &set->channel[c][sample], from, to, sensor->black[c], range, set->width,
                    set->rows);
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
    *step =
        (struct step){-x[0] * set->pitch, -x[1] * set->pitch, sqrt(variance / energy) * set->pitch};
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

static struct groups find_groups(const struct sample_set *set, int sample, int frames,
                                 const struct sensor *sensor)
{
    struct groups g = {{0}, {0}};
    for (int f = 0; f < frames; f++)
        g.group[f] = f;
    for (int f = 1; f < frames; f++) {
        struct step step = {0};
        // Frames that cannot be compared stand together: nothing speaks against it.
        bool told = measure_step(&step, set, sample, f - 1, f, sensor);
        g.step[f] = hypot(step.x, step.y);
        if (!told || g.step[f] < step_limit + 6 * step.sigma)
            join(&g, frames, f - 1, f);
    }
    for (int f = 2; f < frames; f++) {
        struct step step;
        if (g.group[f] != g.group[f - 2] && measure_step(&step, set, sample, f - 2, f, sensor)
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
    if (set->rows < 3)
        return;
    for (int k = 0; k < set->samples; k++) {
        const struct bracket_sample *s = &set->channel[0][k];
        int frames = s->frames < 64 ? s->frames : 64, home = 0;
        struct groups g = find_groups(set, k, frames, sensor);
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
}
