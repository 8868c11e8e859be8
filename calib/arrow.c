/* arrow.c -- covariances of many unknowns that meet only through a few.
 *
 * Method.   With the eliminated parameters e (poses: each meets the others only through the rest,
 *           cameras and places) the normal matrix is an arrow. Its inverse, block by block:
 *
 *               S = R - sum_e W_e^T V_e^-1 W_e              cov(rest) = S^-1
 *               cov(e) = V_e^-1 + (V_e^-1 W_e) S^-1 (V_e^-1 W_e)^T
 *
 *           V_e, W_e and R: the normal matrix of e itself, of e with the rest, and of the rest.
 *           Time and memory grow with the number of e, not with its cube and square.
 * Accuracy. All numbers are scaled to a unit diagonal first; what is left of a pivot of S below
 *           1e-13 counts as nothing: then an unknown is not determined.
 */
#include "arrow.h"

#include "dense.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

static const double PIVOT_MIN = 1e-13;

/** The normal matrix. A parameter's free numbers stand together, held ones have no column. */
struct arrow {
    int *column;    // [numbers] within the rest, or within the parameter that is eliminated; -1
    int *first;     // [parameters] into column
    int *free;      // [parameters] how many numbers are not held
    size_t *v_at;   // [parameters] of an eliminated one: where its matrix begins in v
    size_t *w_at;   // and in w
    double *v, *w;  // [free][free], [free][rest] for each that is eliminated
    double *r;      // [rest][rest]
    double *scale;  // [numbers] 1 / sqrt of the diagonal
    double *residual, *jacobian;
    int rest;
};

static void arrow_free(struct arrow *a)
{
    free(a->column);
    free(a->first);
    free(a->free);
    free(a->v_at);
    free(a->w_at);
    free(a->v);
    free(a->w);
    free(a->r);
    free(a->scale);
    free(a->residual);
    free(a->jacobian);
}

/** Number the unknowns, and how much room they need: *v and *w. */
static void number_unknowns(struct arrow *a, const struct ceres_problem *p, size_t *v, size_t *w)
{
    int numbers = 0;
    for (int i = 0; i < p->parameters; i++) {
        const struct ceres_parameter *u = &p->parameter[i];
        a->first[i] = numbers;
        for (int e = 0; e < u->size; e++) {
            bool held = u->held && u->held[e];
            a->column[numbers + e] = held ? -1 : u->eliminate ? a->free[i] : a->rest;
            a->free[i] += !held;
            a->rest += !held && !u->eliminate;
        }
        numbers += u->size;
    }
    *v = *w = 0;
    for (int i = 0; i < p->parameters; i++)
        if (p->parameter[i].eliminate) {
            a->v_at[i] = *v;
            a->w_at[i] = *w;
            *v += (size_t)a->free[i] * (size_t)a->free[i];
            *w += (size_t)a->free[i] * (size_t)a->rest;
        }
}

static bool arrow_make(struct arrow *a, const struct ceres_problem *p)
{
    size_t numbers = 1, residuals = 1, area = 1, v, w, n = (size_t)p->parameters + 1;
    for (int i = 0; i < p->parameters; i++)
        numbers += (size_t)p->parameter[i].size;
    for (int t = 0; t < p->terms; t++) {
        size_t wide = 0, rows = (size_t)p->term[t].residuals;
        for (int k = 0; k < p->term[t].parameters; k++)
            wide += (size_t)p->parameter[p->term[t].parameter[k]].size;
        residuals = rows > residuals ? rows : residuals;
        area = rows * wide > area ? rows * wide : area;
    }
    *a = (struct arrow){.column = calloc(numbers, sizeof *a->column),
                        .first = calloc(n, sizeof *a->first),
                        .free = calloc(n, sizeof *a->free),
                        .v_at = calloc(n, sizeof *a->v_at),
                        .w_at = calloc(n, sizeof *a->w_at),
                        .scale = calloc(numbers, sizeof *a->scale),
                        .residual = calloc(residuals, sizeof *a->residual),
                        .jacobian = calloc(area, sizeof *a->jacobian)};
    if (!a->column || !a->first || !a->free || !a->v_at || !a->w_at || !a->scale || !a->residual
        || !a->jacobian)
        return false;
    number_unknowns(a, p, &v, &w);
    a->v = calloc(v + 1, sizeof *a->v);
    a->w = calloc(w + 1, sizeof *a->w);
    a->r = calloc((size_t)a->rest * (size_t)a->rest + 1, sizeof *a->r);
    return a->v && a->w && a->r;
}

/** Where the normal matrix of parameters i and j is kept, and how long its rows are: NULL, nowhere
 *  (it is the transpose of another, or 0). */
static double *block_of(struct arrow *a, const struct ceres_problem *p, int i, int j, int *stride)
{
    bool one = p->parameter[i].eliminate, two = p->parameter[j].eliminate;
    assert(!one || !two || i == j);
    *stride = one && two ? a->free[i] : a->rest;
    return one && two ? a->v + a->v_at[i] : one ? a->w + a->w_at[i] : two ? NULL : a->r;
}

/** Add J_i^T J_j of a term, both [residuals][size]. */
static void add_block(struct arrow *a, const struct ceres_problem *p, int i, int j,
                      const double *by_i, const double *by_j, int residuals, double weight)
{
    int stride, wide_i = p->parameter[i].size, wide_j = p->parameter[j].size;
    double *to = block_of(a, p, i, j, &stride);
    for (int m = 0; to && m < wide_i; m++)
        for (int n = 0; n < wide_j; n++) {
            int row = a->column[a->first[i] + m], column = a->column[a->first[j] + n];
            double sum = 0;
            if (row < 0 || column < 0)
                continue;
            for (int k = 0; k < residuals; k++)
                sum += by_i[k * wide_i + m] * by_j[k * wide_j + n];
            to[row * stride + column] += weight * sum;
        }
}

static void add_term(struct arrow *a, const struct ceres_problem *p, const struct ceres_term *t)
{
    double *jacobian[CERES_TERM_PARAMETERS], *next = a->jacobian, square = 0;
    const double *value[CERES_TERM_PARAMETERS];
    for (int k = 0; k < t->parameters; k++) {
        value[k] = p->parameter[t->parameter[k]].value;
        jacobian[k] = next;
        next += (size_t)t->residuals * (size_t)p->parameter[t->parameter[k]].size;
    }
    if (!t->evaluate(t->context, value, a->residual, jacobian))
        return;
    for (int k = 0; k < t->residuals; k++)
        square += a->residual[k] * a->residual[k];
    double weight = t->cauchy > 0 ? 1 / (1 + square / (t->cauchy * t->cauchy)) : 1;
    for (int i = 0; i < t->parameters; i++)
        for (int j = 0; j < t->parameters; j++)
            add_block(a, p, t->parameter[i], t->parameter[j], jacobian[i], jacobian[j],
                      t->residuals, weight);
}

/** Scale everything to a unit diagonal. false: some number has none. */
static bool scale_all(struct arrow *a, const struct ceres_problem *p)
{
    for (int i = 0; i < p->parameters; i++) {
        int stride;
        const double *own = block_of(a, p, i, i, &stride);
        for (int e = 0; e < p->parameter[i].size; e++) {
            int column = a->column[a->first[i] + e];
            double diagonal = column < 0 ? 1 : own[column * stride + column];
            if (!(diagonal > 0))
                return false;
            a->scale[a->first[i] + e] = 1 / sqrt(diagonal);
        }
    }
    for (int i = 0; i < p->parameters; i++)
        for (int j = 0; j < p->parameters; j++) {
            int stride;
            double *block;
            if (p->parameter[j].eliminate && i != j)
                continue;
            block = block_of(a, p, i, j, &stride);
            for (int m = 0; block && m < p->parameter[i].size; m++)
                for (int n = 0; n < p->parameter[j].size; n++) {
                    int row = a->column[a->first[i] + m], column = a->column[a->first[j] + n];
                    if (row >= 0 && column >= 0)
                        block[row * stride + column] *=
                            a->scale[a->first[i] + m] * a->scale[a->first[j] + n];
                }
        }
    return true;
}

/** Cholesky of a matrix of unit diagonal; false: an unknown is not determined. */
static bool determined(int n, double *matrix)
{
    bool good = dense_cholesky(n, matrix);
    for (int i = 0; i < n && good; i++)
        good = matrix[i * n + i] * matrix[i * n + i] > PIVOT_MIN;
    return good;
}

/** V_e becomes its inverse, W_e becomes V_e^-1 W_e, and their part leaves R. false: undetermined;
 *  work [free][rest + free]. */
static bool eliminate(struct arrow *a, int e, double *work)
{
    const int n = a->free[e], rest = a->rest;
    double *v = a->v + a->v_at[e], *w = a->w + a->w_at[e], *was = work + n * n;
    if (!determined(n, v))
        return false;
    dense_inverse(n, v, work);
    memcpy(v, work, (size_t)(n * n) * sizeof *v);
    memcpy(was, w, (size_t)n * (size_t)rest * sizeof *w);
    for (int i = 0; i < n; i++)
        for (int c = 0; c < rest; c++) {
            double sum = 0;
            for (int k = 0; k < n; k++)
                sum += v[i * n + k] * was[k * rest + c];
            w[i * rest + c] = sum;
        }
    for (int c = 0; c < rest; c++)
        for (int k = 0; k < n; k++)
            for (int d = 0; was[k * rest + c] != 0 && d < rest; d++)
                a->r[c * rest + d] -= was[k * rest + c] * w[k * rest + d];
    return true;
}

/** V_e^-1 + W_e inverse W_e^T, of numbers i and j of e. */
static double of_eliminated(const struct arrow *a, int e, const double *inverse, int i, int j)
{
    const int rest = a->rest;
    const double *w = a->w + a->w_at[e];
    double sum = a->v[a->v_at[e] + (size_t)(i * a->free[e] + j)];
    for (int c = 0; c < rest; c++) {
        double along = 0;
        for (int d = 0; w[i * rest + c] != 0 && d < rest; d++)
            along += inverse[c * rest + d] * w[j * rest + d];
        sum += w[i * rest + c] * along;
    }
    return sum;
}

static void give(const struct arrow *a, const struct ceres_problem *p, const double *inverse)
{
    for (int i = 0; i < p->parameters; i++) {
        const struct ceres_parameter *u = &p->parameter[i];
        for (int m = 0; u->covariance && m < u->size; m++)
            for (int n = 0; n < u->size; n++) {
                int row = a->column[a->first[i] + m], column = a->column[a->first[i] + n];
                double *to = &u->covariance[m * u->size + n];
                *to = 0;
                if (row < 0 || column < 0)
                    continue;
                *to = u->eliminate ? of_eliminated(a, i, inverse, row, column)
                                   : inverse[row * a->rest + column];
                *to *= a->scale[a->first[i] + m] * a->scale[a->first[i] + n];
            }
    }
}

enum status arrow_covariance(const struct ceres_problem *p, struct error *err)
{
    struct arrow a;
    bool room = arrow_make(&a, p), good = true;
    int most = 0;
    for (int i = 0; i < p->parameters && room; i++)
        most = p->parameter[i].eliminate && a.free[i] > most ? a.free[i] : most;
    double *work = room ? calloc((size_t)most * (size_t)(most + a.rest) + 1, sizeof *work) : NULL;
    double *inverse = room ? calloc((size_t)a.rest * (size_t)a.rest + 1, sizeof *inverse) : NULL;
    enum status status = STATUS_OK;
    if (!work || !inverse)
        status = cap_fail(err, STATUS_MEMORY, "the covariance of %d unknowns", p->parameters);
    for (int t = 0; t < p->terms && !status; t++)
        add_term(&a, p, &p->term[t]);
    if (!status) {
        good = scale_all(&a, p);
        for (int i = 0; i < p->parameters && good; i++)
            good = !p->parameter[i].eliminate || eliminate(&a, i, work);
        good = good && determined(a.rest, a.r);
    }
    if (!good) {
        status = cap_fail(err, STATUS_DATA, "the measurements leave unknowns undetermined");
    } else if (!status) {
        dense_inverse(a.rest, a.r, inverse);
        give(&a, p, inverse);
    }
    free(work);
    free(inverse);
    arrow_free(&a);
    return status;
}
