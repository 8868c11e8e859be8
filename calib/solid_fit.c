/* solid_fit.c -- a cylinder or a mesh moved to the edges of its outline.
 *
 * Method.   Every edge lies some pixels off the outline that the present place predicts. A shift v
 *           and a turn t (about the centre c) move the outline at the touched point p by
 *
 *               px_per_mm across.(v + t x (p - c)),
 *
 *           and a larger radius moves a cylinder's along its normal, a mesh's from its middle.
 * Least squares for these seven, reweighted by Tukey's biweight as for spheres (sphere.c); then the
 * outline is predicted anew. What no outline tells, such as the turn of a vase about its axis, is
 *           no unknown: the surface there is one of revolution, and it makes no difference.
 * Accuracy. The covariance is the sandwich over views, as for spheres: what is independent are
 *           views, not edges. The limb model's own bias is added.
 */
#include "solid_place.h"

#include "dense.h"
#include "view_scatter.h"

#include <stdlib.h>
#include <string.h>

enum { TURN = 0, SHIFT = 3, RADIUS = 6, UNKNOWNS = 7, EDGES_MIN = 20, ROUNDS = 15 };
static const double BIWEIGHT = 4.685;    // Tukey's constant: 95 % efficient for normal errors
static const double MODEL_PX = 0.012;    // bias of the limb model: ../shared/facts.md has 0.009 mm
static const double SHIFT_PRIOR = 0.15;  // of the sample's reach: placed by eye
static const double TURN_PRIOR = 0.1;    // rad, the same
static const double IDLE = 0.02;  // facets of a scan tell some 0.5 %, a handle tens of per cent
static const double HELD = 1e9;   // weight that holds an unknown, over its prior's

/** An edge as the fit sees it. */
struct pull {
    double by[UNKNOWNS];  // pixels that the outline moves by each unknown
    double off, sigma_px;
    int view;
};

static void make_pulls(struct pull *pull, const struct sample *s, const struct contour_edge *edge,
                       int count)
{
    const bool cylinder = s->shape == SHAPE_CYLINDER;
    vec3 axis = cylinder ? vec3_normalize(s->axis) : (vec3){0, 0, 0};
    for (int i = 0; i < count; i++) {
        const struct contour_point *at = &edge[i].at;
        vec3 arm = vec3_sub(at->point, s->center);
        vec3 turn = vec3_scale(vec3_cross(arm, at->across), at->px_per_mm);
        vec3 shift = vec3_scale(at->across, at->px_per_mm);
        vec3 radial = vec3_sub(arm, vec3_scale(axis, vec3_dot(arm, axis)));
        pull[i] = (struct pull){
            .by = {turn.x, turn.y, turn.z, shift.x, shift.y, shift.z,
                   vec3_dot(shift,
                            cylinder ? vec3_normalize(radial) : vec3_scale(arm, 1 / s->radius))},
            .off = edge[i].off,
            .sigma_px = hypot(edge[i].sigma_px, 0.01),  // no edge is better than that
            .view = edge[i].view,
        };
    }
}

static double residual(const struct pull *p, const double x[UNKNOWNS])
{
    double r = p->off;
    for (int a = 0; a < UNKNOWNS; a++)
        r -= p->by[a] * x[a];
    return r;
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double robust_scale(const struct pull *p, int count, const double x[UNKNOWNS], double *work)
{
    for (int i = 0; i < count; i++)
        work[i] = fabs(residual(&p[i], x)) / p[i].sigma_px;
    qsort(work, (size_t)count, sizeof *work, by_value);
    return fmax(1.4826 * work[count / 2], 0.5);
}

static double biweight(double z)
{
    double u = 1 - z * z / (BIWEIGHT * BIWEIGHT);
    return u > 0 ? u * u : 0;
}

/** Normal equations of the edges at x, and the gradient of each view. */
static void accumulate(double h[UNKNOWNS][UNKNOWNS], double (*view_g)[UNKNOWNS], int views,
                       const struct pull *p, int count, const double x[UNKNOWNS], double scale)
{
    memset(h, 0, sizeof(double[UNKNOWNS][UNKNOWNS]));
    memset(view_g, 0, (size_t)views * sizeof *view_g);
    for (int i = 0; i < count; i++) {
        double r = residual(&p[i], x);
        double w = biweight(r / (p[i].sigma_px * scale)) / (p[i].sigma_px * p[i].sigma_px);
        for (int a = 0; a < UNKNOWNS; a++) {
            for (int b = 0; b < UNKNOWNS; b++)
                h[a][b] += w * p[i].by[a] * p[i].by[b];
            view_g[p[i].view][a] += w * p[i].by[a] * r;
        }
    }
}

/** Priors, and their gradient at x. */
struct prior_terms {
    double weight[UNKNOWNS], wanted[UNKNOWNS];
    vec3 axis;  // about which a turn does nothing; 0: none
    double axis_weight;
};

/** Is the radius an unknown? */
static bool sizes(const struct sample *s, const struct solid_prior *prior)
{
    return s->shape == SHAPE_CYLINDER ? prior->free_radius : prior->free_size;
}

static struct prior_terms priors(const struct sample *s, const struct solid_prior *prior)
{
    const double shift = SHIFT_PRIOR * cal_solid_reach(s);
    struct prior_terms t = {.axis_weight = HELD / (TURN_PRIOR * TURN_PRIOR)};
    const double radius = prior->radius_sigma > 0 ? prior->radius_sigma : shift;
    const double moved[] = {prior->turned.x,          prior->turned.y,  prior->turned.z,
                            prior->shifted.x,         prior->shifted.y, prior->shifted.z,
                            s->radius - prior->radius};
    for (int a = 0; a < UNKNOWNS; a++) {
        double sigma = a < SHIFT ? TURN_PRIOR : a < RADIUS ? shift : radius;
        t.weight[a] = 1 / (sigma * sigma);
        t.wanted[a] = -moved[a];
    }
    if (!sizes(s, prior))
        t.weight[RADIUS] *= HELD;
    if (s->shape == SHAPE_CYLINDER)
        t.axis = vec3_normalize(s->axis);
    return t;
}

static void add_priors(double h[UNKNOWNS][UNKNOWNS], double g[UNKNOWNS],
                       const struct prior_terms *t, const double x[UNKNOWNS])
{
    const double axis[3] = {t->axis.x, t->axis.y, t->axis.z};
    double turn = 0;
    for (int a = 0; a < UNKNOWNS; a++) {
        h[a][a] += t->weight[a];
        g[a] += t->weight[a] * (t->wanted[a] - x[a]);
    }
    for (int a = 0; a < 3; a++)
        turn += axis[a] * x[TURN + a];
    for (int a = 0; a < 3; a++) {
        g[TURN + a] -= t->axis_weight * axis[a] * turn;
        for (int b = 0; b < 3; b++)
            h[TURN + a][TURN + b] += t->axis_weight * axis[a] * axis[b];
    }
}

/** The axis of a surface of revolution: edges (h) tell IDLE of a turn about it, compared with other
 *  turns. It is the weakest direction of the turns' block, by inverse iteration. */
static void find_idle_axis(struct prior_terms *t, const double h[UNKNOWNS][UNKNOWNS])
{
    double l[9], v[3] = {0.6, 0.5, 0.62};
    double trace = h[TURN][TURN] + h[TURN + 1][TURN + 1] + h[TURN + 2][TURN + 2];
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++)
            l[3 * a + b] = h[TURN + a][TURN + b] + (a == b ? 1e-6 * trace : 0);
    if (!dense_cholesky(3, l))
        return;
    double length = 1;
    for (int round = 0; round < 60; round++) {
        dense_solve(3, l, v);
        length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        for (int a = 0; a < 3; a++)
            v[a] /= length;
    }
    if (1 / length < IDLE * trace)
        t->axis = (vec3){v[0], v[1], v[2]};
}

static bool invert(double a[UNKNOWNS][UNKNOWNS])
{
    double l[UNKNOWNS * UNKNOWNS];
    memcpy(l, a, sizeof l);
    if (!dense_cholesky(UNKNOWNS, l))
        return false;
    dense_inverse(UNKNOWNS, l, &a[0][0]);
    return true;
}

static void measure_outline(struct sample *s, const struct pull *p, int count,
                            const double x[UNKNOWNS], double scale)
{
    double sum = 0;
    s->outline_edges = 0;
    for (int i = 0; i < count; i++) {
        double r = residual(&p[i], x);
        if (biweight(r / (p[i].sigma_px * scale)) > 0) {
            sum += r * r;
            s->outline_edges++;
        }
    }
    s->outline_rms_px = s->outline_edges ? sqrt(sum / s->outline_edges) : 0;
}

static void take_sigmas(struct sample *s, const double sigma[UNKNOWNS], double model_mm, bool sized)
{
    for (int a = 0; a < 3; a++) {
        s->sigma_center[a] = hypot(sigma[SHIFT + a], model_mm);
        s->sigma_turn[a] = hypot(sigma[TURN + a], model_mm / cal_solid_reach(s));
    }
    s->sigma_radius = sized ? hypot(sigma[RADIUS], model_mm) : 0;
}

enum status cal_solid_fit(struct sample *sample, struct solid_prior *prior,
                          const struct contour_edge *edge, int count, int views, double mm_per_px,
                          struct error *err)
{
    if (count < EDGES_MIN)
        return cap_fail(err, STATUS_DATA, "only %d edges of the sample's outline were found",
                        count);
    struct pull *pull = calloc((size_t)count, sizeof *pull);
    double *work = calloc((size_t)count, sizeof *work);
    double(*view_g)[UNKNOWNS] = calloc((size_t)views, sizeof *view_g);
    double h[UNKNOWNS][UNKNOWNS], x[UNKNOWNS] = {0}, sigma[UNKNOWNS], scale = 1;
    enum status status = STATUS_OK;
    if (!pull || !work || !view_g)
        status = cap_fail(err, STATUS_MEMORY, "%d edges", count);
    else
        make_pulls(pull, sample, edge, count);
    struct prior_terms terms = priors(sample, prior);
    for (int round = 0; round < ROUNDS && !status; round++) {
        double g[UNKNOWNS] = {0};
        scale = robust_scale(pull, count, x, work);
        accumulate(h, view_g, views, pull, count, x, scale);
        if (sample->shape == SHAPE_MESH)
            find_idle_axis(&terms, (const double(*)[UNKNOWNS])h);
        for (int v = 0; v < views; v++)
            for (int a = 0; a < UNKNOWNS; a++)
                g[a] += view_g[v][a];
        add_priors(h, g, &terms, x);
        if (!invert(h))
            status = cap_fail(err, STATUS_DATA, "the outlines do not determine the sample's place");
        for (int a = 0; a < UNKNOWNS && !status; a++)
            for (int b = 0; b < UNKNOWNS; b++)
                x[a] += h[a][b] * g[b];
    }
    if (!status) {
        vec3 turn = {x[0], x[1], x[2]}, shift = {x[3], x[4], x[5]};
        cal_view_scatter(sigma, &h[0][0], &view_g[0][0], UNKNOWNS, views);
        measure_outline(sample, pull, count, x, scale);
        status = cal_solid_move(sample, turn, shift, err);
        sample->radius += x[RADIUS];
        prior->turned = vec3_add(prior->turned, turn);
        prior->shifted = vec3_add(prior->shifted, shift);
        take_sigmas(sample, sigma, MODEL_PX * mm_per_px, sizes(sample, prior));
    }
    free(pull);
    free(work);
    free(view_g);
    return status;
}
