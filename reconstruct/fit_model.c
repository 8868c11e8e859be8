/* fit_model.c -- a model's residuals at fit points.
 *
 * Method.   A logarithm of noisy values is low by half their relative variance, and sigmas that are
 *           relative to noisy values favour the bright ones by twice as much. So once a fit is
 * near, the statistical residual is (f - f') over sigma of f, in which what models are allowed is
 * relative to the near fit: nothing in it but f is noisy. Where f' m is well above e, and f' near
 * f, that is the logarithm's residual. Accuracy. Differences over a step of 1e-6 err by its square
 * root's share of rounding, 1e-10, and by half a second derivative, 1e-6: slopes steer the descent,
 * and no more hangs on them.
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

void rec_fit_confine(const struct model *kind, double *value)
{
    for (const struct parameter *p = kind->parameter; p->name; p++)
        for (int c = 0; c < p->size; c++, value++)
            *value = fmin(p->high, fmax(p->low, *value));
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
    return cost == FIT_CUBE_ROOT ? 0 : cost == FIT_PICTURE ? -1 : FIT_BEND;
}

double rec_fit_loss(enum fit_cost cost, double r2)
{
    if (cost == FIT_CUBE_ROOT)
        return cbrt(r2 + CUBE_ROOT_EVEN * CUBE_ROOT_EVEN);
    return cost == FIT_PICTURE ? r2 : log1p(r2 / (FIT_BEND * FIT_BEND));
}

double rec_fit_cost(enum fit_cost cost, const double *r)
{
    double r2 = 0;
    for (int k = 0; k < 3 * rec_fit_residuals(cost); k++)
        r2 += r[k] * r[k];
    return rec_fit_loss(cost, r2);
}

int rec_fit_residuals(enum fit_cost cost)
{
    return cost == FIT_PICTURE ? 2 : 1;
}

struct fit_value rec_fit_value(const struct fit_model *f, int point, int channel)
{
    const struct fit_point *p = &f->points[point];
    struct fit_value v = {
        .f = p->f[channel],
        .log_f = p->log_f[channel],
        .sigma = p->sigma[channel],
        .m = p->m,
        .cosine = fmax(p->wi.z, p->wo.z),
        .shown = p->shown,
    };
    if (f->near) {
        double allowed = FIT_MODEL_ERROR * (f->near[point][channel] + FIT_DARK / p->m);
        v.per_sigma = 1 / hypot(p->error[channel], allowed);
    }
    return v;
}

void rec_fit_come_near(const struct fit_model *f, int count, const double *solver)
{
    double value[MODEL_PARAMETERS_MAX];
    rec_fit_to_model(f, solver, value);
    for (int i = 0; i < count; i++)
        f->model->eval(value, f->points[i].wi, f->points[i].wo, f->near[i]);
}

// As a display shows a value: up to 1 as it is. Beyond, a share of all pictures are under dimmer
// lamps, of every strength, and under windows and skies, which a lamp's highlight stands for.
static double displayed(double x, double *by_x)
{
    const double beyond = 0.3;
    *by_x = x < 1 ? 1 : beyond / x;
    return x < 1 ? x : 1 + beyond * log(x);
}

// The logarithm's miss with Cauchy's bend within, so that no picture's dark parts are free; and the
// picture's, in units of what is seen as a difference: 46 dB.
static void miss_picture(const struct fit_value *v, double fitted, double r[2], double by_f[2])
{
    const double log_part = 0.6, picture_sigma = 0.005;
    double by_log, plain, own, by_x, bright = CAP_PI * v->cosine;
    rec_fit_miss(FIT_LOG, v, fitted, &plain, &by_log);
    double bent2 = log1p(plain * plain / (FIT_BEND * FIT_BEND));
    r[0] = log_part * FIT_BEND * copysign(sqrt(bent2), plain);
    by_f[0] = log_part * by_log;
    if (fabs(plain) > 1e-6)
        by_f[0] *= log_part * plain / (r[0] * (1 + plain * plain / (FIT_BEND * FIT_BEND)));
    double weight = v->shown / picture_sigma;
    r[1] = weight * (displayed(bright * v->f, &own) - displayed(bright * fitted, &by_x));
    by_f[1] = -weight * bright * by_x;
}

void rec_fit_miss(enum fit_cost cost, const struct fit_value *v, double fitted, double *r,
                  double *by_f)
{
    if (cost == FIT_PICTURE) {
        miss_picture(v, fitted, r, by_f);
    } else if (cost == FIT_CUBE_ROOT) {
        *by_f = -v->m;
        *r = (v->f - fitted) * v->m;
    } else if (cost == FIT_STATISTICAL && v->per_sigma > 0) {
        *by_f = -v->per_sigma;
        *r = (v->f - fitted) * v->per_sigma;
    } else {
        double sigma = cost == FIT_LOG ? FIT_LOG_SIGMA : v->sigma;
        *by_f = -v->m / ((fitted * v->m + FIT_DARK) * sigma);
        *r = (v->log_f - rec_fit_log(fitted, v->m)) / sigma;
    }
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
    double fitted[3], value[MODEL_PARAMETERS_MAX];
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
    const int each = rec_fit_residuals(f->cost), size = f->size;
    for (int c = 2; c >= 0; c--) {  // from the last: rows of slope move apart
        struct fit_value v = rec_fit_value(f, f->pick[i], c);
        double by_f[2] = {0, 0};
        rec_fit_miss(f->cost, &v, fitted[c], &r[c * each], by_f);
        for (int k = 0; slope && k < size; k++) {
            double by_parameter = slope[c * size + k];
            for (int j = each - 1; j >= 0; j--)
                slope[(c * each + j) * size + k] = by_f[j] * by_parameter;
        }
    }
}
