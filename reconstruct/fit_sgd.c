/* fit_sgd.c -- the SGD model's own way to be fitted.
 *
 * Method.   Channels share nothing, so each is a problem of ten parameters. In
 *               G1 = 1 - lambda (exp(s x^k) - 1),     x = (theta - theta0) / (pi/2 - theta0)
 *           s = c (pi/2 - theta0)^k is what the data tell of c: its logarithm and that of lambda
 *           are what the solver turns. The search goes over alpha and p; shadowing there is Smith's
 *           of Beckmann slopes of width sqrt(alpha), where the model comes near them; rhoD, rhoS
 * and F0 follow from a small linear problem.
 */
#include "fit_sgd.h"

#include "ceres_shim.h"
#include "fit_starts.h"
#include "sgd.h"

#include <stdlib.h>
#include <string.h>

enum { CHANNEL = 10, BEST = 3, COARSE = 400 };
enum { RHO_D, RHO_S, LN_ALPHA, P, F0, F1, LN_LAMBDA, LN_S, K, THETA0, LOBE = LN_LAMBDA };

static const double low[CHANNEL] = {0, 0, -11.5, 0, 0, -2, -18, -8, 1, -1};
static const double high[CHANNEL] = {1, 10, 0.69, 3, 10, 10, 18, 4, 1500, 1.3};
static const double step = 1e-6;

// What the model needs to know of a point, computed once.
struct seen {
    facet a;
    double theta_i, theta_o;
    struct fit_value of;
};

struct channel {
    const struct seen *seen;
    enum fit_cost cost;
    int free;              // of the parameters, from the first on: LOBE or CHANNEL
    double kept[CHANNEL];  // the others
    // Normalisations at alpha and p, a step of each further, and the place they belong to.
    double at[2], kap[3];
};

static void normalise(struct channel *c, const double *v)
{
    if (c->at[0] == v[LN_ALPHA] && c->at[1] == v[P])
        return;
    c->at[0] = v[LN_ALPHA];
    c->at[1] = v[P];
    for (int k = 0; k < 3; k++) {
        double alpha = exp(v[LN_ALPHA] + (k == 1 ? step : 0)), p = v[P] + (k == 2 ? step : 0);
        c->kap[k] = rec_sgd_normalisation(alpha, p);
    }
}

static double shadowing(const double *v, double theta)
{
    double x = (theta - v[THETA0]) / (CAP_PI / 2 - v[THETA0]);
    return x > 0 ? fmin(1, fmax(0, 1 - exp(v[LN_LAMBDA]) * expm1(exp(v[LN_S]) * pow(x, v[K])))) : 1;
}

// D G1 G1 / (cos_i cos_o).
static double lobe_of(const double *v, double kap, const struct seen *s)
{
    double g = shadowing(v, s->theta_i) * shadowing(v, s->theta_o);
    return rec_sgd_slopes(s->a, exp(v[LN_ALPHA]), v[P], kap) * g / (s->a.cos_i * s->a.cos_o);
}

static double value_of(const double *v, double kap, const struct seen *s)
{
    double fresnel = v[F0] - s->a.c * v[F1] + rec_schlick(s->a.c) * (1 - v[F0]);
    return (v[RHO_D] + v[RHO_S] * fmin(1, fmax(0, fresnel)) * lobe_of(v, kap, s)) / CAP_PI;
}

// The same with its derivatives by the four numbers of shadowing.
static double shadowing_slopes(const double *v, double theta, double by[CHANNEL - LOBE])
{
    double room = CAP_PI / 2 - v[THETA0], x = (theta - v[THETA0]) / room;
    double deep = exp(v[LN_LAMBDA]), rise = x > 0 ? exp(v[LN_S]) * pow(x, v[K]) : 0;
    double g = 1 - deep * expm1(rise);
    bool free = x > 0 && g > 0;
    double by_log_rise = free ? -deep * exp(rise) * rise : 0;
    by[LN_LAMBDA - LOBE] = free ? g - 1 : 0;
    by[LN_S - LOBE] = by_log_rise;
    by[K - LOBE] = free ? by_log_rise * log(x) : 0;
    by[THETA0 - LOBE] = free ? by_log_rise * v[K] / x * (theta - CAP_PI / 2) / (room * room) : 0;
    return fmin(1, fmax(0, g));
}

// value_of with its derivatives.
static double value_slopes(const struct channel *c, const double *v, const struct seen *s,
                           double by[CHANNEL])
{
    double by_i[CHANNEL - LOBE], by_o[CHANNEL - LOBE], alpha = exp(v[LN_ALPHA]);
    double g_i = shadowing_slopes(v, s->theta_i, by_i), g_o = shadowing_slopes(v, s->theta_o, by_o);
    double slopes =
        rec_sgd_slopes(s->a, alpha, v[P], c->kap[0]) / (CAP_PI * s->a.cos_i * s->a.cos_o);
    double rise = rec_schlick(s->a.c), fresnel = v[F0] - s->a.c * v[F1] + rise * (1 - v[F0]);
    bool free = fresnel > 0 && fresnel < 1;
    double lobe = slopes * g_i * g_o, facets = fmin(1, fmax(0, fresnel));
    double tan2 = s->a.sin2_h / s->a.cos2_h, x = alpha + tan2 / alpha, dx = alpha - tan2 / alpha;
    double gloss = v[RHO_S] * facets * lobe;
    by[RHO_D] = 1 / CAP_PI;
    by[RHO_S] = facets * lobe;
    by[LN_ALPHA] = gloss * (log(c->kap[1] / c->kap[0]) / step - dx * (1 + v[P] / x));
    by[P] = gloss * (log(c->kap[2] / c->kap[0]) / step - log(x));
    by[F0] = free ? v[RHO_S] * (1 - rise) * lobe : 0;
    by[F1] = free ? -v[RHO_S] * s->a.c * lobe : 0;
    for (int k = LOBE; k < CHANNEL; k++)
        by[k] = v[RHO_S] * facets * slopes * (by_i[k - LOBE] * g_o + g_i * by_o[k - LOBE]);
    return v[RHO_D] / CAP_PI + gloss;
}

// slope is [][free].
static void residual(const void *context, int i, const double *turned, double *r, double *slope)
{
    struct channel *c = (struct channel *)(uintptr_t)context;  // its memory of the last place
    const struct seen *s = &c->seen[i];
    double v[CHANNEL], by_parameter[CHANNEL], by_f[2];
    for (int k = 0; k < CHANNEL; k++)
        v[k] = k < c->free ? turned[k] : c->kept[k];
    normalise(c, v);
    double f = slope ? value_slopes(c, v, s, by_parameter) : value_of(v, c->kap[0], s);
    rec_fit_miss(c->cost, &s->of, f, r, by_f);
    for (int j = 0; slope && j < rec_fit_residuals(c->cost); j++)
        for (int k = 0; k < c->free; k++)
            slope[j * c->free + k] = by_f[j] * by_parameter[k];
}

// The first `free` parameters, the others as they are.
static enum status descend(struct channel *c, int free, int points, int iterations, double *v,
                           double *cost, struct error *err)
{
    c->free = free;
    for (int k = 0; k < CHANNEL; k++)
        c->kept[k] = v[k] = fmin(high[k], fmax(low[k], v[k]));
    struct least_squares problem = {
        .residual = residual,
        .context = c,
        .low = low,
        .high = high,
        .parameters = v,
        .scale = rec_fit_scale(c->cost),
        .points = points,
        .residuals = rec_fit_residuals(c->cost),
        .size = free,
        .iterations = iterations,
    };
    enum status status = rec_least_squares(&problem, err);
    *cost = problem.cost;
    return status;
}

// Shadowing tells little before the lobe is in its place, and would run to where it tells nothing.
static enum status go_down(struct channel *c, int points, double *v, double *cost,
                           struct error *err)
{
    enum status status = descend(c, LOBE, points, 25, v, cost, err);
    return status ? status : descend(c, CHANNEL, points, 40, v, cost, err);
}

// ---- the search

// Where Walter's G1 is 1/2, 0.1946 = 1 / (alpha tan theta), the model's is with s = 0.3.
static void shadow_like_smith(double *v)
{
    double half = atan(1 / (0.1946 * exp(0.5 * v[LN_ALPHA])));
    v[LN_LAMBDA] = log(3);
    v[LN_S] = log(0.3);
    v[THETA0] = 0;
    v[K] = fmin(1000, log(0.514) / log(half / (CAP_PI / 2)));
}

// rhoD, rhoS and F0 at given slopes, F1 = 0; returns the cost.
static double complete(struct channel *c, int points, double *v)
{
    double n[FIT_UNKNOWNS][FIT_UNKNOWNS] = {0}, b[FIT_UNKNOWNS] = {0}, x[FIT_UNKNOWNS], cost = 0;
    c->free = CHANNEL;
    normalise(c, v);
    for (int i = 0; i < points; i++) {
        const struct seen *s = &c->seen[i];
        double w = s->of.m / (fmax(0, s->of.f) * s->of.m + FIT_DARK), rise = rec_schlick(s->a.c);
        double lobe = lobe_of(v, c->kap[0], s) / CAP_PI;
        double column[FIT_UNKNOWNS] = {1 / CAP_PI, lobe * (1 - rise), lobe * rise};
        for (int j = 0; j < FIT_UNKNOWNS; j++) {
            for (int k = 0; k < FIT_UNKNOWNS; k++)
                n[j][k] += w * w * column[j] * column[k];
            b[j] += w * w * column[j] * s->of.f;
        }
    }
    rec_fit_nonnegative(n, b, FIT_UNKNOWNS, x);
    v[RHO_D] = fmin(1, x[0]);
    v[RHO_S] = fmin(10, fmax(1e-6, fmax(x[1], x[2])));
    v[F0] = fmin(1, x[1] / v[RHO_S]);
    v[F1] = 0;
    for (int i = 0; i < points; i++) {
        double r[2] = {0, 0};
        residual(c, i, v, r, NULL);
        cost += rec_fit_loss(c->cost, r[0] * r[0] + r[1] * r[1]);
    }
    return cost;
}

static enum status search_channel(struct channel *c, int points, double *v, double *reached,
                                  struct error *err)
{
    static const double ps[] = {0.05, 0.4, 0.8, 1.3};
    double best[BEST][CHANNEL], cost[BEST] = {INFINITY, INFINITY, INFINITY}, least = INFINITY;
    for (int i = 0; i < 10; i++)
        for (int j = 0; j < 4; j++) {
            double at[CHANNEL] = {[LN_ALPHA] = -10.5 + i * 1.1, [P] = ps[j]};
            shadow_like_smith(at);
            double here = complete(c, points, at);
            int place = BEST;
            for (; place > 0 && here < cost[place - 1]; place--)
                if (place < BEST) {
                    cost[place] = cost[place - 1];
                    memcpy(best[place], best[place - 1], sizeof at);
                }
            if (place < BEST) {
                cost[place] = here;
                memcpy(best[place], at, sizeof at);
            }
        }
    enum status status = STATUS_OK;
    for (int k = 0; k < BEST && !status && isfinite(cost[k]); k++) {
        status = go_down(c, points, best[k], &cost[k], err);
        if (!status && cost[k] < least) {
            least = cost[k];
            memcpy(v, best[k], sizeof best[k]);
        }
    }
    *reached = least;
    return status;
}

// Channels mostly share their slopes: where another channel's make a better start than the
// channel's own, its result is that of the better one.
static enum status learn(struct channel *c, int points, double *v, double *cost,
                         const double *other, struct error *err)
{
    const double exact = 1e-8;  // of a point
    if (*cost < exact * points)
        return STATUS_OK;
    double at[CHANNEL], reached;
    memcpy(at, other, sizeof at);
    complete(c, points, at);
    enum status status = go_down(c, points, at, &reached, err);
    if (!status && reached < *cost) {
        *cost = reached;
        memcpy(v, at, sizeof at);
    }
    return status;
}

// ---- all channels

// Every step-th of the points that take part.
static int see(struct seen *seen, const struct fit_model *f, const int *pick, int picked, int step_,
               int channel)
{
    int n = 0;
    for (int i = 0; i < picked; i += step_) {
        const struct fit_point *p = &f->points[pick[i]];
        seen[n++] = (struct seen){
            .a = rec_facet(p->wi, p->wo),
            .theta_i = atan2(hypot(p->wi.x, p->wi.y), p->wi.z),
            .theta_o = atan2(hypot(p->wo.x, p->wo.y), p->wo.z),
            .of = rec_fit_value(f, pick[i], channel),
        };
    }
    return n;
}

// Between the model's parameters of a channel and the solver's here.
static void from_model(double *v, const double *model, int c)
{
    for (int k = 0; k < CHANNEL; k++)
        v[k] = model[3 * k + c];
    v[LN_ALPHA] = log(v[LN_ALPHA]);
    v[LN_LAMBDA] = log(v[LN_LAMBDA]);
    double c_g = v[LN_S], k = model[3 * 8 + c], theta0 = model[3 * 9 + c];
    v[LN_S] = log(c_g) + k * log(CAP_PI / 2 - theta0);
}

static void to_model(double *model, const double *v, int c)
{
    for (int k = 0; k < CHANNEL; k++)
        model[3 * k + c] = v[k];
    model[3 * LN_ALPHA + c] = exp(v[LN_ALPHA]);
    model[3 * LN_LAMBDA + c] = exp(v[LN_LAMBDA]);
    model[3 * LN_S + c] = exp(fmin(88, v[LN_S] - v[K] * log(CAP_PI / 2 - v[THETA0])));
}

// Each channel's search on some of the points, and what it learns of the others.
static enum status search(const struct fit_model *f, const int *pick, int picked, struct seen *seen,
                          double v[3][CHANNEL], struct error *err)
{
    double cost[3];
    enum status status = STATUS_OK;
    for (int k = 0; k < 6 && !status; k++) {  // all channels for themselves, and again
        int c = k % 3, step_ = picked / COARSE + 1;
        struct channel channel = {.seen = seen, .cost = f->cost, .at = {NAN, NAN}};
        int n = see(seen, f, pick, picked, step_, c);
        if (k < 3)
            status = search_channel(&channel, n, v[c], &cost[c], err);
        for (int other = 1; k >= 3 && other < 3 && !status; other++)
            status = learn(&channel, n, v[c], &cost[c], v[(c + other) % 3], err);
    }
    return status;
}

enum status rec_fit_sgd(const struct fit_model *f, const int *pick, int picked, bool searched,
                        int iterations, double *solver, struct error *err)
{
    double model[MODEL_PARAMETERS_MAX], v[3][CHANNEL], cost;
    struct seen *seen = malloc((size_t)picked * sizeof *seen);
    if (!seen)
        return cap_fail(err, STATUS_MEMORY, "no memory for a fit");
    rec_fit_to_model(f, solver, model);
    for (int c = 0; c < 3; c++)
        from_model(v[c], model, c);
    enum status status = searched ? search(f, pick, picked, seen, v, err) : STATUS_OK;
    for (int c = 0; c < 3 && !status; c++) {
        struct channel channel = {.seen = seen, .cost = f->cost, .at = {NAN, NAN}};
        int n = see(seen, f, pick, picked, 1, c);
        status = descend(&channel, CHANNEL, n, iterations, v[c], &cost, err);
        if (!status)
            to_model(model, v[c], c);
    }
    if (!status)
        rec_fit_to_solver(f, model, solver);
    free(seen);
    return status;
}
