/* thumbnail.c -- what a photograph shows, small: to tell whether two show the same view.
 *
 * Method.   Means of square cells, about 128 across, whole cells of a mosaic's filters. Of
 * neighbours a and b the gradient of the logarithm, kept finite in the dark: (b - a) / (a + b + f).
 *           It shows edges of print and shape under whatever light. Two photographs show the same
 *           view when their gradients correlate, and correlate best where they are.
 * Accuracy. A step of the camera that moves the picture by a cell, a hundredth of its width, shows.
 */
#include "thumbnail.h"
#include "photo.h"

#include <stdlib.h>

enum { CELLS_ACROSS = 128, SHIFT_MAX = 3 };
// Other views correlate by 0 +- 0.03 (of the cells' number), the same in other light by 0.8, and by
// 0.4 where noise is as much as the room's light.
static const double LIKE_LEAST = 0.2;
// Part of the mean, and of the standard deviation of a cell in the dark, that counts as darkness.
static const float DARK_PART = 0.05f, DARK_SIGMAS = 4;
// Squared steps, in parts of what noise makes of them: a hot photosite counts no more than an edge.
static const double STEP_MOST = 16, STEPS_OF_NOISE = 2;

/* Sums of cells under way. */
struct cells {
    int side, width, height;
    float *light, *variance;  // [height][width]: of the cell's mean, DN; light is NaN if saturated
    double read2;             // variance of the mean in the dark, DN^2
};

static bool cells_make(struct cells *cells, const struct photo *info)
{
    int grain = *info->cfa ? cap_cfa_side(info->cfa) : 1;
    int side = (info->width + CELLS_ACROSS - 1) / CELLS_ACROSS;
    cells->side = (side + grain - 1) / grain * grain;
    cells->width = info->width / cells->side;
    cells->height = info->height / cells->side;
    size_t count = (size_t)cells->width * (size_t)cells->height;
    cells->light = calloc(count + 1, sizeof *cells->light);
    cells->variance = calloc(count + 1, sizeof *cells->variance);
    return cells->light && cells->variance;
}

static void add_row(struct cells *cells, const float *dn, const struct photo *info, int y,
                    const struct learned *learned)
{
    const struct sensor *sensor = &learned->sensor;
    const size_t line = (size_t)(y / cells->side) * (size_t)cells->width;
    const float share = 1 / ((float)cells->side * (float)cells->side * (float)info->channels);
    for (int i = 0; i < cells->width * cells->side * info->channels; i++) {
        int x = i / info->channels;
        int c = info->channels == 3 ? i % 3 : cap_cfa_channel(info->cfa, x, y);
        size_t at = line + (size_t)(x / cells->side);
        float value = info->encoded ? learned->curve.dn[c][(unsigned char)dn[i]] : dn[i];
        float signal = value - (float)sensor->black[c], read = (float)sensor->read_noise[c];
        float photons = signal > 0 ? signal / (float)sensor->gain[c] : 0;
        cells->light[at] += value < (float)sensor->usable[c] ? share * signal : NAN;
        cells->variance[at] += share * share * (read * read + photons);
    }
}

static enum status read_cells(struct cells *cells, struct photo_file *file,
                              const struct learned *learned, struct error *err)
{
    const struct photo *info = &file->info;
    float *row = malloc((size_t)info->width * (size_t)info->channels * sizeof *row);
    if (!row || !cells_make(cells, info)) {
        free(row);
        return cap_fail(err, STATUS_MEMORY, "%s", file->path);
    }
    enum status status = STATUS_OK;
    for (int y = 0; y < cells->height * cells->side && !status; y++) {
        status = photo_read(file, row, 1, err);
        if (!status)
            add_row(cells, row, info, y, learned);
    }
    free(row);
    for (int c = 0; c < 3; c++)
        cells->read2 += learned->sensor.read_noise[c] * learned->sensor.read_noise[c] / 3
                        / ((double)cells->side * cells->side * info->channels);
    return status;
}

static double mean_light(const struct cells *cells)
{
    double sum = 0, count = 0;
    for (size_t i = 0; i < (size_t)cells->width * (size_t)cells->height; i++)
        if (isfinite(cells->light[i])) {
            sum += fmax((double)cells->light[i], 0);
            count++;
        }
    return count > 0 ? sum / count : 0;
}

/* What steps between neighbours are, in parts of what noise makes of them. */
struct steps {
    double sum, count;
};

static float gradient(const struct cells *cells, size_t i, size_t j, float dark,
                      struct steps *steps)
{
    float a = cells->light[i], b = cells->light[j], d = b - a;
    float noise = cells->variance[i] + cells->variance[j];
    if (!isfinite(d))
        return NAN;
    if (noise > 0) {
        steps->sum += fmin((double)(d * d / noise), STEP_MOST);
        steps->count++;
    }
    return d / ((a > 0 ? a : 0) + (b > 0 ? b : 0) + dark);
}

static void take_gradients(struct thumbnail *thumbnail, const struct cells *cells)
{
    struct steps steps = {0};
    const float dark =
        DARK_PART * (float)mean_light(cells) + DARK_SIGMAS * (float)sqrt(cells->read2) + 1e-6f;
    for (int y = 0; y < cells->height; y++)
        for (int x = 0; x < cells->width; x++) {
            size_t at = (size_t)y * (size_t)cells->width + (size_t)x;
            size_t below = at + (size_t)cells->width;
            thumbnail->across[at] =
                x + 1 < cells->width ? gradient(cells, at, at + 1, dark, &steps) : NAN;
            thumbnail->down[at] =
                y + 1 < cells->height ? gradient(cells, at, below, dark, &steps) : NAN;
        }
    thumbnail->blank = steps.count > 0 && steps.sum < STEPS_OF_NOISE * steps.count;
}

static enum status make(struct thumbnail *thumbnail, struct photo_file *file,
                        const struct learned *learned, struct error *err)
{
    struct cells cells = {0};
    enum status status = read_cells(&cells, file, learned, err);
    size_t count = (size_t)cells.width * (size_t)cells.height + 1;
    struct thumbnail made = {
        .width = cells.width, .height = cells.height, .seconds = file->info.exposure_time};
    if (!status) {
        made.across = malloc(count * sizeof *made.across);
        made.down = malloc(count * sizeof *made.down);
        if (!made.across || !made.down)
            status = cap_fail(err, STATUS_MEMORY, "%s", file->path);
    }
    if (!status) {
        take_gradients(&made, &cells);
        *thumbnail = made;
        made = (struct thumbnail){0};  // the caller's now
    }
    thumbnail_free(&made);
    free(cells.light);
    free(cells.variance);
    return status;
}

enum status thumbnail_read(struct thumbnail *thumbnail, const char *path,
                           const struct camera_kind *kind, const struct learned *learned,
                           struct error *err)
{
    struct photo_file *file = NULL;
    enum status status = photo_open(&file, path, err);
    if (status)
        return status;
    if (file->info.width == kind->width && file->info.height == kind->height)
        status = make(thumbnail, file, learned, err);
    photo_close(file);
    return status;
}

void thumbnail_free(struct thumbnail *thumbnail)
{
    free(thumbnail->across);
    free(thumbnail->down);
    *thumbnail = (struct thumbnail){0};
}

struct products {
    double ab, aa, bb;
};

/* Row by row, b moved by so many cells. */
static void add_products(struct products *p, const float *a, const float *b, int width, int move)
{
    int from = move < 0 ? -move : 0, to = move > 0 ? width - move : width;
    for (int x = from; x < to; x++) {
        float u = a[x], v = b[x + move];
        if (!isfinite(u) || !isfinite(v))
            continue;
        p->ab += (double)(u * v);
        p->aa += (double)(u * u);
        p->bb += (double)(v * v);
    }
}

static double correlation(const struct thumbnail *a, const struct thumbnail *b, int right, int down)
{
    struct products p = {0};
    int from = down < 0 ? -down : 0, to = down > 0 ? a->height - down : a->height;
    for (int y = from; y < to; y++) {
        size_t of_a = (size_t)y * (size_t)a->width, of_b = (size_t)(y + down) * (size_t)a->width;
        add_products(&p, a->across + of_a, b->across + of_b, a->width, right);
        add_products(&p, a->down + of_a, b->down + of_b, a->width, right);
    }
    return p.aa > 0 && p.bb > 0 ? p.ab / sqrt(p.aa * p.bb) : 0;
}

double thumbnail_likeness(const struct thumbnail *a, const struct thumbnail *b)
{
    if (!a->across || !b->across || a->width != b->width || a->height != b->height)
        return 0;
    double here = correlation(a, b, 0, 0);
    if (!(here > LIKE_LEAST))
        return 0;
    for (int down = -SHIFT_MAX; down <= SHIFT_MAX; down++)
        for (int right = -SHIFT_MAX; right <= SHIFT_MAX; right++)
            if ((down != 0 || right != 0) && correlation(a, b, right, down) >= here)
                return 0;
    return here;
}
