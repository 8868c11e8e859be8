/* fit_model.c -- a model's residuals at fit points.
 *
 * Accuracy. Differences over a step of 1e-6 err by its square root's share of rounding, 1e-10, and
 *           by half a second derivative, 1e-6: slopes steer the descent, and no more hangs on them.
 */
#include "fit_model.h"

#include "ceres_shim.h"

static const double step = 1e-6;

// Where a range begins at 0 and is wide, its logarithm begins here.
static const double least = 1e-3;

struct fit_model rec_fit_model(const struct model *model, const struct fit_point *points,
                               enum fit_cost cost)
{
    struct fit_model f = {.model = model, .points = points, .cost = cost};
    for (const struct parameter *p = model->parameter; p->name; p++)
        for (int c = 0; c < p->size; c++, f.size++) {
            double low = p->low == 0 && p->high >= 1e4 ? least : p->low;
            bool wide = low > 0 && p->high >= 100 * low;
            f.logarithm[f.size] = wide;
            f.low[f.size] = wide ? log(low) : low;
            f.high[f.size] = wide ? log(p->high) : p->high;
        }
    return f;
}

void rec_fit_to_model(const struct fit_model *f, const double *solver, double *model)
{
    for (int k = 0; k < f->size; k++)
        model[k] = f->logarithm[k] ? exp(solver[k]) : solver[k];
}

void rec_fit_to_solver(const struct fit_model *f, const double *model, double *solver)
{
    for (int k = 0; k < f->size; k++) {
        double x = f->logarithm[k] ? log(fmax(model[k], 1e-300)) : model[k];
        solver[k] = fmin(f->high[k], fmax(f->low[k], x));
    }
}

double rec_fit_scale(enum fit_cost cost)
{
    return cost == FIT_CUBE_ROOT ? 0 : FIT_BEND;
}

double rec_fit_loss(enum fit_cost cost, double r2)
{
    if (cost == FIT_CUBE_ROOT)
        return cbrt(r2 + CUBE_ROOT_EVEN * CUBE_ROOT_EVEN);
    return log1p(r2 / (FIT_BEND * FIT_BEND));
}

struct fit_value rec_fit_value(const struct fit_point *p, int channel)
{
    return (struct fit_value){p->f[channel], p->log_f[channel], p->sigma[channel], p->m,
                              fmax(p->wi.z, p->wo.z)};
}

double rec_fit_miss(enum fit_cost cost, const struct fit_value *v, double fitted, double *by_f)
{
    if (cost == FIT_CUBE_ROOT) {
        *by_f = -v->m;
        return (v->f - fitted) * v->m;
    }
    if (cost == FIT_PICTURE) {
        double bright = CAP_PI * v->cosine, dark = 1 + bright * fitted;
        *by_f = -bright / (dark * FIT_LOG_SIGMA);
        return log((1 + bright * fmax(0, v->f)) / dark) / FIT_LOG_SIGMA;
    }
    double sigma = cost == FIT_LOG ? FIT_LOG_SIGMA : v->sigma;
    *by_f = -v->m / ((fitted * v->m + FIT_DARK) * sigma);
    return (v->log_f - rec_fit_log(fitted, v->m)) / sigma;
}

// Derivatives of f by the solver's parameters, [3][size], by differences.
static void take_differences(const struct fit_model *f, const struct fit_point *p,
                             const double *solver, const double fitted[3], double *slope)
{
    double at[MODEL_PARAMETERS_MAX], value[MODEL_PARAMETERS_MAX], moved[3];
    for (int k = 0; k < f->size; k++)
        at[k] = solver[k];
    rec_fit_to_model(f, solver, value);
    for (int k = 0; k < f->size; k++) {
        bool room = solver[k] + step <= f->high[k];  // no step out of the physical range
        double kept = value[k];
        at[k] += room ? step : -step;
        value[k] = f->logarithm[k] ? exp(at[k]) : at[k];
        f->model->eval(value, p->wi, p->wo, moved);
        for (int c = 0; c < 3; c++)
            slope[c * f->size + k] = (moved[c] - fitted[c]) / (at[k] - solver[k]);
        at[k] = solver[k];
        value[k] = kept;
    }
}

void rec_fit_residual(const void *context, int i, const double *solver, double *r, double *slope)
{
    const struct fit_model *f = context;
    const struct fit_point *p = &f->points[f->pick[i]];
    double fitted[3], value[MODEL_PARAMETERS_MAX], by_f;
    rec_fit_to_model(f, solver, value);
    if (slope && f->model->slopes) {
        f->model->slopes(value, p->wi, p->wo, fitted, slope);
        for (int k = 0; k < 3 * f->size; k++)
            if (f->logarithm[k % f->size])
                slope[k] *= value[k % f->size];
    } else {
        f->model->eval(value, p->wi, p->wo, fitted);
        if (slope)
            take_differences(f, p, solver, fitted, slope);
    }
    for (int c = 0; c < 3; c++) {
        struct fit_value v = rec_fit_value(p, c);
        r[c] = rec_fit_miss(f->cost, &v, fitted[c], &by_f);
        for (int k = 0; slope && k < f->size; k++)
            slope[c * f->size + k] *= by_f;
    }
}
