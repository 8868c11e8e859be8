/* fit_starts.c -- where fits begin: a search over the whole range of every shape.
 *
 * Method.   f is linear in most colours (albedo, f0, ...) once the shapes (alpha, ior, ...) are
 *           given: for each place of a grid of shapes, a small least-squares problem in each
 * channel gives the colours, weighted so that it resembles the logarithmic cost, and the cost there
 * tells the places apart. One of the widths is what the data's own highlight has.
 */
#include "fit_starts.h"

#include <string.h>

enum { VALUES = 8, COLOURS = FIT_UNKNOWNS, SHAPES = 8 };

// ---- the grid

struct axis {
    const char *name;
    double value[VALUES];  // ends with 0
};

static const struct axis grid[] = {
    {"alpha", {0.02, 0.05, 0.12, 0.25, 0.5}},
    {"alpha_2", {0.1, 0.25, 0.5, 0.9}},
    {"edge", {0.1, 1}},
    {"edge_2", {0.1, 1}},
    {"ior", {1.3, 1.5, 2.3}},
    {"gamma", {1.2, 2, 3.5}},
    {"sigma", {0.1, 0.6}},
    {"n", {3, 15, 80, 500, 4000}},
    {"ke", {3, 15, 80, 500, 4000}},
    {"rs", {0.04, 0.5}},
    {"B", {50, 1e3, 2e4, 3e5}},
    {"C", {0.7, 1.2, 2}},
    {"eta", {0.2, 1.2, 3}},
    {"k", {1, 3, 8}},
    {"roughness", {0.15, 0.3, 0.5, 0.8}},
    {"metallic", {0.05, 0.95}},
    {"specular", {0.1, 0.5}},
};

// What has no row there starts low, or at 1/2.
static double unsearched(const struct parameter *p)
{
    bool extra = strncmp(p->name, "sheen", 5) == 0 || strcmp(p->name, "clearcoat") == 0
                 || strcmp(p->name, "subsurface") == 0 || strcmp(p->name, "specular_tint") == 0;
    return extra ? 0.02 : 0.5 * (p->low + fmin(p->high, 2));
}

static const struct axis *axis_of(const char *name)
{
    for (size_t i = 0; i < sizeof grid / sizeof *grid; i++)
        if (strcmp(grid[i].name, name) == 0)
            return &grid[i];
    return NULL;
}

// f is linear in it, the rest given.
static bool linear(const struct parameter *p)
{
    static const char *const names[] = {"albedo", "f0", "f0_2", "kd",   "ks",
                                        "kD",     "A",  "rd",   "base", NULL};
    for (int i = 0; names[i]; i++)
        if (p->size == 3 && strcmp(p->name, names[i]) == 0)
            return true;
    return false;
}

// ---- the data's highlight

// GGX's D falls to half where tan theta_h = 0.644 alpha: the width at which f, less its lowest
// values, has fallen so far from what it is at the smallest theta_h.
static double own_width(const struct fit_model *f, int picked)
{
    enum { RINGS = 30 };
    double sum[RINGS] = {0}, least = INFINITY;
    int count[RINGS] = {0};
    for (int i = 0; i < picked; i++) {
        const struct fit_point *p = &f->points[f->pick[i]];
        half_diff a = rec_half_diff(p->wi, p->wo);
        int ring = (int)fmin(RINGS - 1, RINGS * sqrt(a.theta_h / (CAP_PI / 2)));
        if (a.theta_d > 1)
            continue;
        sum[ring] += p->f[0] + p->f[1] + p->f[2];
        count[ring]++;
    }
    int first = 0;
    while (first < RINGS - 1 && !count[first])
        first++;
    for (int r = first; r < RINGS; r++) {
        sum[r] = count[r] ? sum[r] / count[r] : sum[r > 0 ? r - 1 : 0];
        least = fmin(least, sum[r]);
    }
    int half = first;
    while (half < RINGS - 1 && sum[half] - least > 0.5 * (sum[first] - least))
        half++;
    double root = (half + 0.5) / RINGS;
    return fmin(0.9, fmax(2e-3, tan(fmin(1.2, root * root * CAP_PI / 2)) / 0.644));
}

// ---- colours

// What comes out negative is 0, and the others are found again.
void rec_fit_nonnegative(double n[FIT_UNKNOWNS][FIT_UNKNOWNS], const double b[FIT_UNKNOWNS],
                         int count, double *x)
{
    bool used[COLOURS] = {true, true, true};
    for (int round = 0; round < count; round++) {
        double a[COLOURS][COLOURS + 1];
        for (int i = 0; i < count; i++) {
            for (int j = 0; j < count; j++)
                a[i][j] = used[i] && used[j] ? n[i][j] : i == j;
            a[i][count] = used[i] ? b[i] : 0;
        }
        for (int i = 0; i < count; i++) {  // positive: no pivots are wanted
            bool alike = a[i][i] <= 1e-9 * n[i][i];
            for (int j = 0; j < count; j++)
                for (int k = count; j != i && k >= i; k--)
                    a[j][k] -= alike ? 0 : a[j][i] / a[i][i] * a[i][k];
            if (alike)
                a[i][i] = INFINITY;  // what the others say already: its share is 0
        }
        int worst = -1;
        for (int i = 0; i < count; i++) {
            x[i] = used[i] ? a[i][count] / a[i][i] : 0;
            if (x[i] < 0 && (worst < 0 || x[i] < x[worst]))
                worst = i;
        }
        if (worst < 0)
            return;
        used[worst] = false;
        x[worst] = 0;
    }
    for (int i = 0; i < count; i++)
        x[i] = fmax(0, x[i]);
}

// Put the best colours into `value`, whose shapes are given: first[j] are the colours' places.
static void find_colours(const struct fit_model *f, int picked, double *value, const int *first,
                         int colours)
{
    double n[3][COLOURS][COLOURS] = {0}, b[3][COLOURS] = {0};
    for (int j = 0; j < colours; j++)
        for (int c = 0; c < 3; c++)
            value[first[j] + c] = 0;
    for (int i = 0; i < picked; i++) {
        const struct fit_point *p = &f->points[f->pick[i]];
        double base[3], unit[COLOURS][3];
        f->model->eval(value, p->wi, p->wo, base);
        for (int j = 0; j < colours; j++) {
            for (int c = 0; c < 3; c++)
                value[first[j] + c] = 1;
            f->model->eval(value, p->wi, p->wo, unit[j]);
            for (int c = 0; c < 3; c++)
                value[first[j] + c] = 0;
        }
        for (int c = 0; c < 3; c++) {
            double w = p->m / (fmax(0, p->f[c]) * p->m + FIT_DARK), w2 = w * w;
            for (int j = 0; j < colours; j++) {
                double x = unit[j][c] - base[c];
                for (int k = 0; k < colours; k++)
                    n[c][j][k] += w2 * x * (unit[k][c] - base[c]);
                b[c][j] += w2 * x * (p->f[c] - base[c]);
            }
        }
    }
    for (int c = 0; c < 3 && colours; c++) {
        double x[COLOURS];
        rec_fit_nonnegative(n[c], b[c], colours, x);
        for (int j = 0; j < colours; j++)
            value[first[j] + c] = x[j];
    }
}

// ---- the search

// What is searched, and the best so far.
struct search {
    const struct fit_model *f;
    int picked, most, found;
    const struct parameter *shape[SHAPES];
    int at[SHAPES], shapes, colour[COLOURS], colours, n_at;
    double own, peak[3];
    double (*start)[MODEL_PARAMETERS_MAX];
    double cost[FIT_STARTS_MAX];
};

static void weigh(struct search *s, double *value)
{
    double solver[MODEL_PARAMETERS_MAX], cost = 0;
    find_colours(s->f, s->picked, value, s->colour, s->colours);
    rec_fit_to_solver(s->f, value, solver);
    for (int i = 0; i < s->picked; i++) {
        double r[6];
        rec_fit_residual(s->f, i, solver, r, NULL);
        cost += rec_fit_cost(s->f->cost, r);
    }
    if (!isfinite(cost))
        return;
    int place = s->found;
    if (s->found < s->most)
        s->found++;
    else if (s->cost[--place] <= cost)
        return;
    for (; place > 0 && s->cost[place - 1] > cost; place--) {
        s->cost[place] = s->cost[place - 1];
        memcpy(s->start[place], s->start[place - 1], sizeof s->start[place]);
    }
    s->cost[place] = cost;
    memcpy(s->start[place], solver, sizeof solver);
}

// A lobe of Lafortune's about the mirror direction, as high as the data are.
static void raise_lobe(const struct search *s, double *value)
{
    for (int c = 0; s->n_at >= 0 && c < 3; c++) {
        double height = pow(fmax(1e-3, s->peak[c]), 1 / value[s->n_at + c]);
        value[s->n_at - 6 + c] = -height;
        value[s->n_at - 3 + c] = height;
    }
}

// All values of shape k and of those after it.
static void walk(struct search *s, int k, double *value)
{
    if (k == s->shapes) {
        raise_lobe(s, value);
        weigh(s, value);
        return;
    }
    const struct parameter *p = s->shape[k];
    const struct axis *axis = axis_of(p->name);
    bool width = strcmp(p->name, "alpha") == 0;
    for (int i = width ? -1 : 0; i < VALUES && (i < 0 || axis->value[i] > 0); i++) {
        double x = fmin(p->high, fmax(p->low, i < 0 ? s->own : axis->value[i]));
        if (strcmp(p->name, "alpha_2") == 0 && k > 0 && x < 1.3 * value[s->at[0]])
            continue;  // the first lobe is the narrow one
        for (int c = 0; c < p->size; c++)
            value[s->at[k] + c] = x;
        walk(s, k + 1, value);
    }
}

int rec_fit_starts(const struct fit_model *f, int picked,
                   double start[FIT_STARTS_MAX][MODEL_PARAMETERS_MAX], int most)
{
    struct search s = {.f = f, .picked = picked, .most = most, .start = start, .n_at = -1};
    double value[MODEL_PARAMETERS_MAX] = {0};
    int k = 0;
    for (const struct parameter *p = f->model->parameter; p->name; k += p->size, p++) {
        if (strcmp(p->name, "n") == 0 && strcmp(f->model->name, "lafortune") == 0)
            s.n_at = k;
        if (linear(p) && s.colours < COLOURS) {
            s.colour[s.colours++] = k;
        } else if (axis_of(p->name) && s.shapes < SHAPES) {
            s.shape[s.shapes] = p;
            s.at[s.shapes++] = k;
        } else {
            for (int c = 0; c < p->size; c++)
                value[k + c] = unsearched(p);
        }
    }
    s.own = own_width(f, picked);
    for (int i = 0; i < picked; i++)
        for (int c = 0; c < 3; c++)
            s.peak[c] = fmax(s.peak[c], f->points[f->pick[i]].f[c]);
    walk(&s, 0, value);
    return s.found;
}
