/* flat.c -- vignetting, from a flat frame.
 *
 * Method.   The photosites of one frame are noisier than the correction may be, but what a lens
 *           does is smooth: means of cells of the image are fitted by a polynomial of degree 6 in
 *           x and y (a radial 1 + a r^2 + b r^4 + c r^6 about any centre is one), in products of
 *           Chebyshev polynomials, whose normal equations are well conditioned. Cells that stand
 *           out by more than 4 standard deviations (dust) are left out, in 3 rounds. Divided by
 *           its maximum.
 * Accuracy. With 28 terms and N photosites of relative noise s, about s sqrt(28 / N): 0.01 % for
 *           1 % and 0.8 megapixels.
 */
#include "flat.h"
#include "bracket.h"
#include "solve.h"

#include <stdlib.h>
#include <string.h>

enum { CELLS = 128 };  // across the width, at most

/* Chebyshev polynomials T_0..T_6 of t in [-1, 1]. */
static void chebyshev(double t, double value[FLAT_DEGREE + 1])
{
    value[0] = 1;
    value[1] = t;
    for (int n = 2; n <= FLAT_DEGREE; n++)
        value[n] = 2 * t * value[n - 1] - value[n - 2];
}

/* The place of pixel (or cell) i of n on [-1, 1]. */
static double place(double i, int n)
{
    return n > 1 ? 2 * i / (n - 1) - 1 : 0;
}

static void basis(double x, double y, double term[FLAT_TERMS])
{
    double tx[FLAT_DEGREE + 1], ty[FLAT_DEGREE + 1];
    chebyshev(x, tx);
    chebyshev(y, ty);
    int k = 0;
    for (int j = 0; j <= FLAT_DEGREE; j++)
        for (int i = 0; i + j <= FLAT_DEGREE; i++)
            term[k++] = tx[i] * ty[j];
}

/* Means of cells, and where their centres are. */
struct cells {
    int count;
    double *x, *y, *mean[3], *model;
};

static void cells_free(struct cells *cells)
{
    free(cells->x);
    free(cells->y);
    free(cells->model);
    for (int c = 0; c < 3; c++)
        free(cells->mean[c]);
}

static bool cells_make(struct cells *cells, const float *image, int width, int height)
{
    int side = (width + CELLS - 1) / CELLS, columns = width / side, rows = height / side;
    size_t count = (size_t)columns * (size_t)rows;
    *cells = (struct cells){.count = (int)count};
    cells->x = calloc(count, sizeof(double));
    cells->y = calloc(count, sizeof(double));
    cells->model = calloc(count, sizeof(double));
    for (int c = 0; c < 3; c++)
        cells->mean[c] = calloc(count, sizeof(double));
    if (!cells->x || !cells->y || !cells->model || !cells->mean[0] || !cells->mean[1]
        || !cells->mean[2])
        return false;
    for (int k = 0; k < cells->count; k++) {
        int left = k % columns * side, top = k / columns * side;
        cells->x[k] = place(left + 0.5 * (side - 1), width);
        cells->y[k] = place(top + 0.5 * (side - 1), height);
        for (int y = top; y < top + side; y++)
            for (int x = left; x < left + side; x++)
                for (int c = 0; c < 3; c++)
                    cells->mean[c][k] += (double)image[((size_t)y * width + x) * 3 + c];
    }
    return true;
}

/* Cells whose residual exceeds reach are left out; *deviation is that of the others. */
static bool fit_channel(double coefficient[FLAT_TERMS], const struct cells *cells, int c,
                        double reach, double *deviation)
{
    double a[FLAT_TERMS][FLAT_TERMS] = {{0}}, b[FLAT_TERMS] = {0}, term[FLAT_TERMS];
    double sum2 = 0;
    int used = 0;
    for (int k = 0; k < cells->count; k++) {
        double v = cells->mean[c][k];
        if (fabs(v - cells->model[k]) > reach)
            continue;
        basis(cells->x[k], cells->y[k], term);
        for (int i = 0; i < FLAT_TERMS; i++) {
            b[i] += term[i] * v;
            for (int j = 0; j <= i; j++)
                a[i][j] += term[i] * term[j];
        }
    }
    if (!solve_spd(&a[0][0], b, FLAT_TERMS))
        return false;
    memcpy(coefficient, b, sizeof b);
    for (int k = 0; k < cells->count; k++) {
        bool kept = fabs(cells->mean[c][k] - cells->model[k]) <= reach;
        basis(cells->x[k], cells->y[k], term);
        cells->model[k] = 0;
        for (int i = 0; i < FLAT_TERMS; i++)
            cells->model[k] += coefficient[i] * term[i];
        double rest = cells->mean[c][k] - cells->model[k];
        sum2 += kept ? rest * rest : 0;
        used += kept;
    }
    *deviation = sqrt(sum2 / used);
    return true;
}

/* Divide by the maximum; false where the model is not positive everywhere. */
static bool normalise(struct flat *flat, float *row)
{
    float high[3] = {0}, low[3] = {INFINITY, INFINITY, INFINITY};
    for (int y = 0; y < flat->height; y++) {
        flat_row(flat, y, row);
        for (int i = 0; i < 3 * flat->width; i++) {
            high[i % 3] = fmaxf(high[i % 3], row[i]);
            low[i % 3] = fminf(low[i % 3], row[i]);
        }
    }
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < FLAT_TERMS; k++)
            flat->coefficient[c][k] /= (double)high[c];
    return low[0] > 0 && low[1] > 0 && low[2] > 0;
}

void flat_row(const struct flat *flat, int y, float *row)
{
    double ty[FLAT_DEGREE + 1], sum[3][FLAT_DEGREE + 1] = {{0}};
    chebyshev(place(y, flat->height), ty);
    for (int c = 0; c < 3; c++)
        for (int j = 0, k = 0; j <= FLAT_DEGREE; j++)
            for (int i = 0; i + j <= FLAT_DEGREE; i++)
                sum[c][i] += flat->coefficient[c][k++] * ty[j];
    for (int c = 0; c < 3; c++) {
        float along[FLAT_DEGREE + 1];
        for (int i = 0; i <= FLAT_DEGREE; i++)
            along[i] = (float)sum[c][i];
        for (int x = 0; x < flat->width; x++) {
            float v = along[0];
            for (int i = 1; i <= FLAT_DEGREE; i++)
                v += along[i] * flat->across[(size_t)i * flat->width + x];
            row[3 * x + c] = v;
        }
    }
}

void flat_free(struct flat *flat)
{
    free(flat->across);
    *flat = (struct flat){0};
}

/* The table flat_row() reads. */
static bool fill_across(struct flat *flat)
{
    flat->across = malloc((size_t)(FLAT_DEGREE + 1) * flat->width * sizeof *flat->across);
    for (int x = 0; flat->across && x < flat->width; x++) {
        double t[FLAT_DEGREE + 1];
        chebyshev(place(x, flat->width), t);
        for (int i = 0; i <= FLAT_DEGREE; i++)
            flat->across[(size_t)i * flat->width + x] = (float)t[i];
    }
    return flat->across != NULL;
}

bool flat_fit_image(struct flat *flat, const float *image, int width, int height)
{
    struct cells cells = {0};
    struct flat made = {.width = width, .height = height};
    float *row = malloc(3 * (size_t)width * sizeof *row);
    bool ok = row && fill_across(&made) && cells_make(&cells, image, width, height);
    for (int c = 0; c < 3 && ok; c++) {
        double deviation, reach = INFINITY;
        memset(cells.model, 0, (size_t)cells.count * sizeof *cells.model);
        for (int round = 0; round < 3 && ok; round++) {
            ok = fit_channel(made.coefficient[c], &cells, c, reach, &deviation);
            reach = 4 * deviation + 1e-9 * fabs(cells.mean[c][0]);
        }
    }
    ok = ok && normalise(&made, row);
    if (ok) {
        *flat = made;
        made = (struct flat){0};  // the caller's now
    }
    flat_free(&made);
    cells_free(&cells);
    free(row);
    return ok;
}

/* Row y of a mosaic, added to the means of its cells, an image [width / side][3]. */
static void add_mosaic_row(float *cells, const float *row, int width, const char *cfa, int y)
{
    int side = cap_cfa_side(cfa);
    float count[3] = {0};
    for (int k = 0; k < side * side; k++)
        count[cap_cfa_channel(cfa, k % side, k / side)]++;
    for (int x = 0; x < width / side * side; x++) {
        int c = cap_cfa_channel(cfa, x, y);
        cells[3 * (x / side) + c] += row[x] / count[c];
    }
}

/* Photosites along a side of what becomes one pixel of the flat's image. */
static int cell_of(const struct photo *info)
{
    return info->channels == 1 ? cap_cfa_side(info->cfa) : 1;
}

/* The flat frame, less black: [height / cell][width / cell][3]. */
static enum status read_image(float **image, struct photo_file *file, const struct sensor *sensor,
                              const struct curve *curve, struct error *err)
{
    const struct photo *info = &file->info;
    const bool mosaic = info->channels == 1;
    const int cell = cell_of(info);
    size_t width = (size_t)info->width, count = (size_t)info->channels * width, saturated = 0;
    float *row = malloc(count * sizeof *row);
    float *made = calloc(3 * width * (size_t)info->height, sizeof *made);
    enum status status = row && made ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%s", file->path);
    for (int y = 0; y < info->height && !status; y++) {
        status = photo_read(file, row, 1, err);
        for (size_t i = 0; i < count && !status; i++) {
            size_t c = mosaic ? (size_t)cap_cfa_channel(info->cfa, (int)i, y) : i % 3;
            float dn = info->encoded ? curve->dn[c][(unsigned char)row[i]] : row[i];
            saturated += (double)dn >= sensor->usable[c];
            row[i] = dn - (float)sensor->black[c];
        }
        if (!status && mosaic && y < info->height / cell * cell)
            add_mosaic_row(made + (size_t)(y / cell) * (size_t)(info->width / cell) * 3, row,
                           info->width, info->cfa, y);
        else if (!status && !mosaic)
            memcpy(made + (size_t)y * count, row, count * sizeof *row);
    }
    // A hot photosite saturates anywhere; a thousandth is an area.
    if (!status && (double)saturated > 1e-3 * (double)count * info->height)
        status = cap_fail(err, STATUS_DATA, "%s: the flat frame is saturated: expose it less",
                          file->path);
    free(row);
    if (status)
        free(made);
    else
        *image = made;
    return status;
}

/* A model of cells, for their photosites: it is smooth, and its place runs over [-1, 1] in both. */
static bool to_photosites(struct flat *flat, int width, int height)
{
    free(flat->across);
    flat->width = width;
    flat->height = height;
    return fill_across(flat);
}

enum status flat_fit(struct flat *flat, const struct capture *capture, const struct sensor *sensor,
                     const struct curve *curve, int camera, char cfa[CFA_SIZE], struct error *err)
{
    const struct camera_kind *kind = &capture->camera[camera];
    struct photo_file *file = NULL;
    float *image = NULL;
    struct flat made = {0};
    char *path = cap_path(capture->folder, capture->flat);
    enum status status =
        path ? photo_open(&file, path, err) : cap_fail(err, STATUS_MEMORY, "%s", capture->flat);
    if (!status && (file->info.width != kind->width || file->info.height != kind->height))
        status = cap_fail(err, STATUS_DATA,
                          "%s: the flat frame has %d x %d pixels, the "
                          "photographs have %d x %d",
                          path, file->info.width, file->info.height, kind->width, kind->height);
    if (!status)
        status = read_image(&image, file, sensor, curve, err);
    int cell = status ? 1 : cell_of(&file->info);
    if (!status && !flat_fit_image(&made, image, kind->width / cell, kind->height / cell))
        status = cap_fail(err, STATUS_DATA, "%s: the flat frame is too dark or too small", path);
    if (!status && cell > 1 && !to_photosites(&made, kind->width, kind->height))
        status = cap_fail(err, STATUS_MEMORY, "%s", path);
    if (!status) {
        memcpy(cfa, file->info.cfa, CFA_SIZE);
        *flat = made;
        made = (struct flat){0};  // the caller's now
    }
    flat_free(&made);
    free(image);
    photo_close(file);
    free(path);
    return status;
}
