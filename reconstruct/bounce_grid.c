/* bounce_grid.c -- light on a grid: computed where it is asked for, finer where it bends.
 *
 * Method.   Second differences of the nodes about a cell tell by how much a straight line between
 *           them is wrong: d/8. Where that is little, the cell is linear; where it is some, cubic
 *           (R. Keys, "Cubic Convolution Interpolation for Digital Image Processing", IEEE
 *           Transactions on ASSP 29, 1981); where it is much, the cell is cut into as many parts as
 *           make straight lines good enough, and these are computed in turn.
 * Accuracy. STRAIGHT of the light, where it has no detail that falls between nodes: there, the
 * error of a cubic is some d^2 of a smooth step's.
 */
#include "bounce_grid.h"

#include <stdlib.h>

static const double STRAIGHT = 0.003, CURVED = 0.01;

enum node_state { NODE_UNKNOWN, NODE_GOOD, NODE_OFF };
struct bounce_node {
    enum node_state state;
    struct bounced_light light;
};
struct bounce_cell {
    int cuts;                  // 0: not judged yet; 1: linear; -1: cubic; more: cut
    struct bounce_node *part;  // [cuts + 1][cuts + 1], of a cell that is cut
};

bool rec_grid_begin(struct bounce_grid *g)
{
    const size_t count = (size_t)g->columns * (size_t)g->rows;
    g->node = calloc(count, sizeof *g->node);
    g->cell = calloc(count, sizeof *g->cell);
    return g->node && g->cell;
}

void rec_grid_free(struct bounce_grid *g)
{
    for (int i = 0; g->cell && i < g->columns * g->rows; i++)
        free(g->cell[i].part);
    free(g->node);
    free(g->cell);
    *g = (struct bounce_grid){0};
}

static const struct bounced_light *ask(const struct bounce_grid *g, struct bounce_node *node,
                                       double u, double v)
{
    if (node->state == NODE_UNKNOWN)
        node->state = g->source(g->of, u, v, &node->light) ? NODE_GOOD : NODE_OFF;
    return node->state == NODE_GOOD ? &node->light : NULL;
}

// The light at a node, computed when it is first asked for; NULL: there is none.
static const struct bounced_light *node_at(struct bounce_grid *g, int i, int j)
{
    if (g->around)
        i = (i + g->columns) % g->columns;
    if (i < 0 || i >= g->columns || j < 0 || j >= g->rows)
        return NULL;
    return ask(g, &g->node[(size_t)j * (size_t)g->columns + (size_t)i], i, j);
}

static double sum_of(const struct bounced_light *a)
{
    return a->radiance[0] + a->radiance[1] + a->radiance[2];
}

static void add_part(struct bounced_light *to, const struct bounced_light *part, double weight)
{
    for (int c = 0; c < 3; c++)
        to->radiance[c] += weight * part->radiance[c];
    to->doubt += weight * part->doubt;
}

/** The nodes about a cell: [row][column], the cell's own in the middle; NULL: there is none. */
struct about {
    const struct bounced_light *at[4][4];
};

// Corners of the 4 x 4 are not used.
static void look_about(struct about *a, struct bounce_grid *g, int i, int j)
{
    for (int row = 0; row < 4; row++)
        for (int k = 0; k < 4; k++) {
            bool corner = (row == 0 || row == 3) && (k == 0 || k == 3);
            a->at[row][k] = corner ? NULL : node_at(g, i + k - 1, j + row - 1);
        }
}

// INFINITY: not known, a node is missing.
static double bend(const struct bounced_light *a, const struct bounced_light *b,
                   const struct bounced_light *c)
{
    return a && c ? fabs(sum_of(a) - 2 * sum_of(b) + sum_of(c)) : INFINITY;
}

// By how much straight lines may be wrong in a cell, as a part of its light.
static double misfit(const struct about *a, double faint)
{
    double most = 0, light = 0;
    for (int j = 1; j < 3; j++)
        for (int i = 1; i < 3; i++) {
            const struct bounced_light *middle = a->at[j][i];
            double along = bend(a->at[j][i - 1], middle, a->at[j][i + 1]);
            double across = bend(a->at[j - 1][i], middle, a->at[j + 1][i]);
            most = fmax(most, along + across);
            light += sum_of(middle) / 4;
        }
    return most > 0 ? most / 8 / (light + faint) : 0;
}

static void judge(struct bounce_cell *cell, const struct about *a, const struct bounce_grid *g)
{
    double wrong = misfit(a, g->faint);
    cell->cuts = wrong < STRAIGHT ? 1 : -1;
    if (wrong < CURVED || g->cuts_max < 2)
        return;
    cell->cuts = (int)fmin(g->cuts_max, ceil(sqrt(wrong / STRAIGHT)));
    const size_t side = (size_t)cell->cuts + 1;
    cell->part = calloc(side * side, sizeof *cell->part);
    if (!cell->part)  // it is a matter of accuracy alone
        cell->cuts = -1;
}

static void mix(struct bounced_light *light, const struct bounced_light *const corner[4], double s,
                double t)
{
    const double weight[4] = {(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t};
    *light = (struct bounced_light){{0}, 0};
    for (int k = 0; k < 4; k++)
        add_part(light, corner[k], weight[k]);
}

// Keys's weights of four nodes in a row.
static void cubic(double w[4], double t)
{
    w[0] = t * (-0.5 + t * (1 - 0.5 * t));
    w[1] = 1 + t * t * (-2.5 + 1.5 * t);
    w[2] = t * (0.5 + t * (2 - 1.5 * t));
    w[3] = t * t * (-0.5 + 0.5 * t);
}

// What a cubic adds to a straight line between b and c: nothing where a neighbour is missing.
static void add_bent(struct bounced_light *light, const struct bounced_light *const row[4],
                     double t, double weight)
{
    double w[4];
    cubic(w, t);
    for (int c = 0; c < 3; c++) {
        double b = row[1]->radiance[c], d = row[2]->radiance[c];
        double a = row[0] ? row[0]->radiance[c] : 2 * b - d;
        double e = row[3] ? row[3]->radiance[c] : 2 * d - b;
        double curve = w[0] * a + w[1] * b + w[2] * d + w[3] * e;
        light->radiance[c] += weight * (curve - (1 - t) * b - t * d);
    }
}

static void bow(struct bounced_light *light, const struct about *a, double s, double t)
{
    const double across[2] = {1 - t, t}, along[2] = {1 - s, s};
    for (int k = 0; k < 2; k++) {
        const struct bounced_light *const column[4] = {a->at[0][k + 1], a->at[1][k + 1],
                                                       a->at[2][k + 1], a->at[3][k + 1]};
        add_bent(light, a->at[k + 1], s, across[k]);
        add_bent(light, column, t, along[k]);
    }
    for (int c = 0; c < 3; c++)
        light->radiance[c] = fmax(light->radiance[c], 0);
}

// Between the parts of a cell (i, j) that is cut.
static bool between_parts(const struct bounce_grid *g, const struct bounce_cell *cell, int i, int j,
                          double s, double t, struct bounced_light *light)
{
    const int n = cell->cuts;
    int k = (int)fmin(s * n, n - 1), l = (int)fmin(t * n, n - 1);
    const struct bounced_light *corner[4];
    for (int m = 0; m < 4; m++) {
        int x = k + (m & 1), y = l + (m >> 1);
        corner[m] = ask(g, &cell->part[y * (n + 1) + x], i + (double)x / n, j + (double)y / n);
        if (!corner[m])
            return false;
    }
    mix(light, corner, s * n - k, t * n - l);
    return true;
}

bool rec_grid_at(struct bounce_grid *g, double u, double v, struct bounced_light *light)
{
    int i = (int)floor(u), j = (int)floor(v);
    i = g->around ? (i + 2 * g->columns) % g->columns : (int)fmin(i, g->columns - 2);
    j = (int)fmin(j, g->rows - 2);
    double s = g->around ? u - floor(u) : u - i, t = v - j;
    const struct bounced_light *corner[4];
    for (int k = 0; k < 4; k++) {
        corner[k] = node_at(g, i + (k & 1), j + (k >> 1));
        if (!corner[k])
            return false;
    }
    struct bounce_cell *cell = &g->cell[(size_t)j * (size_t)g->columns + (size_t)i];
    struct about a;
    if (cell->cuts <= 0)
        look_about(&a, g, i, j);
    if (cell->cuts == 0)
        judge(cell, &a, g);
    if (cell->cuts > 1)
        return between_parts(g, cell, i, j, s, t, light);
    mix(light, corner, s, t);
    if (cell->cuts < 0)
        bow(light, &a, s, t);
    return true;
}
