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
enum { RHO_D, RHO_S, LN_ALPHA, P, F0, F1, LN_LAMBDA, LN_S, K, THETA0 };

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

static void residual(const void *context, int i, const double *v, double *r, double *slope)
{
    struct channel *c = (struct channel *)(uintptr_t)context;  // its memory of the last place
    const struct seen *s = &c->seen[i];
    normalise(c, v);
    double f = value_of(v, c->kap[0], s), by_f[2];
    rec_fit_miss(c->cost, &s->of, f, r, by_f);
    for (int k = 0; slope && k < CHANNEL; k++) {
        double moved[CHANNEL];
        memcpy(moved, v, sizeof moved);
        moved[k] += step;
        double kap = c->kap[k == LN_ALPHA ? 1 : k == P ? 2 : 0];
        double by_parameter = (value_of(moved, kap, s) - f) / step;
        for (int j = 0; j < rec_fit_residuals(c->cost); j++)
            slope[j * CHANNEL + k] = by_f[j] * by_parameter;
    }
}

static enum status descend(struct channel *c, int points, int iterations, double *v, double *cost,
                           struct error *err)
{
    struct least_squares problem = {
        .residual = residual,
        .context = c,
        .low = low,
        .high = high,
        .parameters = v,
        .scale = rec_fit_scale(c->cost),
        .points = points,
        .residuals = rec_fit_residuals(c->cost),
        .size = CHANNEL,
        .iterations = iterations,
    };
    for (int k = 0; k < CHANNEL; k++)
        v[k] = fmin(high[k], fmax(low[k], v[k]));
    enum status status = rec_least_squares(&problem, err);
    *cost = problem.cost;
    return status;
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

static enum status search_channel(struct channel *c, int points, double *v, struct error *err)
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
        status = descend(c, points, 40, best[k], &cost[k], err);
        if (!status && cost[k] < least) {
            least = cost[k];
            memcpy(v, best[k], sizeof best[k]);
        }
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

enum status rec_fit_sgd(const struct fit_model *f, const int *pick, int picked, bool search,
                        int iterations, double *solver, struct error *err)
{
    double model[MODEL_PARAMETERS_MAX], v[CHANNEL], cost;
    struct seen *seen = malloc((size_t)picked * sizeof *seen);
    if (!seen)
        return cap_fail(err, STATUS_MEMORY, "no memory for a fit");
    enum status status = STATUS_OK;
    rec_fit_to_model(f, solver, model);
    for (int c = 0; c < 3 && !status; c++) {
        struct channel channel = {.seen = seen, .cost = f->cost, .at = {NAN, NAN}};
        if (search) {
            int n = see(seen, f, pick, picked, picked / COARSE + 1, c);
            status = search_channel(&channel, n, v, err);
        } else {
            from_model(v, model, c);
        }
        int n = see(seen, f, pick, picked, 1, c);
        if (!status)
            status = descend(&channel, n, iterations, v, &cost, err);
        if (!status)
            to_model(model, v, c);
    }
    if (!status)
        rec_fit_to_solver(f, model, solver);
    free(seen);
    return status;
}
