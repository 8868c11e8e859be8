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
    *table = (struct lens_table){node, columns, rows, weigh_span()};
    return STATUS_OK;
}

void rec_lens_free(struct lens_table *table)
{
    free(table->node);
    *table = (struct lens_table){0};
}

/** Nodes of one row of pixels: the columns' cubics taken at y, and their slopes there. */
struct node_row {
    double at[LANES / LENS_STEP + 3][2], by_v[LANES / LENS_STEP + 3][2];
};

// Four rows of nodes, `stride` numbers apart.
WIDE static void collapse(struct node_row *restrict to, const double *restrict node, size_t stride,
                          int nodes, const double weight[4], const double slope[4])
{
    double *at = to->at[0], *by_v = to->by_v[0];
    for (int i = 0; i < 2 * nodes; i++) {
        double a = node[i], b = node[stride + i], c = node[2 * stride + i];
        double d = node[3 * stride + i];
        at[i] = weight[0] * a + weight[1] * b + weight[2] * c + weight[3] * d;
        by_v[i] = slope[0] * a + slope[1] * b + slope[2] * c + slope[3] * d;
    }
}

WIDE static void spread(struct lens_row *restrict row, const struct node_row *restrict nodes,
                        int spans, const struct span_weights *restrict w)
{
    for (int k = 0; k < 2; k++)
        for (int s = 0; s < spans; s++)
            for (int i = 0; i < LENS_STEP; i++) {
                double at = 0, by_u = 0, by_v = 0;
                for (int a = 0; a < 4; a++) {
                    at += w->at[a][i] * nodes->at[s + a][k];
                    by_u += w->by_u[a][i] * nodes->at[s + a][k];
                    by_v += w->at[a][i] * nodes->by_v[s + a][k];
                }
                row->at[k][s * LENS_STEP + i] = at;
                row->by_u[k][s * LENS_STEP + i] = by_u;
                row->by_v[k][s * LENS_STEP + i] = by_v;
            }
}

void rec_lens_row(struct lens_row *row, const struct lens_table *table, int x0, int y)
{
    assert(x0 % LANES == 0 && x0 >= 0 && y >= 0);
    int first = x0 / LENS_STEP, spans_left = table->columns - 3 - first;
    int count = spans_left < LANES / LENS_STEP ? spans_left : LANES / LENS_STEP;
    assert(count > 0);
    struct node_row nodes;
    double weight[4], slope[4];
    int j = y / LENS_STEP < table->rows - 4 ? y / LENS_STEP : table->rows - 4;
    cubic((double)y / LENS_STEP - j, weight, slope);
    for (int b = 0; b < 4; b++)
        slope[b] /= LENS_STEP;
    const size_t columns = (size_t)table->columns;
    collapse(&nodes, table->node[(size_t)j * columns + (size_t)first], 2 * columns, count + 3,
             weight, slope);
    spread(row, &nodes, count, &table->weights);
    for (int k = 0; k < 2; k++)
        for (int i = count * LENS_STEP; i < LANES; i++) {
            row->at[k][i] = row->at[k][i - 1];
            row->by_u[k][i] = row->by_u[k][i - 1];
            row->by_v[k][i] = row->by_v[k][i - 1];
        }
}
