/* fit.c -- models fitted to bins, and ranked.
 *
 * Method.   Residuals ln((f m + e)/(f' m + e)) / sigma, m = cos_i cos_o, e = 1e-3, at the bins'
 *           centroids, Cauchy's loss (or as enum fit_cost says); Ceres. A search over the whole
 *           range (fit_starts.c) gives three places from which to go down on a few hundred bins;
 *           the best goes on with all that are not held out, is judged by those that are, and then
 *           takes all of them. Models are fitted side by side, each by one thread, so the number
 *           of threads changes nothing. Pictures show the lobe's flank in few bins: there more of
 *           them take part.
 * Ranking.  By the mean bent residual of held-out bins. Where two models are within 2 % of each
 *           other, the one with fewer parameters explains more.
 */
#include "fit_starts.h"

#include "ceres_shim.h"
#include "fit_sgd.h"
#include "models.h"
#include "quantile.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

static const double POOR = 2;  // chi of the best of the few models: another is worth a try
enum { WANTED = 5000, WANTED_PICTURE = 20000, COARSE = 500 };

// A fit under way.
struct fitting {
    struct fit_model f;
    double solver[MODEL_PARAMETERS_MAX];
    double held_cost;  // per held-out bin
};

static bool is_sgd(const struct fitting *t)
{
    return t->f.model == &rec_model_sgd;
}

static enum status descend(struct fitting *t, const int *pick, int picked, int iterations,
                           double *cost, struct error *err)
{
    t->f.pick = pick;
    if (is_sgd(t))
        return rec_fit_sgd(&t->f, pick, picked, false, iterations, t->solver, err);
    struct least_squares problem = {
        .residual = rec_fit_residual,
        .context = &t->f,
        .low = t->f.low,
        .high = t->f.high,
        .parameters = t->solver,
        .scale = rec_fit_scale(t->f.cost),
        .points = picked,
        .residuals = 3 * rec_fit_residuals(t->f.cost),
        .size = t->f.size,
        .iterations = iterations,
    };
    enum status status = rec_least_squares(&problem, err);
    if (cost)
        *cost = problem.cost;
    return status;
}

// Which points take part in what: indices into the points.
struct division {
    int *all, *seen, *held, *coarse;
    int alls, seens, helds, coarses;
};

static enum status divide(struct division *d, const struct fit_point *points, int count,
                          struct error *err)
{
    int *room = malloc(4 * (size_t)count * sizeof *room);
    if (!room)
        return cap_fail(err, STATUS_MEMORY, "no memory for a fit");
    *d = (struct division){room, room + count, room + 2 * count, room + 3 * count, count, 0, 0, 0};
    for (int i = 0; i < count; i++) {
        d->all[i] = i;
        if (points[i].held)
            d->held[d->helds++] = i;
        else
            d->seen[d->seens++] = i;
    }
    int step = d->seens / COARSE + 1;
    for (int i = 0; i < d->seens; i += step)
        d->coarse[d->coarses++] = d->seen[i];
    return STATUS_OK;
}

// A model with a shape in each channel starts from the fit of the one that shares its shape.
static enum status start_from_shared(struct fitting *t, const struct model *shared,
                                     const struct division *d, struct error *err);

// From the best places of a coarse search, each some steps down; on from the lowest.
static enum status try_starts(struct fitting *t, const struct division *d, struct error *err)
{
    double start[FIT_STARTS_MAX][MODEL_PARAMETERS_MAX];
    struct fitting best = *t;
    double least = INFINITY;
    if (is_sgd(t))
        return rec_fit_sgd(&t->f, d->seen, d->seens, true, 40, t->solver, err);
    if (rec_model_shared(t->f.model))
        return start_from_shared(t, rec_model_shared(t->f.model), d, err);
    enum status status = STATUS_OK;
    int searched[COARSE], count = 0;
    for (int i = 0; i < d->coarses && count < COARSE; i += 2)
        searched[count++] = d->coarse[i];
    t->f.pick = searched;
    int starts = rec_fit_starts(&t->f, count, start, t->f.size > 3 ? 3 : 1);
    for (int s = 0; s < starts && !status; s++) {
        double cost = INFINITY;
        memcpy(t->solver, start[s], sizeof t->solver);
        status = descend(t, d->coarse, d->coarses, 25, &cost, err);
        if (cost < least) {
            least = cost;
            best = *t;
        }
    }
    *t = best;
    return status;
}

static enum status start_from_shared(struct fitting *t, const struct model *shared,
                                     const struct division *d, struct error *err)
{
    struct fitting one = {.f = rec_fit_model(shared, t->f.points, t->f.cost)};
    double value[MODEL_PARAMETERS_MAX], split[MODEL_PARAMETERS_MAX];
    enum status status = try_starts(&one, d, err);
    if (!status)
        status = descend(&one, d->seen, d->seens, 10, NULL, err);
    if (!status) {
        rec_fit_to_model(&one.f, one.solver, value);
        rec_model_split(shared, value, split);
        rec_fit_to_solver(&t->f, split, t->solver);
    }
    return status;
}

// The held-out bins' verdict.
static void judge(struct fit *fit, struct fitting *t, const struct division *d, double *scratch)
{
    double cost = 0, log2 = 0;
    int n = d->helds ? d->helds : d->alls;
    const int *pick = d->helds ? d->held : d->all;
    double *relative = scratch, *size = scratch + 3 * (size_t)n;
    double value[MODEL_PARAMETERS_MAX];
    t->f.pick = pick;
    rec_fit_to_model(&t->f, t->solver, value);
    for (int i = 0; i < n; i++) {
        const struct fit_point *p = &t->f.points[pick[i]];
        double r[6], f[3];
        rec_fit_residual(&t->f, i, t->solver, r, NULL);
        t->f.model->eval(value, p->wi, p->wo, f);
        cost += rec_fit_cost(t->f.cost, r);
        for (int c = 0; c < 3; c++) {
            double miss = p->log_f[c] - rec_fit_log(f[c], p->m);
            log2 += miss * miss;
            relative[3 * i + c] = fabs(f[c] / p->f[c] - 1);
            size[3 * i + c] = fabs(miss) / p->sigma[c];
        }
    }
    t->held_cost = cost / n;
    fit->log_rms = sqrt(log2 / (3.0 * n));
    fit->relative_median = rec_quantile(relative, 3 * n, 0.5);
    fit->chi = rec_quantile(size, 3 * n, 0.5) / 0.6745;
}

// The parameters and how sure they are; the last descent was on all points.
static void tell(struct fit *fit, const struct fitting *t, const struct division *d)
{
    rec_fit_to_model(&t->f, t->solver, fit->value);
    rec_fit_confine(t->f.model, fit->value);
    rec_fit_covariance(&t->f, d->alls, t->solver, fit->covariance);
    for (int k = 0; k < t->f.size; k++)
        fit->sigma[k] = sqrt(fit->covariance[k * t->f.size + k]);
}

// From here on, residuals by sigmas of what is fitted, not of what was measured.
static void be_near(struct fitting *t, const struct division *d, double (*near)[3])
{
    t->f.near = near;
    rec_fit_come_near(&t->f, d->alls, t->solver);
}

static enum status fit_one(struct fit *fit, struct fitting *t, const struct model *model,
                           const struct fit_point *points, enum fit_cost cost,
                           const struct division *d, struct error *err)
{
    double *scratch = malloc(9 * (size_t)d->alls * sizeof *scratch);
    if (!scratch)
        return cap_fail(err, STATUS_MEMORY, "no memory for a fit");
    double(*near)[3] = (double(*)[3])(scratch + 6 * (size_t)d->alls);
    *t = (struct fitting){.f = rec_fit_model(model, points, cost)};
    *fit = (struct fit){.model = model, .bins = d->alls};
    enum status status = try_starts(t, d, err);
    if (!status)
        status = descend(t, d->seen, d->seens, 20, NULL, err);
    if (!status) {
        judge(fit, t, d, scratch);
        be_near(t, d, near);
        status = descend(t, d->all, d->alls, 5, NULL, err);
    }
    if (!status)
        tell(fit, t, d);
    t->f.near = NULL;
    free(scratch);
    return status;
}

// Fewer parameters first where the errors are alike; else the smaller error.
static bool better(const struct fitting *a, const struct fitting *b)
{
    double x = a->held_cost, y = b->held_cost;
    if (fabs(x - y) <= 0.02 * fmin(x, y) && a->f.size != b->f.size)
        return a->f.size < b->f.size;
    return x < y;
}

static void rank(struct fit *fit, struct fitting *t, int count)
{
    for (int i = 1; i < count; i++)
        for (int k = i; k > 0 && better(&t[k], &t[k - 1]); k--) {
            struct fit f = fit[k];
            struct fitting u = t[k];
            fit[k] = fit[k - 1];
            t[k] = t[k - 1];
            fit[k - 1] = f;
            t[k - 1] = u;
        }
}

static enum status fit_all(struct fit *fit, const struct model *const *models, int count,
                           const struct fit_point *points, enum fit_cost cost,
                           const struct division *d, struct run *run, struct error *err)
{
    enum status status = STATUS_OK;
    struct fitting *t = calloc((size_t)count, sizeof *t);
    if (!t)
        return cap_fail(err, STATUS_MEMORY, "no memory for a fit");
#pragma omp parallel for schedule(dynamic) num_threads(run->threads)
    for (int i = 0; i < count; i++) {
        struct error why = {0};
        enum status s = fit_one(&fit[i], &t[i], models[i], points, cost, d, &why);
        cap_step(run);
        if (s) {
#pragma omp critical(fit)
            status = cap_fail(err, s, "%s: %s", models[i]->name, why.text);
        }
    }
    if (!status)
        rank(fit, t, count);
    free(t);
    return status;
}

enum status rec_fit_by(struct fits *fits, const struct bins *bins, enum fit_cost cost,
                       const struct model *const *models, int count, struct run *run,
                       struct error *err)
{
    struct fit_point *points = NULL;
    struct division d = {0};
    struct fit *fit = NULL;
    int n = 0;
    if (!models)
        for (models = rec_models, count = 0; rec_models[count];)
            count++;
    assert(count > 0);
    int wanted = cost == FIT_PICTURE ? WANTED_PICTURE : WANTED;
    enum status status = rec_fit_points(&points, &n, bins, wanted, err);
    if (!status)
        status = divide(&d, points, n, err);
    if (!status) {
        fit = calloc((size_t)count, sizeof *fit);
        status = fit ? fit_all(fit, models, count, points, cost, &d, run, err)
                     : cap_fail(err, STATUS_MEMORY, "no memory for a fit");
    }
    if (!status) {
        *fits = (struct fits){fit, count};
        fit = NULL;  // the caller's now
    }
    free(fit);
    free(points);
    free(d.all);
    return status;
}

// What no bin measures is filled by the best fit, also the grazing angles under which the lit board
// is mirrored: where the few models err by POOR times what the bins do, it is worth some seconds.
enum status rec_fit(struct fits *fits, const struct bins *bins, const struct model *const *models,
                    int count, struct run *run, struct error *err)
{
    enum status status = rec_fit_by(fits, bins, FIT_STATISTICAL, models, count, run, err);
    if (status || models || fits->fit[0].chi < POOR)
        return status;
    struct fits more = {0};
    int all = 0;
    while (rec_models_more[all])
        all++;
    status = rec_fit_by(&more, bins, FIT_STATISTICAL, rec_models_more, all, run, err);
    rec_fits_free(fits);
    *fits = more;
    return status;
}

static enum status fit_one_again(struct fit *fit, const struct fit_point *points,
                                 const struct division *d, struct error *err)
{
    struct fitting t = {.f = rec_fit_model(fit->model, points, FIT_STATISTICAL)};
    double(*near)[3] = malloc((size_t)d->alls * sizeof *near);
    if (!near)
        return cap_fail(err, STATUS_MEMORY, "no memory for a fit");
    rec_fit_to_solver(&t.f, fit->value, t.solver);
    be_near(&t, d, near);
    enum status status = descend(&t, d->all, d->alls, 5, NULL, err);
    if (!status)
        tell(fit, &t, d);
    free(near);
    return status;
}

enum status rec_fit_again(struct fits *fits, const struct bins *bins, struct run *run,
                          struct error *err)
{
    struct fit_point *points = NULL;
    struct division d = {0};
    int n = 0;
    enum status status = rec_fit_points(&points, &n, bins, WANTED, err);
    if (!status)
        status = divide(&d, points, n, err);
    if (!status) {
#pragma omp parallel for schedule(dynamic) num_threads(run->threads)
        for (int i = 0; i < fits->count; i++) {
            struct error why = {0};
            enum status s = fit_one_again(&fits->fit[i], points, &d, &why);
            if (s) {
#pragma omp critical(fit)
                status = cap_fail(err, s, "%s: %s", fits->fit[i].model->name, why.text);
            }
        }
    }
    free(points);
    free(d.all);
    return status;
}

void rec_fits_free(struct fits *fits)
{
    free(fits->fit);
    *fits = (struct fits){0};
}
