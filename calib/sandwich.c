/* sandwich.c -- standard deviations that stay true where errors are shared. */
#include "sandwich.h"
#include "dense.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/** The free numbers of a problem, and room to evaluate its largest term. */
struct workspace {
    int *column;  // [all numbers] of the normal matrix, -1 where held
    int *first;   // [parameters] of a parameter's numbers
    int columns, numbers;
    double *residual, *jacobian;
    int *at;            // [numbers of the largest term] columns
    const double **of;  // and where their derivatives begin
    int *stride;
};

static void workspace_free(struct workspace *w)
{
    free(w->column);
    free(w->first);
    free(w->residual);
    free(w->jacobian);
    free(w->at);
    free(w->of);
    free(w->stride);
}

static bool workspace_make(struct workspace *w, const struct ceres_problem *p)
{
    size_t residuals = 1, wide = 1, area = 1;
    for (int i = 0; i < p->parameters; i++)
        w->numbers += p->parameter[i].size;
    for (int t = 0; t < p->terms; t++) {
        size_t n = 0;
        for (int k = 0; k < p->term[t].parameters; k++)
            n += (size_t)p->parameter[p->term[t].parameter[k]].size;
        size_t rows = (size_t)p->term[t].residuals;
        residuals = rows > residuals ? rows : residuals;
        wide = n > wide ? n : wide;
        area = n * rows > area ? n * rows : area;
    }
    w->column = calloc((size_t)w->numbers + 1, sizeof *w->column);
    w->first = calloc((size_t)p->parameters + 1, sizeof *w->first);
    w->residual = calloc(residuals, sizeof *w->residual);
    w->jacobian = calloc(area, sizeof *w->jacobian);
    w->at = calloc(wide, sizeof *w->at);
    w->of = calloc(wide, sizeof *w->of);
    w->stride = calloc(wide, sizeof *w->stride);
    if (!w->column || !w->first || !w->residual || !w->jacobian || !w->at || !w->of || !w->stride)
        return false;
    for (int i = 0, n = 0; i < p->parameters; i++) {
        w->first[i] = n;
        for (int e = 0; e < p->parameter[i].size; e++, n++)
            w->column[n] = p->parameter[i].held && p->parameter[i].held[e] ? -1 : w->columns++;
    }
    return true;
}

/** Add one term to the normal matrix h [columns][columns] and to the gradient g (may be NULL). */
static void add_term(struct workspace *w, const struct ceres_problem *p, const struct ceres_term *t,
                     double *h, double *g)
{
    double *jacobian[CERES_TERM_PARAMETERS], *next = w->jacobian;
    const double *value[CERES_TERM_PARAMETERS];
    int wide = 0;
    for (int k = 0; k < t->parameters; k++) {
        const struct ceres_parameter *u = &p->parameter[t->parameter[k]];
        value[k] = u->value;
        jacobian[k] = next;
        for (int e = 0; e < u->size; e++) {
            int column = w->column[w->first[t->parameter[k]] + e];
            if (column < 0)
                continue;
            w->at[wide] = column;
            w->of[wide] = next + e;
            w->stride[wide++] = u->size;
        }
        next += (size_t)t->residuals * (size_t)u->size;
    }
    if (!t->evaluate(t->context, value, w->residual, jacobian))
        return;
    double square = 0;
    for (int r = 0; r < t->residuals; r++)
        square += w->residual[r] * w->residual[r];
    double weight = t->cauchy > 0 ? 1 / (1 + square / (t->cauchy * t->cauchy)) : 1;
    for (int a = 0; a < wide; a++)
        for (int r = 0; r < t->residuals; r++) {
            double ja = weight * w->of[a][r * w->stride[a]];
            if (ja == 0)
                continue;
            if (g)
                g[w->at[a]] += ja * w->residual[r];
            double *row = h + (size_t)w->at[a] * (size_t)w->columns;
            for (int b = 0; b < wide; b++)
                row[w->at[b]] += ja * w->of[b][r * w->stride[b]];
        }
}

/** out = inverse (sum over clusters of g g^T) inverse, corrected for few clusters; work [columns]
 *  [clusters]. */
static void meat_and_bread(double *out, const double *inverse, const double *g, int columns,
                           int clusters, double *work)
{
    const size_t n = (size_t)columns, m = (size_t)clusters;
    const double few = clusters > 1 ? clusters / (clusters - 1.0) : 1;
    for (size_t a = 0; a < n; a++)
        for (size_t k = 0; k < m; k++) {
            double step = 0;
            for (size_t b = 0; b < n; b++)
                step += inverse[a * n + b] * g[k * n + b];
            work[a * m + k] = step;
        }
    for (size_t a = 0; a < n; a++)
        for (size_t b = 0; b <= a; b++) {
            double sum = 0;
            for (size_t k = 0; k < m; k++)
                sum += work[a * m + k] * work[b * m + k];
            out[a * n + b] = out[b * n + a] = few * sum;
        }
}

/** Where the formal variance of a number is the larger one, scale its row and column to it. */
static void never_below(double *covariance, const double *formal, int columns)
{
    const size_t n = (size_t)columns;
    for (size_t a = 0; a < n; a++) {
        double have = covariance[a * n + a], least = formal[a * n + a];
        if (have >= least)
            continue;
        double scale = have > 0 ? sqrt(least / have) : 0;
        for (size_t b = 0; b < n; b++) {
            covariance[a * n + b] *= scale;
            covariance[b * n + a] *= scale;
        }
        covariance[a * n + a] = least;
    }
}

/** Gradients by the clusters of each way, [clusters][columns]: one after another in room, which the
 *  caller frees. */
struct ways {
    const int *cluster[3];
    int clusters[3];
    double *g[3], *room;
};

static bool ways_make(struct ways *w, int columns)
{
    size_t all = 0;
    for (int k = 0; k < 3; k++)
        all += (size_t)w->clusters[k] * (size_t)columns;
    w->room = calloc(all + 1, sizeof *w->room);
    double *next = w->room;
    for (int k = 0; k < 3 && next; k++) {
        w->g[k] = next;
        next += (size_t)w->clusters[k] * (size_t)columns;
    }
    return w->room;
}

/** The normal matrix, and all gradients; one [columns] is scratch. */
static void ways_add(struct ways *ways, struct workspace *w, const struct ceres_problem *p,
                     double *h, double *one)
{
    for (int t = 0; t < p->terms; t++) {
        memset(one, 0, (size_t)w->columns * sizeof *one);
        add_term(w, p, &p->term[t], h, one);
        for (int k = 0; k < 3; k++) {
            if (!ways->cluster[k] || ways->cluster[k][t] < 0)
                continue;
            double *g = ways->g[k] + (size_t)w->columns * (size_t)ways->cluster[k][t];
            for (int a = 0; a < w->columns; a++)
                g[a] += one[a];
        }
    }
}

/** out += or -= the sandwich of one way; work [columns][columns] and [columns][clusters]. */
static void add_way(double *out, double sign, const double *inverse, const struct ways *ways, int k,
                    int columns, double *work[2])
{
    meat_and_bread(work[0], inverse, ways->g[k], columns, ways->clusters[k], work[1]);
    for (size_t i = 0; i < (size_t)columns * (size_t)columns; i++)
        out[i] += sign * work[0][i];
}

/** From clusters by one way, or (clusters[1] > 0) by two and by both. */
static enum status covariance_of(double *covariance, const struct ceres_problem *p,
                                 struct ways *ways, struct error *err)
{
    struct workspace w = {0};
    double *h = NULL, *inverse = NULL, *first = NULL, *one = NULL, *work[2] = {NULL, NULL};
    enum status status = STATUS_OK;
    bool room = workspace_make(&w, p) && ways_make(ways, w.columns);
    const size_t n = (size_t)w.columns, all = (size_t)w.numbers;
    int most = ways->clusters[0];
    for (int k = 1; k < 3; k++)
        most = ways->clusters[k] > most ? ways->clusters[k] : most;
    if (room) {
        h = calloc(n * n + 1, sizeof *h);
        inverse = calloc(n * n + 1, sizeof *inverse);
        first = calloc(n * n + 1, sizeof *first);
        one = calloc(n + 1, sizeof *one);
        work[0] = calloc(n * n + 1, sizeof *work[0]);
        work[1] = calloc(n * (size_t)most + 1, sizeof *work[1]);
    }
    if (!h || !inverse || !first || !one || !work[0] || !work[1]) {
        status = cap_fail(err, STATUS_MEMORY, "the covariance of %d numbers", w.numbers);
        goto done;
    }
    ways_add(ways, &w, p, h, one);
    if (!dense_cholesky(w.columns, h)) {
        status = cap_fail(err, STATUS_DATA, "the measurements leave unknowns undetermined");
        goto done;
    }
    dense_inverse(w.columns, h, inverse);
    meat_and_bread(first, inverse, ways->g[0], w.columns, ways->clusters[0], work[1]);
    memcpy(h, first, n * n * sizeof *h);
    if (ways->clusters[1] > 0) {
        add_way(h, 1, inverse, ways, 1, w.columns, work);
        add_way(h, -1, inverse, ways, 2, w.columns, work);
        never_below(h, first, w.columns);
    }
    never_below(h, inverse, w.columns);
    for (size_t i = 0; i < all; i++)
        for (size_t j = 0; j < all; j++)
            covariance[i * all + j] = w.column[i] < 0 || w.column[j] < 0
                                          ? 0
                                          : h[(size_t)w.column[i] * n + (size_t)w.column[j]];
done:
    workspace_free(&w);
    free(ways->room);
    free(h);
    free(inverse);
    free(first);
    free(one);
    free(work[0]);
    free(work[1]);
    return status;
}

enum status cal_sandwich_covariance(double *covariance, const struct ceres_problem *p,
                                    const int *cluster, int clusters, struct error *err)
{
    struct ways ways = {.cluster = {cluster}, .clusters = {clusters}};
    return covariance_of(covariance, p, &ways, err);
}

enum status cal_sandwich_two_ways(double *covariance, const struct ceres_problem *p,
                                  const int *cluster, int clusters, const int *other, int others,
                                  struct error *err)
{
    int *both = calloc((size_t)p->terms + 1, sizeof *both);
    if (!both)
        return cap_fail(err, STATUS_MEMORY, "%d terms", p->terms);
    int *at = calloc((size_t)clusters * (size_t)others + 1, sizeof *at), count = 0;
    for (int t = 0; t < p->terms && at; t++) {
        both[t] = -1;
        if (cluster[t] < 0 || other[t] < 0)
            continue;
        int *found = &at[(size_t)cluster[t] * (size_t)others + (size_t)other[t]];
        if (*found == 0)
            *found = ++count;
        both[t] = *found - 1;
    }
    struct ways ways = {.cluster = {cluster, other, both}, .clusters = {clusters, others, count}};
    enum status status = at ? covariance_of(covariance, p, &ways, err)
                            : cap_fail(err, STATUS_MEMORY, "%d clusters", clusters * others);
    free(at);
    free(both);
    return status;
}

enum status cal_sandwich(double *sigma, const struct ceres_problem *p, const int *cluster,
                         int clusters, struct error *err)
{
    size_t n = 0;
    for (int i = 0; i < p->parameters; i++)
        n += (size_t)p->parameter[i].size;
    double *covariance = calloc(n * n + 1, sizeof *covariance);
    enum status status = covariance
                             ? cal_sandwich_covariance(covariance, p, cluster, clusters, err)
                             : cap_fail(err, STATUS_MEMORY, "the covariance of %zu numbers", n);
    for (size_t i = 0; i < n && !status; i++)
        sigma[i] = sqrt(covariance[i * n + i]);
    free(covariance);
    return status;
}
