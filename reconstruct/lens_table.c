/* lens_table.c -- undistortion by bicubic interpolation.
 *
 * Method.   cal_ray() at every eighth pixel; Catmull-Rom cubics between. Nodes beyond the image
 *           are continued quadratically, since a lens model need not be invertible out there.
 * Accuracy. The error is h^3 times a third derivative over 30 or so; with h = 8 pixels, k1 = -0.3
 *           and a focal length of 2000 pixels that is below 1e-4 pixel, and 1e-2 of that inside.
 */
#include "lens_table.h"

#include <assert.h>
#include <stdlib.h>

enum { LENS_STEP = 8 };

static void continue_line(double (*node)[2], ptrdiff_t stride, int count)
{
    for (int k = 0; k < 2; k++) {
        double(*a)[2] = node, (*z)[2] = node + (count - 1) * stride;
        a[0][k] = 3 * a[stride][k] - 3 * a[2 * stride][k] + a[3 * stride][k];
        z[0][k] = 3 * z[-stride][k] - 3 * z[-2 * stride][k] + z[-3 * stride][k];
    }
}

// Spans between nodes that cover `size` pixels: at least two, for the continuation.
static int spans(int size)
{
    int n = (size - 1) / LENS_STEP + 1;
    return n < 2 ? 2 : n;
}

enum status rec_lens_make(struct lens_table *table, const struct camera *camera, struct error *err)
{
    int columns = spans(camera->width) + 3, rows = spans(camera->height) + 3;
    double(*node)[2] = calloc((size_t)columns * (size_t)rows, sizeof *node);
    if (!node)
        return cap_fail(err, STATUS_MEMORY, "camera %s: no memory for its rays", camera->name);
    for (int j = 1; j < rows - 1; j++)
        for (int i = 1; i < columns - 1; i++) {
            double pixel[2] = {(i - 1) * LENS_STEP, (j - 1) * LENS_STEP};
            vec3 ray = cal_ray(camera, pixel);
            node[j * columns + i][0] = ray.x / ray.z;
            node[j * columns + i][1] = ray.y / ray.z;
        }
    for (int j = 1; j < rows - 1; j++)
        continue_line(node + (size_t)j * (size_t)columns, 1, columns);
    for (int i = 0; i < columns; i++)
        continue_line(node + i, columns, rows);
    *table = (struct lens_table){node, columns, rows};
    return STATUS_OK;
}

void rec_lens_free(struct lens_table *table)
{
    free(table->node);
    *table = (struct lens_table){0};
}

// Catmull-Rom weights of four nodes at t in [0, 1] from the second, and their derivatives.
static void cubic(double t, double weight[4], double slope[4])
{
    double t2 = t * t, t3 = t2 * t;
    weight[0] = 0.5 * (-t + 2 * t2 - t3);
    weight[1] = 0.5 * (2 - 5 * t2 + 3 * t3);
    weight[2] = 0.5 * (t + 4 * t2 - 3 * t3);
    weight[3] = 0.5 * (-t2 + t3);
    slope[0] = 0.5 * (-1 + 4 * t - 3 * t2);
    slope[1] = 0.5 * (-10 * t + 9 * t2);
    slope[2] = 0.5 * (1 + 8 * t - 9 * t2);
    slope[3] = 0.5 * (-2 * t + 3 * t2);
}

/** Nodes of one row of pixels: the columns' cubics taken at y, and their slopes there. */
struct node_row {
    double at[2][LANES / LENS_STEP + 3], by_v[2][LANES / LENS_STEP + 3];
};

static void collapse(struct node_row *to, const struct lens_table *table, int first, int nodes,
                     int y)
{
    double weight[4], slope[4];
    int j = y / LENS_STEP < table->rows - 4 ? y / LENS_STEP : table->rows - 4;
    cubic((double)y / LENS_STEP - j, weight, slope);
    const double(*node)[2] = (const double(*)[2])table->node + (size_t)j * (size_t)table->columns;
    for (int i = 0; i < nodes; i++)
        for (int k = 0; k < 2; k++) {
            double at = 0, by_v = 0;
            for (int b = 0; b < 4; b++) {
                at += weight[b] * node[(size_t)b * (size_t)table->columns + first + i][k];
                by_v += slope[b] * node[(size_t)b * (size_t)table->columns + first + i][k];
            }
            to->at[k][i] = at;
            to->by_v[k][i] = by_v / LENS_STEP;
        }
}

/** Weights of the pixels between two nodes, [node][pixel]. */
struct span_weights {
    double at[4][LENS_STEP], by_u[4][LENS_STEP];
};

WIDE static void spread(struct lens_row *row, const struct node_row *nodes, int from,
                        const struct span_weights *w)
{
    int node = from / LENS_STEP;
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < LENS_STEP; i++) {
            double at = 0, by_u = 0, by_v = 0;
            for (int a = 0; a < 4; a++) {
                at += w->at[a][i] * nodes->at[k][node + a];
                by_u += w->by_u[a][i] * nodes->at[k][node + a];
                by_v += w->at[a][i] * nodes->by_v[k][node + a];
            }
            row->at[k][from + i] = at;
            row->by_u[k][from + i] = by_u;
            row->by_v[k][from + i] = by_v;
        }
}

static struct span_weights weigh_span(void)
{
    struct span_weights w;
    for (int i = 0; i < LENS_STEP; i++) {
        double weight[4], slope[4];
        cubic((double)i / LENS_STEP, weight, slope);
        for (int a = 0; a < 4; a++) {
            w.at[a][i] = weight[a];
            w.by_u[a][i] = slope[a] / LENS_STEP;
        }
    }
    return w;
}

void rec_lens_row(struct lens_row *row, const struct lens_table *table, int x0, int y)
{
    assert(x0 % LANES == 0 && x0 >= 0 && y >= 0);
    int first = x0 / LENS_STEP, spans_left = table->columns - 3 - first;
    int count = spans_left < LANES / LENS_STEP ? spans_left : LANES / LENS_STEP;
    assert(count > 0);
    struct node_row nodes;
    struct span_weights weights = weigh_span();
    collapse(&nodes, table, first, count + 3, y);
    for (int s = 0; s < count; s++)
        spread(row, &nodes, s * LENS_STEP, &weights);
    for (int k = 0; k < 2; k++)
        for (int i = count * LENS_STEP; i < LANES; i++) {
            row->at[k][i] = row->at[k][i - 1];
            row->by_u[k][i] = row->by_u[k][i - 1];
            row->by_v[k][i] = row->by_v[k][i - 1];
        }
}
