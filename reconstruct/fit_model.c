/* fit_model.c -- a model's residuals at fit points.
 *
 * Accuracy. Central differences over 2e-5 of a parameter near 1: slopes good to 1e-9 or so.
 */
#include "fit_model.h"

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

static void residual_at(const struct fit_model *f, const struct fit_point *p, const double *solver,
                        double *r)
{
    double value[MODEL_PARAMETERS_MAX], fitted[3];
    rec_fit_to_model(f, solver, value);
    f->model->eval(value, p->wi, p->wo, fitted);
    for (int c = 0; c < 3; c++)
        r[c] = (p->log_f[c] - rec_fit_log(fitted[c], p->m)) / p->sigma[c];
}

void rec_fit_residual(const void *context, int i, const double *solver, double *r, double *slope)
{
    const struct fit_model *f = context;
    const struct fit_point *p = &f->points[f->pick[i]];
    residual_at(f, p, solver, r);
    if (!slope)
        return;
    double at[MODEL_PARAMETERS_MAX], up[3], down[3];
    for (int k = 0; k < f->size; k++)
        at[k] = solver[k];
    for (int k = 0; k < f->size; k++) {
        double above = fmin(solver[k] + 1e-5, f->high[k]);
        double below = fmax(solver[k] - 1e-5, f->low[k]);  // no step out of the physical range
        at[k] = above;
        residual_at(f, p, at, up);
        at[k] = below;
        residual_at(f, p, at, down);
        at[k] = solver[k];
        for (int c = 0; c < 3; c++)
            slope[c * f->size + k] = (up[c] - down[c]) / (above - below);
    }
}
