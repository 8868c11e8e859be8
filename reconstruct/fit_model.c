/* fit_model.c -- a model's residuals at fit points.
 *
 * Accuracy. Differences over a step of 1e-6 err by its square root's share of rounding, 1e-10, and
 *           by half a second derivative, 1e-6: slopes steer the descent, and no more hangs on them.
 */
#include "fit_model.h"

static const double step = 1e-6;

struct fit_model rec_fit_model(const struct model *model, const struct fit_point *points,
                               const int *pick)
{
    struct fit_model f = {.model = model, .points = points, .pick = pick};
    for (const struct parameter *p = model->parameter; p->name; p++)
        for (int c = 0; c < p->size; c++, f.size++) {
            bool wide = p->low > 0 && p->high >= 100 * p->low;
            f.logarithm[f.size] = wide;
            f.low[f.size] = wide ? log(p->low) : p->low;
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
    for (int k = 0; k < f->size; k++)
        solver[k] = f->logarithm[k] ? log(model[k]) : model[k];
}

// The model at the solver's parameters.
static void eval_at(const struct fit_model *f, const struct fit_point *p, const double *solver,
                    double fitted[3])
{
    double value[MODEL_PARAMETERS_MAX];
    rec_fit_to_model(f, solver, value);
    f->model->eval(value, p->wi, p->wo, fitted);
}

void rec_fit_residual(const void *context, int i, const double *solver, double *r, double *slope)
{
    const struct fit_model *f = context;
    const struct fit_point *p = &f->points[f->pick[i]];
    double fitted[3], moved[3], at[MODEL_PARAMETERS_MAX];
    eval_at(f, p, solver, fitted);
    for (int c = 0; c < 3; c++)
        r[c] = (p->log_f[c] - rec_fit_log(fitted[c], p->m)) / p->sigma[c];
    if (!slope)
        return;
    for (int k = 0; k < f->size; k++)
        at[k] = solver[k];
    for (int k = 0; k < f->size; k++) {
        bool room = solver[k] + step <= f->high[k];  // no step out of the physical range
        at[k] += room ? step : -step;
        eval_at(f, p, at, moved);
        for (int c = 0; c < 3; c++) {
            double by_f = -p->m / ((fitted[c] * p->m + FIT_DARK) * p->sigma[c]);
            slope[c * f->size + k] = by_f * (moved[c] - fitted[c]) / (at[k] - solver[k]);
        }
        at[k] = solver[k];
    }
}
