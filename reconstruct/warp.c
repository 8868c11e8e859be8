/* warp.c -- bilinear densities on the unit square: evaluated, sampled, inverted.
 *
 * Method.   Along x a bilinear patch is linear, and so is the integral of a row of patches in y:
 *           both cumulative functions are quadratics between nodes. Rows between two nodes blend
 *           their cumulative functions.
 * Source.   J. Dupuy, W. Jakob, "An Adaptive Parameterization for Efficient Material Acquisition
 *           and Rendering", SIGGRAPH Asia 2018, section 4 and its supplement.
 */
#include "warp.h"

#include <assert.h>
#include <stdlib.h>

// Sums in units of one patch, as the trapezoids of a bilinear function are.
static void integrate(struct warp *w, size_t slice)
{
    size_t width = (size_t)w->width, height = (size_t)w->height;
    const double *value = w->value + slice * width * height;
    double *along = w->along + slice * width * height, *across = w->across + slice * height;
    for (size_t y = 0; y < height; y++) {
        along[y * width] = 0;
        for (size_t x = 1; x < width; x++)
            along[y * width + x] =
                along[y * width + x - 1] + 0.5 * (value[y * width + x - 1] + value[y * width + x]);
    }
    across[0] = 0;
    for (size_t y = 1; y < height; y++)
        across[y] = across[y - 1] + 0.5 * (along[y * width - 1] + along[(y + 1) * width - 1]);
}

static bool normalise(struct warp *w, size_t slice)
{
    size_t width = (size_t)w->width, height = (size_t)w->height, nodes = width * height;
    double *value = w->value + slice * nodes;
    for (size_t i = 0; i < nodes; i++)
        if (!(value[i] >= 0))
            return false;
    integrate(w, slice);
    double total = w->across[slice * height + height - 1];
    if (!(total > 0 && isfinite(total)))
        return false;
    double patch = 1.0 / ((double)(width - 1) * (double)(height - 1));
    for (size_t i = 0; i < nodes; i++) {
        value[i] /= total * patch;
        w->along[slice * nodes + i] /= total;
    }
    for (size_t y = 0; y < height; y++)
        w->across[slice * height + y] /= total;
    return true;
}

enum status rec_warp_make(struct warp *warp, const float *value, int width, int height,
                          const int size[2], const float *const parameter[2], bool density,
                          struct error *err)
{
    assert(width >= 2 && height >= 2 && size[0] >= 1 && size[1] >= 1);
    size_t slices = (size_t)size[0] * (size_t)size[1];
    size_t nodes = (size_t)width * (size_t)height, count = slices * nodes;
    struct warp w = {.width = width,
                     .height = height,
                     .size = {size[0], size[1]},
                     .parameter = {parameter[0], parameter[1]},
                     .value = malloc(count * sizeof(double)),
                     .along = density ? malloc(count * sizeof(double)) : NULL,
                     .across = density ? malloc(slices * (size_t)height * sizeof(double)) : NULL};
    enum status status = STATUS_OK;
    if (!w.value || (density && (!w.along || !w.across)))
        status = cap_fail(err, STATUS_MEMORY, "no memory for a density");
    for (size_t i = 0; !status && i < count; i++)
        w.value[i] = (double)value[i];
    for (size_t s = 0; !status && density && s < slices; s++)
        if (!normalise(&w, s))
            status = cap_fail(err, STATUS_DATA, "a density is negative, or zero all over");
    if (status)
        rec_warp_free(&w);
    else
        *warp = w;
    return status;
}

void rec_warp_free(struct warp *warp)
{
    free(warp->value);
    free(warp->along);
    free(warp->across);
    *warp = (struct warp){0};
}

/* ---- between slices ---------------------------------------------------------------------------
 */

// The last index whose value is at most x, such that one more follows; and the share of that one.
static int interval(const float *value, int count, double x, double *share)
{
    int low = 0;
    while (low + 2 < count && (double)value[low + 1] <= x)
        low++;
    *share =
        count > 1
            ? fmin(fmax((x - (double)value[low]) / (double)(value[low + 1] - value[low]), 0), 1)
            : 0;
    return low;
}

struct blend rec_warp_blend(const struct warp *w, const double parameter[2])
{
    struct blend b = {.count = 0};
    double share[2];
    int low[2];
    for (int k = 0; k < 2; k++)
        low[k] = interval(w->parameter[k], w->size[k], parameter[k], &share[k]);
    for (int i = 0; i < 4; i++) {
        double weight = (i >> 1 ? share[0] : 1 - share[0]) * (i & 1 ? share[1] : 1 - share[1]);
        if (weight <= 0)
            continue;
        b.slice[b.count] = (low[0] + (i >> 1)) * w->size[1] + low[1] + (i & 1);
        b.weight[b.count++] = weight;
    }
    return b;
}

// Number `at` of each slice, slices being `stride` apart, blended.
static double blended(const double *from, const struct blend *b, size_t stride, size_t at)
{
    double sum = 0;
    for (int i = 0; i < b->count; i++)
        sum += b->weight[i] * from[(size_t)b->slice[i] * stride + at];
    return sum;
}

static double node(const struct warp *w, const double *from, const struct blend *b, int x, int y)
{
    size_t width = (size_t)w->width;
    return blended(from, b, width * (size_t)w->height, (size_t)y * width + (size_t)x);
}

// The patch of a place along one axis of `nodes`, and the place within it.
static int patch_of(double at, int nodes, double *within)
{
    double place = fmin(fmax(at, 0), 1) * (nodes - 1);
    int low = place < nodes - 2 ? (int)place : nodes - 2;
    *within = place - low;
    return low;
}

static double lerp(double a, double b, double t)
{
    return (1 - t) * a + t * b;
}

double rec_warp_eval(const struct warp *w, const struct blend *b, const double at[2])
{
    double tx, ty;
    int x = patch_of(at[0], w->width, &tx), y = patch_of(at[1], w->height, &ty);
    return lerp(lerp(node(w, w->value, b, x, y), node(w, w->value, b, x + 1, y), tx),
                lerp(node(w, w->value, b, x, y + 1), node(w, w->value, b, x + 1, y + 1), tx), ty);
}

/* ---- there and back ---------------------------------------------------------------------------
 */

/** Where the integral of the linear function from a (at 0) to b (at 1) reaches `area`; by the root
 *  that stays exact where a and b are alike. */
static double linear_inverse(double a, double b, double area)
{
    double root = sqrt(fmax(0, a * a + 2 * area * (b - a)));
    return a + root > 0 ? fmin(2 * area / (a + root), 1) : 0;
}

static double linear_integral(double a, double b, double t)
{
    return t * (a + 0.5 * t * (b - a));
}

// The integral along x up to node x, in the row at `ty` between nodes y and y + 1.
static double row_sum(const struct warp *w, const struct blend *b, int x, int y, double ty)
{
    return lerp(node(w, w->along, b, x, y), node(w, w->along, b, x, y + 1), ty);
}

// The density at node x of that row, in units of one patch.
static double row_value(const struct warp *w, const struct blend *b, int x, int y, double ty)
{
    double patch = 1.0 / ((w->width - 1.0) * (w->height - 1.0));
    return patch * lerp(node(w, w->value, b, x, y), node(w, w->value, b, x, y + 1), ty);
}

static double rows_below(const struct warp *w, const struct blend *b, int y)
{
    return blended(w->across, b, (size_t)w->height, (size_t)y);
}

// The last row whose sum from below is less than u.
static int find_row(const struct warp *w, const struct blend *b, double u)
{
    int low = 0, high = w->height - 1;
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (rows_below(w, b, middle) < u)
            low = middle;
        else
            high = middle;
    }
    return low;
}

static int find_column(const struct warp *w, const struct blend *b, int y, double ty, double sum)
{
    int low = 0, high = w->width - 1;
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (row_sum(w, b, middle, y, ty) < sum)
            low = middle;
        else
            high = middle;
    }
    return low;
}

void rec_warp_sample(const struct warp *w, const struct blend *b, const double uniform[2],
                     double at[2])
{
    int y = find_row(w, b, uniform[1]), last = w->width - 1;
    double r0 = node(w, w->along, b, last, y), r1 = node(w, w->along, b, last, y + 1);
    double ty = linear_inverse(r0, r1, uniform[1] - rows_below(w, b, y));
    double sum = uniform[0] * lerp(r0, r1, ty);
    int x = find_column(w, b, y, ty, sum);
    double tx = linear_inverse(row_value(w, b, x, y, ty), row_value(w, b, x + 1, y, ty),
                               sum - row_sum(w, b, x, y, ty));
    at[0] = (x + tx) / (w->width - 1);
    at[1] = (y + ty) / (w->height - 1);
}

void rec_warp_invert(const struct warp *w, const struct blend *b, const double at[2],
                     double uniform[2])
{
    double tx, ty;
    int x = patch_of(at[0], w->width, &tx), y = patch_of(at[1], w->height, &ty);
    int last = w->width - 1;
    double r0 = node(w, w->along, b, last, y), r1 = node(w, w->along, b, last, y + 1);
    double part = linear_integral(row_value(w, b, x, y, ty), row_value(w, b, x + 1, y, ty), tx);
    double whole = lerp(r0, r1, ty);
    uniform[0] = whole > 0 ? (row_sum(w, b, x, y, ty) + part) / whole : at[0];
    uniform[1] = rows_below(w, b, y) + linear_integral(r0, r1, ty);
}
