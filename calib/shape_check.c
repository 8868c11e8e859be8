/* shape_check.c -- is the sample the shape that it is said to be?
 *
 * Method.   An outline shows the sample's tangent planes. What they stray by from the placed
 *           shape is fitted by patterns (Tukey's biweight), a shift, a turn and another size among
 *           them, for these are no misfit:
 *
 *               sphere     harmonics of degree 2 (an ellipsoid) and 3 (an egg) of the normal
 *               cylinder   cos and sin of 2 phi (oval), z (a cone), z^2 (a barrel)
 *               mesh       n.A arm with A symmetric: another scale, stretched
 *
 *           What is left is averaged over places 24 degrees wide: a dent or a bump.
 * Accuracy. A pattern counts when it is SURE sigmas where it is largest, and tilts normals enough
 *           to matter. Sigmas are those of the sandwich over views, never below the formal ones,
 *           with the limb model's bias added, and what edges scatter by beyond their noise: where
 *           the sample mirrors its surroundings, that is alike over arcs as long as patterns. What
 *           the robust fit would call an outlier, a deep dent, still shows in its place.
 */
#include "shape_check.h"

#include "dense.h"

#include <stdlib.h>
#include <string.h>

enum { NUISANCE = 7, MOST = NUISANCE + 12, ROUNDS = 12, ENOUGH = 60, VIEWS_ENOUGH = 3 };
enum { PLACES = 1000 };                         // that are looked at for dents
static const double ABOUT = 12 * CAP_PI / 180;  // a place: half of its width
static const double BIWEIGHT = 4.685;  // Tukey's constant: 95 % efficient for normal errors
static const double MODEL_PX = 0.012;  // bias of the limb model: ../shared/facts.md has 0.009 mm
static const double SURE = 6;          // sigmas: dozens of directions are looked at
static const double CLEAR = 3;         // sigmas of what one view says of a place
static const double MATTERS = 0.001;   // of the reach: 0.06 degrees or more of the normals
static const double WEAK = 1e-6;       // ridge: what no touch tells stays 0

/** Numbers first..first+count-1 of the fit are one pattern. */
struct group {
    const char *name;
    int first, count;
};
static const struct group of_sphere[] = {
    {"an ellipsoid", NUISANCE, 5}, {"an egg", NUISANCE + 5, 7}, {NULL, 0, 0}};
static const struct group of_cylinder[] = {{"an oval cross-section", NUISANCE, 2},
                                           {"a cone", NUISANCE + 2, 1},
                                           {"a barrel", NUISANCE + 3, 1},
                                           {NULL, 0, 0}};
static const struct group of_mesh[] = {
    {"another scale", NUISANCE, 1}, {"a stretched copy", NUISANCE + 1, 5}, {NULL, 0, 0}};

static const struct group *groups_of(enum shape shape)
{
    return shape == SHAPE_SPHERE ? of_sphere : shape == SHAPE_CYLINDER ? of_cylinder : of_mesh;
}

/** The harmonics of degree 2 and 3 of a unit vector, not normalized. */
static void harmonics(vec3 n, double f[12])
{
    const double x = n.x, y = n.y, z = n.z;
    const double all[12] = {x * y,
                            y * z,
                            z * x,
                            x * x - y * y,
                            3 * z * z - 1,
                            y * (3 * x * x - y * y),
                            x * (x * x - 3 * y * y),
                            x * y * z,
                            z * (x * x - y * y),
                            y * (5 * z * z - 1),
                            x * (5 * z * z - 1),
                            z * (5 * z * z - 3)};
    memcpy(f, all, sizeof all);
}

/** By how much each number of the fit moves the tangent plane at a touch; returns how many. */
static int patterns_at(double f[MOST], const struct touch *t, const struct sample *s, double reach)
{
    const vec3 n = t->normal, arm = vec3_scale(t->arm, 1 / reach), turn = vec3_cross(arm, n);
    memset(f, 0, MOST * sizeof *f);
    const double common[] = {n.x, n.y, n.z, turn.x, turn.y, turn.z};
    memcpy(f, common, sizeof common);
    double *own = f + NUISANCE;
    if (s->shape == SHAPE_SPHERE) {
        f[6] = 1;
        harmonics(n, own);
        return NUISANCE + 12;
    }
    if (s->shape == SHAPE_CYLINDER) {
        vec3 axis = vec3_normalize(s->axis);
        vec3 away = fabs(axis.x) < 0.8 ? (vec3){1, 0, 0} : (vec3){0, 1, 0};
        vec3 u = vec3_normalize(vec3_cross(axis, away)), v = vec3_cross(axis, u);
        double c = vec3_dot(n, u), d = vec3_dot(n, v), z = vec3_dot(arm, axis);
        double side = c * c + d * d;  // 1 on the side, 0 on the caps
        f[6] = side;
        own[0] = c * c - d * d;
        own[1] = 2 * c * d;
        own[2] = side * z;
        own[3] = side * z * z;
        return NUISANCE + 4;
    }
    own[0] = vec3_dot(n, arm);
    own[1] = n.x * arm.y + n.y * arm.x;
    own[2] = n.y * arm.z + n.z * arm.y;
    own[3] = n.z * arm.x + n.x * arm.z;
    own[4] = n.x * arm.x - n.y * arm.y;
    own[5] = 2 * n.z * arm.z - n.x * arm.x - n.y * arm.y;
    return NUISANCE + 6;
}

/** The fit: numbers x and their covariance, and what is left of each touch. */
struct study {
    const struct sample *sample;
    const struct touch *touch;
    int count, views, numbers;
    double reach, scale;
    double model, strays;  // mm: the limb's bias; what edges scatter by beyond their noise
    double x[MOST], covariance[MOST][MOST];
    double (*moved)[MOST];  // [views] of x, when a view is left out
    double *left;           // [count]
    vec3 *way;              // [count] unit, from the centre to the touch
    double cos_wide;
};

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double biweight(double z)
{
    double u = 1 - z * z / (BIWEIGHT * BIWEIGHT);
    return u > 0 ? u * u : 0;
}

/** 1.4826 x median of |left / sigma|. */
static double robust_scale(const struct study *s, double *work)
{
    for (int i = 0; i < s->count; i++)
        work[i] = fabs(s->left[i]) / s->touch[i].sigma;
    qsort(work, (size_t)s->count, sizeof *work, by_value);
    return fmax(1.4826 * work[s->count / 2], 0.5);
}

static void take_left(struct study *s)
{
    for (int i = 0; i < s->count; i++) {
        double f[MOST];
        patterns_at(f, &s->touch[i], s->sample, s->reach);
        s->left[i] = s->touch[i].off;
        for (int a = 0; a < s->numbers; a++)
            s->left[i] -= f[a] * s->x[a];
    }
}

/** The normal equations of some touches, added to h [numbers][numbers] and g [numbers]. */
static void add_touches(double *h, double *g, const struct study *s, int first, int end)
{
    const int n = s->numbers;
    for (int i = first; i < end; i++) {
        const struct touch *t = &s->touch[i];
        double f[MOST], sigma = t->sigma * s->scale;
        double w = biweight(s->left[i] / sigma) / (sigma * sigma);
        patterns_at(f, t, s->sample, s->reach);
        for (int a = 0; a < n; a++) {
            for (int b = 0; b < n; b++)
                h[a * n + b] += w * f[a] * f[b];
            g[a] += w * f[a] * s->left[i];
        }
    }
}

/** The factor of h, with a ridge under it. false: singular. */
static bool factor(double *h, int n)
{
    double trace = 0;
    for (int a = 0; a < n; a++)
        trace += h[a * n + a];
    for (int a = 0; a < n; a++)
        h[a * n + a] += WEAK * trace;
    return dense_cholesky(n, h);
}

/** Weighted least squares for a step; covariance becomes the inverse of the normal matrix.
 *  false: singular. */
static bool step(struct study *s)
{
    const int n = s->numbers;
    double h[MOST * MOST] = {0}, g[MOST] = {0}, inverse[MOST * MOST];
    add_touches(h, g, s, 0, s->count);
    if (!factor(h, n))
        return false;
    dense_inverse(n, h, inverse);
    for (int a = 0; a < n; a++)
        for (int b = 0; b < n; b++) {
            s->covariance[a][b] = inverse[a * n + b];
            s->x[a] += inverse[a * n + b] * g[b];
        }
    return true;
}

/** By how much the numbers would move without each of the views: (H - H_v)^-1 g_v. */
static void leave_out(struct study *s)
{
    const int n = s->numbers;
    double all[MOST * MOST] = {0}, unused[MOST] = {0};
    add_touches(all, unused, s, 0, s->count);
    for (int first = 0, end; first < s->count; first = end) {
        const int view = s->touch[first].view;
        double h[MOST * MOST] = {0}, g[MOST] = {0};
        for (end = first; end < s->count && s->touch[end].view == view;)
            end++;
        add_touches(h, g, s, first, end);
        for (int i = 0; i < n * n; i++)
            h[i] = all[i] - h[i];
        if (!factor(h, n))
            continue;  // no other view tells: see VIEWS_ENOUGH
        dense_solve(n, h, g);
        memcpy(s->moved[view], g, sizeof g);
    }
}

/** Robust fit of all patterns at once. false: the touches do not tell them. */
static bool fit(struct study *s, double *work)
{
    for (int round = 0; round < ROUNDS; round++) {
        take_left(s);
        s->scale = robust_scale(s, work);
        if (!step(s))
            return false;
    }
    take_left(s);
    leave_out(s);
    double noise = 0;
    for (int i = 0; i < s->count; i++)
        noise += s->touch[i].sigma / s->count;
    s->strays = noise * sqrt(fmax(s->scale * s->scale - 1, 0));
    return true;
}

/** Standard deviation of the pattern f (0 outside it): formal, or by the jackknife over views. */
static double sigma_of(const struct study *s, const double f[MOST])
{
    double formal = 0, scatter = 0;
    int seen = 0;
    for (int a = 0; a < s->numbers; a++)
        for (int b = 0; b < s->numbers; b++)
            formal += f[a] * s->covariance[a][b] * f[b];
    for (int v = 0; v < s->views; v++) {
        double moved = 0, any = 0;
        for (int a = 0; a < s->numbers; a++) {
            moved += f[a] * s->moved[v][a];
            any += fabs(s->moved[v][a]);
        }
        scatter += moved * moved;
        seen += any > 0;
    }
    double variance = formal;
    if (seen >= VIEWS_ENOUGH)
        variance = fmax(formal, scatter * (seen - 1) / seen);
    return sqrt(variance + s->model * s->model + s->strays * s->strays);
}

static void keep_larger(struct misfit *best, const struct misfit *m, double reach)
{
    double size = fmax(m->outwards, m->inwards);
    if (size > SURE * m->sigma && size > MATTERS * reach
        && size > fmax(best->outwards, best->inwards))
        *best = *m;
}

/** The extremes of one pattern over the touches. */
static void try_group(struct misfit *best, const struct study *s, const struct group *g)
{
    struct misfit m = {.pattern = g->name};
    double f[MOST], largest[MOST] = {0};
    for (int i = 0; i < s->count; i++) {
        double out = 0;
        patterns_at(f, &s->touch[i], s->sample, s->reach);
        for (int a = 0; a < g->count; a++)
            out += f[g->first + a] * s->x[g->first + a];
        if (fabs(out) > fmax(m.outwards, m.inwards)) {
            memset(largest, 0, sizeof largest);
            memcpy(largest + g->first, f + g->first, (size_t)g->count * sizeof *f);
        }
        if (out > m.outwards) {
            m.outwards = out;
            m.most = vec3_normalize(s->touch[i].arm);
        }
        if (-out > m.inwards) {
            m.inwards = -out;
            m.least = vec3_normalize(s->touch[i].arm);
        }
    }
    m.sigma = sigma_of(s, largest);
    keep_larger(best, &m, s->reach);
}

/* ---- places --------------------------------------------------------------------------------- */

/** What views agree on at one place. */
struct place {
    vec3 at;
    double mean, scatter;     // of the views' means, by their sigmas; their standard deviation
    double sigma;             // of mean, by those of the edges
    int views, below, above;  // all; those whose mean is beyond `clear`, and beyond doubt
};

/** The touches within ABOUT of a direction. Those of a view stand together, and share what their
 *  edges are off by. */
static struct place look_at(const struct study *s, vec3 at, double clear)
{
    struct place p = {.at = at};
    double sum = 0, sum2 = 0, weights = 0;
    for (int first = 0, end; first < s->count; first = end) {
        double left = 0, precision = 0;
        int seen = 0;
        for (end = first; end < s->count && s->touch[end].view == s->touch[first].view; end++)
            if (vec3_dot(s->way[end], at) > s->cos_wide) {
                double of_edge = 1 / (s->touch[end].sigma * s->touch[end].sigma);
                left += of_edge * s->left[end];
                precision += of_edge;
                seen++;
            }
        if (seen == 0)
            continue;
        left /= precision;
        double variance = seen / precision + s->model * s->model, weight = 1 / variance;
        double sure = fmax(clear, CLEAR * sqrt(variance));
        sum += weight * left;
        sum2 += weight * left * left;
        weights += weight;
        p.views++;
        p.below += left < -sure;
        p.above += left > sure;
    }
    p.mean = p.views ? sum / weights : 0;
    p.sigma = p.views ? sqrt(1 / weights) : 0;
    p.scatter =
        p.views > 1 ? sqrt(fmax(sum2 - p.mean * sum, 0) / weights * p.views / (p.views - 1.0)) : 0;
    return p;
}

/** The medians over places: what views' means scatter by at one place (that enough of them see),
 *  and how far from 0 their mean is, as a standard deviation: what light does to some edges and not
 * to others. */
static double usual_scatter(double *stray, const struct study *s, int every)
{
    double all[PLACES], means[PLACES];
    int n = 0, places = 0;
    *stray = 0;
    for (int i = 0; i < s->count && places < PLACES; i += every) {
        struct place p = look_at(s, s->way[i], 0);
        means[places++] = fabs(p.mean);
        if (p.views >= VIEWS_ENOUGH)
            all[n++] = p.scatter;
    }
    if (n == 0)
        return 0;
    qsort(all, (size_t)n, sizeof *all, by_value);
    qsort(means, (size_t)places, sizeof *means, by_value);
    *stray = 1.4826 * means[places / 2];
    return all[n / 2];
}

/** A place that most views have inside, or outside, of the shape. What they make of it may differ:
 *  one sees the middle of a dent, another its rim. */
static void try_places(struct misfit *best, const struct study *s)
{
    const int every = 1 + s->count / PLACES;
    double stray;
    const double usual = usual_scatter(&stray, s, every);
    for (int i = 0; i < s->count; i += every) {
        struct place p = look_at(s, s->way[i], CLEAR * usual);
        const int agree = p.mean < 0 ? p.below : p.above;
        if (agree < VIEWS_ENOUGH || 3 * agree < 2 * p.views)
            continue;
        struct misfit m = {.sigma = sqrt(usual * usual / p.views + p.sigma * p.sigma + stray * stray
                                         + s->model * s->model + s->strays * s->strays)};
        m.pattern = p.mean < 0 ? "a dent" : "a bump";
        *(p.mean < 0 ? &m.inwards : &m.outwards) = fabs(p.mean);
        *(p.mean < 0 ? &m.least : &m.most) = p.at;
        keep_larger(best, &m, s->reach);
    }
}

/* -------------------------------------------------------------------------------------------- */

enum status cal_shape_check(struct misfit *misfit, const struct sample *sample,
                            const struct touch *touch, int count, int views, struct error *err)
{
    *misfit = (struct misfit){0};
    if (count < ENOUGH)
        return STATUS_OK;
    struct study s = {.sample = sample,
                      .touch = touch,
                      .count = count,
                      .views = views,
                      .scale = 1,
                      .cos_wide = cos(ABOUT)};
    double f[MOST], *work = calloc((size_t)count, sizeof *work);
    s.moved = calloc((size_t)views, sizeof *s.moved);
    s.left = calloc((size_t)count, sizeof *s.left);
    s.way = calloc((size_t)count, sizeof *s.way);
    enum status status = work && s.moved && s.left && s.way
                             ? STATUS_OK
                             : cap_fail(err, STATUS_MEMORY, "%d edges", count);
    for (int i = 0; i < count; i++) {
        s.reach = fmax(s.reach, vec3_length(touch[i].arm));
        s.model += MODEL_PX / touch[i].px_per_mm / count;
        if (s.way)
            s.way[i] = vec3_normalize(touch[i].arm);
    }
    s.numbers = patterns_at(f, &touch[0], sample, s.reach);
    if (!status && fit(&s, work)) {
        for (const struct group *g = groups_of(sample->shape); g->name; g++)
            try_group(misfit, &s, g);
        if (!misfit->pattern)
            try_places(misfit, &s);
    }
    free(work);
    free(s.moved);
    free(s.left);
    free(s.way);
    return status;
}

enum status cal_shape_warn(const struct sample *sample, const struct touch *touch, int count,
                           int views, struct run *run, struct error *err)
{
    static const char *const names[] = {"", "sphere", "cylinder", "mesh"};
    struct misfit m;
    enum status status = cal_shape_check(&m, sample, touch, count, views, err);
    if (status || !m.pattern)
        return status;
    bool out = m.outwards >= m.inwards;
    vec3 at = out ? m.most : m.least;
    cap_warn(run,
             "the sample is not the %s that capture.yaml says, but like %s: its outline is up to "
             "%.3f +- %.3f mm further %s, in the direction [%.2f, %.2f, %.2f] from its middle",
             names[sample->shape], m.pattern, out ? m.outwards : m.inwards, m.sigma,
             out ? "out" : "in", at.x, at.y, at.z);
    return STATUS_OK;
}
