/* fit_errors.c -- how far a fit's parameters are known.
 *
 * Method.   Linear propagation at the solution. Noise: the inverse of the normal matrix N = J'J,
 *           enlarged by the residuals' spread where the model misses by more than the sigmas say,
 *           and by what the bent loss gives away.
 *           The calibration's errors move all bins at once, by p (their share of every sigma) or
 *           by a turn of the normal, and the parameters by inv(N) J'p: the two are added squared.
 *           A parameter is known to within its range to begin with, which keeps N regular.
 */
#include "fit_model.h"

enum { MAX = MODEL_PARAMETERS_MAX };

// Huber's asymptotic variance of Cauchy's loss over three Gaussian residuals, FIT_BEND sigmas wide:
// E[|r|^2 w^2]/3 / E[w - 2 |r|^2 w^2/27]^2, w = 1/(1 + |r|^2/9). P. Huber, Robust Statistics, 1981.
static const double inefficiency = 1.0394;

// The sums over all points that the propagation needs.
struct normal {
    double n[MAX][MAX];     // J'J
    double shared[2][MAX];  // J'p for the light and the tilt
    double r2;              // mean square of the residuals, outliers bent
    int size;
};

// d (log_f) / d theta_h of the model, by turning the normal in the plane of h.
static void slope_by_tilt(const struct fit_model *f, const struct fit_point *p,
                          const double *solver, double by_tilt[3])
{
    const double step = 1e-4;
    double value[MAX], fitted[2][3];
    half_diff at = rec_half_diff(p->wi, p->wo);
    rec_fit_to_model(f, solver, value);
    for (int s = 0; s < 2; s++) {
        half_diff moved = at;
        vec3 wi, wo;
        moved.theta_h = fmax(0, at.theta_h + (s ? step : -step));
        rec_directions(moved, &wi, &wo);
        if (wi.z <= 0 || wo.z <= 0) {
            wi = p->wi;
            wo = p->wo;
        }
        f->model->eval(value, wi, wo, fitted[s]);
    }
    for (int c = 0; c < 3; c++)
        by_tilt[c] =
            (rec_fit_log(fitted[1][c], p->m) - rec_fit_log(fitted[0][c], p->m)) / (2 * step);
}

static void add_point(struct normal *sum, const struct fit_model *f, int i, const double *solver)
{
    const struct fit_point *p = &f->points[f->pick[i]];
    double r[3], slope[3 * MAX], by_tilt[3];
    rec_fit_residual(f, i, solver, r, slope);
    slope_by_tilt(f, p, solver, by_tilt);
    for (int c = 0; c < 3; c++) {
        const double *j = &slope[c * f->size];
        double shift[2] = {p->systematic[c] / p->sigma[c], by_tilt[c] * p->tilt / p->sigma[c]};
        sum->r2 += fmin(r[c] * r[c], 9);
        for (int a = 0; a < f->size; a++) {
            for (int b = 0; b < f->size; b++)
                sum->n[a][b] += j[a] * j[b];
            for (int s = 0; s < 2; s++)
                sum->shared[s][a] += j[a] * shift[s];
        }
    }
}

// Cholesky's factor of a positive matrix, in its lower triangle.
static void factor(double n[MAX][MAX], int size)
{
    for (int j = 0; j < size; j++) {
        for (int i = j; i < size; i++) {
            double s = n[i][j];
            for (int k = 0; k < j; k++)
                s -= n[i][k] * n[j][k];
            n[i][j] = i == j ? sqrt(fmax(s, 1e-300)) : s / n[j][j];
        }
    }
}

static void solve(double l[MAX][MAX], int size, double *x)
{
    for (int i = 0; i < size; i++) {
        for (int k = 0; k < i; k++)
            x[i] -= l[i][k] * x[k];
        x[i] /= l[i][i];
    }
    for (int i = size - 1; i >= 0; i--) {
        for (int k = i + 1; k < size; k++)
            x[i] -= l[k][i] * x[k];
        x[i] /= l[i][i];
    }
}

void rec_fit_covariance(const struct fit_model *f, int picked, const double *solver,
                        double *covariance)
{
    struct fit_model errors = *f;
    errors.cost = FIT_STATISTICAL;  // whatever the fit made small: errors are in sigmas
    struct normal sum = {.size = f->size};
    double by_solver[MAX];
    for (int i = 0; i < picked; i++)
        add_point(&sum, &errors, i, solver);
    double spread = inefficiency * fmax(1, sum.r2 / (3.0 * picked));
    for (int k = 0; k < f->size; k++) {
        sum.n[k][k] += 1 / ((f->high[k] - f->low[k]) * (f->high[k] - f->low[k]));
        by_solver[k] = f->logarithm[k] ? exp(solver[k]) : 1;
    }
    factor(sum.n, f->size);
    solve(sum.n, f->size, sum.shared[0]);
    solve(sum.n, f->size, sum.shared[1]);
    for (int k = 0; k < f->size; k++) {
        double column[MAX] = {0};
        column[k] = 1;
        solve(sum.n, f->size, column);
        for (int j = 0; j < f->size; j++)
            covariance[k * f->size + j] =
                by_solver[k] * by_solver[j]
                * (spread * column[j] + sum.shared[0][k] * sum.shared[0][j]
                   + sum.shared[1][k] * sum.shared[1][j]);
    }
}
