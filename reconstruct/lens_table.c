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
    int n = (size - 1 + LENS_STEP - 1) / LENS_STEP;
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

// The first of the four nodes around x, and x's place between the middle two.
static int span_of(double x, int nodes, double *t)
{
    double s = x / LENS_STEP;
    int i = (int)floor(s);
    i = i < 0 ? 0 : i > nodes - 4 ? nodes - 4 : i;
    *t = s - i;
    return i;
}

void rec_lens_at(const struct lens_table *table, double u, double v, double at[2], double by_u[2],
                 double by_v[2])
{
    double wu[4], su[4], wv[4], sv[4], t;
    int i = span_of(u, table->columns, &t);
    cubic(t, wu, su);
    int j = span_of(v, table->rows, &t);
    cubic(t, wv, sv);
    at[0] = at[1] = by_u[0] = by_u[1] = by_v[0] = by_v[1] = 0;
    for (int b = 0; b < 4; b++) {
        const double(*row)[2] =
            (const double(*)[2])(table->node + (size_t)(j + b) * (size_t)table->columns + i);
        for (int a = 0; a < 4; a++)
            for (int k = 0; k < 2; k++) {
                at[k] += wu[a] * wv[b] * row[a][k];
                by_u[k] += su[a] * wv[b] * row[a][k] / LENS_STEP;
                by_v[k] += wu[a] * sv[b] * row[a][k] / LENS_STEP;
            }
    }
}
