/* fit.c -- models fitted to bins, and ranked.
 *
 * Method.   Residuals ln((f m + e)/(f' m + e)) / sigma, m = cos_i cos_o, e = 1e-3, at the bins'
 *           centroids; Cauchy's loss, Ceres. Each model starts from several places on a few hundred
 *           bins; the best goes on with all that are not held out, is judged by those that are,
 *           and then takes all of them. Models are fitted side by side, each by one thread, so the
 *           number of threads changes nothing.
 * Ranking.  By the mean bent residual of held-out bins. Where two models are within 2 % of each
 *           other, the one with fewer parameters explains more.
 */
#include "fit_model.h"

#include "ceres_shim.h"
#include "quantile.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

enum { WANTED = 5000, COARSE = 500, STARTS = 6 };

static const double bend = 3;  // sigmas: residuals beyond it count less and less

// A fit under way.
struct fitting {
    struct fit_model f;
    double solver[MODEL_PARAMETERS_MAX];
    double held_cost;  // per held-out bin
};

// The matte part that the darkest fifth of the bins suggests: gloss only adds to it.
static void body_albedo(double albedo[3], const struct fit_point *points, int count,
                        double *scratch)
{
    assert(count > 0 && scratch);
    for (int c = 0; c < 3; c++) {
        for (int i = 0; i < count; i++)
            scratch[i] = points[i].f[c];
        albedo[c] = fmin(0.95, fmax(1e-3, CAP_PI * rec_quantile(scratch, count, 0.2)));
    }
}

// Where a parameter starts: three widths of lobe, each with a matte and with a glossy reading.
static double start_value(const struct parameter *p, int channel, int start, const double albedo[3])
{
    static const double width[3] = {0.03, 0.12, 0.4};
    bool glossy = start >= 3;
    if (strcmp(p->name, "albedo") == 0)
        return glossy ? 0.1 * albedo[channel] : albedo[channel];
    if (strcmp(p->name, "alpha") == 0)
        return width[start % 3];
    if (strcmp(p->name, "ior") == 0)
        return glossy ? 2.5 : 1.5;
    if (strcmp(p->name, "f0") == 0)
        return glossy ? 0.6 : 0.05;
    return 0.5 * (p->low + p->high);
}

static void start_at(struct fitting *t, int start, const double albedo[3])
{
    double value[MODEL_PARAMETERS_MAX];
    int k = 0;
    for (const struct parameter *p = t->f.model->parameter; p->name; p++)
        for (int c = 0; c < p->size; c++)
            value[k++] = start_value(p, c, start, albedo);
    rec_fit_to_solver(&t->f, value, t->solver);
}

static enum status descend(struct fitting *t, const int *pick, int picked, int iterations,
                           double *cost, struct error *err)
{
    t->f.pick = pick;
    struct least_squares problem = {
        .residual = rec_fit_residual,
        .context = &t->f,
        .low = t->f.low,
        .high = t->f.high,
        .parameters = t->solver,
        .scale = bend,
        .points = picked,
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

static enum status try_starts(struct fitting *t, const struct division *d, const double albedo[3],
                              struct error *err)
{
    struct fitting best = *t;
    double least = INFINITY;
    int starts = t->f.size > 3 ? STARTS : 1;  // three numbers are a colour: nothing to search
    enum status status = STATUS_OK;
    for (int s = 0; s < starts && !status; s++) {
        double cost = INFINITY;
        start_at(t, s, albedo);
        status = descend(t, d->coarse, d->coarses, 25, &cost, err);
        if (cost < least) {
            least = cost;
            best = *t;
        }
    }
    *t = best;
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
        double r[3], f[3];
        rec_fit_residual(&t->f, i, t->solver, r, NULL);
        t->f.model->eval(value, p->wi, p->wo, f);
        double r2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
        cost += log1p(r2 / (bend * bend));
        for (int c = 0; c < 3; c++) {
            log2 += r[c] * p->sigma[c] * r[c] * p->sigma[c];
            relative[3 * i + c] = fabs(f[c] / p->f[c] - 1);
            size[3 * i + c] = fabs(r[c]);
        }
    }
    t->held_cost = cost / n;
    fit->log_rms = sqrt(log2 / (3.0 * n));
    fit->relative_median = rec_quantile(relative, 3 * n, 0.5);
    fit->chi = rec_quantile(size, 3 * n, 0.5) / 0.6745;
}

static enum status fit_one(struct fit *fit, struct fitting *t, const struct model *model,
                           const struct fit_point *points, const struct division *d,
                           const double albedo[3], struct error *err)
{
    double *scratch = malloc(6 * (size_t)d->alls * sizeof *scratch);
    if (!scratch)
        return cap_fail(err, STATUS_MEMORY, "no memory for a fit");
    *t = (struct fitting){.f = rec_fit_model(model, points, NULL)};
    *fit = (struct fit){.model = model, .bins = d->alls};
    enum status status = try_starts(t, d, albedo, err);
    if (!status)
        status = descend(t, d->seen, d->seens, 20, NULL, err);
    if (!status) {
        judge(fit, t, d, scratch);
        status = descend(t, d->all, d->alls, 5, NULL, err);
    }
    if (!status) {
        rec_fit_to_model(&t->f, t->solver, fit->value);
        rec_fit_sigma(&t->f, d->alls, t->solver, fit->sigma);
    }
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
                           const struct fit_point *points, const struct division *d,
                           const double albedo[3], struct run *run, struct error *err)
{
    enum status status = STATUS_OK;
    struct fitting *t = calloc((size_t)count, sizeof *t);
    if (!t)
        return cap_fail(err, STATUS_MEMORY, "no memory for a fit");
#pragma omp parallel for schedule(dynamic) num_threads(run->threads)
    for (int i = 0; i < count; i++) {
        struct error why = {0};
        enum status s = fit_one(&fit[i], &t[i], models[i], points, d, albedo, &why);
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

enum status rec_fit(struct fits *fits, const struct bins *bins, const struct model *const *models,
                    int count, struct run *run, struct error *err)
{
    struct fit_point *points = NULL;
    struct division d = {0};
    struct fit *fit = NULL;
    double *scratch = NULL, albedo[3];
    int n = 0;
    if (!models)
        for (models = rec_models, count = 0; rec_models[count];)
            count++;
    assert(count > 0);
    enum status status = rec_fit_points(&points, &n, bins, WANTED, err);
    if (!status)
        status = divide(&d, points, n, err);
    if (!status) {
        fit = calloc((size_t)count, sizeof *fit);
        scratch = malloc((size_t)n * sizeof *scratch);
        if (!fit || !scratch)
            status = cap_fail(err, STATUS_MEMORY, "no memory for a fit");
    }
    if (!status) {
        body_albedo(albedo, points, n, scratch);
        status = fit_all(fit, models, count, points, &d, albedo, run, err);
    }
    if (!status) {
        *fits = (struct fits){fit, count};
        fit = NULL;  // the caller's now
    }
    free(fit);
    free(scratch);
    free(points);
    free(d.all);
    return status;
}

static enum status fit_one_again(struct fit *fit, const struct fit_point *points,
                                 const struct division *d, struct error *err)
{
    struct fitting t = {.f = rec_fit_model(fit->model, points, NULL)};
    rec_fit_to_solver(&t.f, fit->value, t.solver);
    enum status status = descend(&t, d->all, d->alls, 5, NULL, err);
    if (!status) {
        rec_fit_to_model(&t.f, t.solver, fit->value);
        rec_fit_sigma(&t.f, d->alls, t.solver, fit->sigma);
    }
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
