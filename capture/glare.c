/* glare.c -- what a lens spreads over the whole image, and its removal.
 *
 * Method.   The kernels are wider than two cells of the field, so the veil is computed there and
 *           read off by linear interpolation. true = (seen - veil(true)) / (1 - sum g) is solved
 *           by repetition: each round is off by sum g times the round before.
 * Accuracy. A cell's mean stands for its middle: 1e-3 of the veil of a smooth scene, a few 1e-3
 *           beside something small and bright. A photosite saturated in all frames counts with its
 *           lower bound, so the veil of a burnt-out highlight is too weak.
 */
#include "glare.h"
#include "veil_keep.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { CELLS = 64, ROUNDS = 6 };
enum { LOOKS = 24 };  // photosites along a cell that tell its mean

// Standard deviation of the kernels, of the image's diagonal; 0: even.
static const double width_of[GLARE_TERMS] = {0, 1.0 / 6, 1.0 / 24};

static size_t numbers(const struct glare_field *field)
{
    return 3 * (size_t)field->width * (size_t)field->height;
}

/* An empty field like another. */
static enum status make_like(struct glare_field *made, const struct glare_field *field,
                             struct error *err)
{
    *made = *field;
    made->value = calloc(numbers(field), sizeof *made->value);
    return made->value ? STATUS_OK
                       : cap_fail(err, STATUS_MEMORY, "%zu numbers of glare", numbers(field));
}

/* Every step-th photosite of each cell of a row: its channels, and how many there are. */
static void add_row(double *sum, const float *line, int width, int side, int step)
{
    for (int left = 0; left < width; left += side, sum += 4)
        for (int x = left; x < left + side && x < width; x += step) {
            const float *v = line + 3 * (size_t)x;
            if (!isfinite(v[0] + v[1] + v[2]))
                continue;
            for (int c = 0; c < 3; c++)
                sum[c] += (double)v[c];
            sum[3]++;
        }
}

enum status cap_glare_field(struct glare_field *field, const struct radiance *map,
                            struct error *err)
{
    assert(map->channels == 3);
    int longer = map->width > map->height ? map->width : map->height;
    struct glare_field made = {.side = (longer + CELLS - 1) / CELLS};
    made.width = (map->width + made.side - 1) / made.side;
    made.height = (map->height + made.side - 1) / made.side;
    made.last[0] = (map->width - (made.width - 1.0) * made.side) / made.side;
    made.last[1] = (map->height - (made.height - 1.0) * made.side) / made.side;
    enum status status = make_like(&made, &made, err);
    double *sum = calloc(4 * (size_t)made.width, sizeof *sum);  // three channels, and photosites
    float *line = malloc(3 * (size_t)map->width * sizeof *line);
    int step = (made.side + LOOKS - 1) / LOOKS;
    if (!status && (!sum || !line))
        status = cap_fail(err, STATUS_MEMORY, "%d cells of glare", made.width);
    for (int row = 0; row < made.height && !status; row++) {
        int end = (row + 1) * made.side < map->height ? (row + 1) * made.side : map->height;
        memset(sum, 0, 4 * (size_t)made.width * sizeof *sum);
        for (int y = row * made.side; y < end; y += step) {
            cap_radiance_row(map, y, 0, map->width, line, NULL);
            add_row(sum, line, map->width, made.side, step);
        }
        for (int x = 0; x < made.width; x++)
            for (int c = 0; c < 3 && sum[4 * x + 3] > 0; c++)
                made.value[3 * ((size_t)row * made.width + x) + c] =
                    (float)(sum[4 * x + c] / sum[4 * x + 3]);
    }
    free(line);
    free(sum);
    if (status)
        free(made.value);
    else
        *field = made;
    return status;
}

/* The mean of the image in every cell. */
static void spread_evenly(struct glare_field *to, const struct glare_field *from)
{
    double sum[3] = {0}, weights = 0;
    for (int y = 0; y < from->height; y++)
        for (int x = 0; x < from->width; x++) {
            double weight = (x + 1 < from->width ? 1 : from->last[0])
                            * (y + 1 < from->height ? 1 : from->last[1]);
            weights += weight;
            for (int c = 0; c < 3; c++)
                sum[c] += weight * (double)from->value[3 * ((size_t)y * from->width + x) + c];
        }
    for (size_t i = 0; i < numbers(from); i++)
        to->value[i] = (float)(sum[i % 3] / weights);
}

/* One line of `count` cells, `stride` numbers apart, under a Gaussian of `sigma` cells; the
 * last cell is part of one. */
static void spread_line(float *to, const float *from, int count, size_t stride, double sigma,
                        double last)
{
    for (int i = 0; i < count; i++) {
        double sum[3] = {0}, weights = 0;
        for (int k = 0; k < count; k++) {
            double weight =
                (k + 1 < count ? 1 : last) * exp(-0.5 * (i - k) * (i - k) / (sigma * sigma));
            weights += weight;
            for (size_t c = 0; c < 3; c++)
                sum[c] += weight * (double)from[(size_t)k * stride + c];
        }
        for (size_t c = 0; c < 3; c++)
            to[(size_t)i * stride + c] = (float)(sum[c] / weights);
    }
}

enum status cap_glare_spread(struct glare_field *spread, const struct glare_field *field, int term,
                             struct error *err)
{
    struct glare_field made = {0}, aside = {0};
    size_t line = 3 * (size_t)field->width;
    double sigma = width_of[term]
                   * hypot(field->width - 1 + field->last[0], field->height - 1 + field->last[1]);
    enum status status = make_like(&made, field, err);
    if (!status)
        status = make_like(&aside, field, err);
    if (!status && sigma > 0) {
        for (int y = 0; y < field->height; y++)
            spread_line(aside.value + (size_t)y * line, field->value + (size_t)y * line,
                        field->width, 3, sigma, field->last[0]);
        for (int x = 0; x < field->width; x++)
            spread_line(made.value + 3 * (size_t)x, aside.value + 3 * (size_t)x, field->height,
                        line, sigma, field->last[1]);
    } else if (!status) {
        spread_evenly(&made, field);
    }
    free(aside.value);
    if (status)
        free(made.value);
    else
        *spread = made;
    return status;
}

/* The cell before a place along one axis, and how far it is to the next one. */
static int cell_at(double at, int side, int cells, float *part)
{
    double place = (at - 0.5 * (side - 1)) / side;
    int cell = place > 0 ? (int)place : 0;
    if (cell > cells - 2)
        cell = cells > 1 ? cells - 2 : 0;
    *part = cells > 1 ? (float)fmin(fmax(place - cell, 0), 1) : 0;
    return cell;
}

void cap_glare_at(const struct glare_field *field, double x, double y, double value[3])
{
    float u, v;
    int i = cell_at(x, field->side, field->width, &u);
    int j = cell_at(y, field->side, field->height, &v);
    size_t right = field->width > 1 ? 3 : 0,
           below = field->height > 1 ? 3 * (size_t)field->width : 0;
    const float *at = field->value + 3 * ((size_t)j * field->width + i);
    for (int c = 0; c < 3; c++)
        value[c] = (double)((1 - v) * ((1 - u) * at[c] + u * at[right + c])
                            + v * ((1 - u) * at[below + c] + u * at[below + right + c]));
}

enum status cap_glare_clear(struct glare_field *truth, const struct glare_field *seen,
                            const double share[GLARE_TERMS], struct error *err)
{
    struct glare_field veil = {0}, guess = {0};
    size_t count = numbers(seen);
    float total = 0;
    enum status status = make_like(&veil, seen, err);
    if (!status)
        status = make_like(&guess, seen, err);
    if (!status)
        memcpy(guess.value, seen->value, count * sizeof *guess.value);
    for (int term = 0; term < GLARE_TERMS; term++)
        total += (float)share[term];
    assert(total < 0.5f);
    for (int round = 0; round < ROUNDS && !status && total > 0; round++) {
        memset(veil.value, 0, count * sizeof *veil.value);
        for (int term = 0; term < GLARE_TERMS && !status; term++) {
            struct glare_field one = {0};
            if (share[term] > 0)
                status = cap_glare_spread(&one, &guess, term, err);
            for (size_t i = 0; i < count && one.value; i++)
                veil.value[i] += (float)share[term] * one.value[i];
            free(one.value);
        }
        for (size_t i = 0; i < count && !status; i++)
            guess.value[i] = (seen->value[i] - veil.value[i]) / (1 - total);
    }
    free(veil.value);
    if (status)
        free(guess.value);
    else
        *truth = guess;
    return status;
}

/* seen becomes true: left is 1 / (1 - sum g), doubt the veil's relative standard deviation. */
static void clear_row(float *value, float *variance, const float *veil, int numbers, float left,
                      float doubt)
{
    for (int i = 0; i < numbers; i++) {
        float more = doubt * veil[i];
        value[i] = left * (value[i] - veil[i]);
        variance[i] = left * left * (variance[i] + more * more);
    }
}

/* The field along row y, at each of `width` photosites. */
static void field_row(float *row, float *line, const struct glare_field *field, int y, int width)
{
    float v;
    int j = cell_at(y, field->side, field->height, &v);
    size_t count = 3 * (size_t)field->width, next = field->height > 1 ? count : 0;
    const float *above = field->value + (size_t)j * count;
    for (size_t i = 0; i < count; i++)
        line[i] = (1 - v) * above[i] + v * above[i + next];
    size_t right = field->width > 1 ? 3 : 0;
    for (int x = 0; x < width; x++) {
        float u;
        const float *at = line + 3 * cell_at(x, field->side, field->width, &u);
        for (size_t c = 0; c < 3; c++)
            row[3 * (size_t)x + c] = (1 - u) * at[c] + u * at[right + c];
    }
}

static struct veil_key key_of(const struct radiance *map, const double share[GLARE_TERMS],
                              double sigma)
{
    const struct stat *about = map_file_about(map->file);
    struct veil_key key = {.device = about->st_dev,
                           .node = about->st_ino,
                           .size = about->st_size,
                           .changed = about->st_mtim,
                           .sigma = sigma};
    memcpy(key.share, share, sizeof key.share);
    return key;
}

enum status cap_glare_remove(struct radiance *map, const double share[GLARE_TERMS], double sigma,
                             struct error *err)
{
    double total = 0;
    for (int term = 0; term < GLARE_TERMS; term++)
        total += share[term];
    if (!(total > 0))
        return STATUS_OK;
    struct map_veil kept;
    const struct veil_key key = map->file ? key_of(map, share, sigma) : (struct veil_key){0};
    if (map->file && veil_recall(&kept, &key)) {
        map_file_veil(map->file, &kept);
        return STATUS_OK;
    }
    struct glare_field seen = {0}, veil = {0};  // veil: the true light first
    size_t count = 3 * (size_t)map->width;
    enum status status = cap_glare_field(&seen, map, err);
    if (!status)
        status = cap_glare_clear(&veil, &seen, share, err);
    for (size_t i = 0; !status && i < numbers(&veil); i++)
        veil.value[i] = seen.value[i] - (float)(1 - total) * veil.value[i];
    if (!status && map->file) {
        kept = (struct map_veil){veil, (float)(1 / (1 - total)), (float)(sigma / total)};
        veil_keep(&key, &kept);
        map_file_veil(map->file, &kept);
        free(seen.value);
        return STATUS_OK;  // the file owns the veil
    }
    float *row = status ? NULL : malloc((count + 3 * (size_t)veil.width) * sizeof *row);
    if (!status && !row)
        status = cap_fail(err, STATUS_MEMORY, "a row of glare");
    for (int y = 0; y < map->height && !status; y++) {
        size_t at = (size_t)y * count;
        field_row(row, row + count, &veil, y, map->width);
        clear_row(map->value + at, map->variance + at, row, (int)count, (float)(1 / (1 - total)),
                  (float)(sigma / total));
    }
    free(row);
    free(seen.value);
    free(veil.value);
    return status;
}
