/* map_file.c -- radiance maps that stay in their files.
 *
 * A map of 24 megapixels is 576 MB, and most that is asked of it concerns a few places: tags, an
 * outline, the sample. The maps that the merge writes are uncompressed, a scan line a chunk, so
 * that each number has a place of its own in the file: it is mapped into memory, and only pages
 * that somebody looks at are read. Any other form of the file is read whole.
 */
#include "exr_library.h"
#include "map_file.h"
#include "map_room.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

/** The file in memory; row y begins at base + first + y * pitch. */
struct radiance_file {
    const unsigned char *base;
    size_t size, first, pitch;
    struct stat about;
    struct map_veil veil;
};

// Plane of a channel's values, and of its variances, in a row: files sort channels by their names.
static const int rgb_plane[2][3] = {{2, 1, 0}, {5, 4, 3}};

static const unsigned char *plane_at(const struct radiance *map, int y, int plane, int x)
{
    const struct radiance_file *f = map->file;
    size_t before = (size_t)plane * (size_t)map->width + (size_t)x;
    return f->base + f->first + (size_t)y * f->pitch + before * sizeof(float);
}

static float number(const unsigned char *at)
{
    float x;  // the file's header puts numbers at any address
    memcpy(&x, at, sizeof x);
    return x;
}

/** As the file holds it: value (plane 0) and variance of one photosite of a mosaic. */
static float stored(const struct radiance *map, int x, int y, int plane)
{
    return number(plane_at(map, y, plane, x));
}

// The mean of a channel next to (x, y), as cap_radiance_read() spreads a mosaic.
static float between(const struct radiance *map, int x, int y, int c)
{
    float sum = 0, count = 0;
    for (int reach = 1; count == 0 && reach <= cap_cfa_side(map->cfa); reach++)
        for (int v = y > reach ? y - reach : 0; v <= y + reach && v < map->height; v++)
            for (int u = x > reach ? x - reach : 0; u <= x + reach && u < map->width; u++)
                if (cap_radiance_channel(map, u, v) == c) {
                    sum += stored(map, u, v, 0);
                    count++;
                }
    return count > 0 ? sum / count : 0;
}

static void mosaic_at(const struct radiance *map, int x, int y, float value[3], float variance[3])
{
    int own = cap_radiance_channel(map, x, y);
    for (int c = 0; c < 3; c++) {
        value[c] = c == own ? stored(map, x, y, 0) : between(map, x, y, c);
        if (variance)
            variance[c] = c == own ? stored(map, x, y, 1) : INFINITY;
    }
}

// What is seen without the veil of the lens.
static void clear(const struct map_veil *veil, int x, int y, float value[3], float variance[3])
{
    double over[3];
    cap_glare_at(&veil->field, x, y, over);
    for (int c = 0; c < 3; c++) {
        float o = (float)over[c], more = veil->doubt * o;
        value[c] = veil->left * (value[c] - o);
        if (variance)
            variance[c] = veil->left * veil->left * (variance[c] + more * more);
    }
}

void map_file_veil(struct radiance_file *file, const struct map_veil *veil)
{
    free(file->veil.field.value);
    file->veil = *veil;
}

void cap_radiance_at(const struct radiance *map, int x, int y, float value[3], float variance[3])
{
    size_t at = 3 * ((size_t)y * (size_t)map->width + (size_t)x);
    if (map->file && *map->cfa) {
        mosaic_at(map, x, y, value, variance);
    } else if (map->file) {
        for (int c = 0; c < 3; c++) {
            value[c] = number(plane_at(map, y, rgb_plane[0][c], x));
            if (variance)
                variance[c] = number(plane_at(map, y, rgb_plane[1][c], x));
        }
    } else {
        memcpy(value, map->value + at, 3 * sizeof *value);
        if (variance)
            memcpy(variance, map->variance + at, 3 * sizeof *variance);
    }
    if (map->file && map->file->veil.field.value)
        clear(&map->file->veil, x, y, value, variance);
}

/* Three planes become one row of three channels. */
WIDE static void interleave(float *restrict to, const unsigned char *restrict red,
                            const unsigned char *restrict green, const unsigned char *restrict blue,
                            int count)
{
    for (int i = 0; i < count; i++) {
        const size_t at = (size_t)i * sizeof(float);
        to[3 * i] = number(red + at);
        to[3 * i + 1] = number(green + at);
        to[3 * i + 2] = number(blue + at);
    }
}

static void row_of(float *to, const struct radiance *map, int y, const int plane[3], int from,
                   int end)
{
    interleave(to, plane_at(map, y, plane[0], from), plane_at(map, y, plane[1], from),
               plane_at(map, y, plane[2], from), end - from);
}

void cap_radiance_row(const struct radiance *map, int y, int from, int end, float *value,
                      float *variance)
{
    if (!map->file) {
        size_t at = 3 * ((size_t)y * (size_t)map->width + (size_t)from);
        size_t bytes = 3 * (size_t)(end - from) * sizeof *value;
        memcpy(value, map->value + at, bytes);
        if (variance)
            memcpy(variance, map->variance + at, bytes);
        return;
    }
    const bool one_by_one = *map->cfa || map->file->veil.field.value;
    for (int x = from; one_by_one && x < end; x++) {
        int at = 3 * (x - from);
        cap_radiance_at(map, x, y, value + at, variance ? variance + at : NULL);
    }
    if (!one_by_one)
        row_of(value, map, y, rgb_plane[0], from, end);
    if (!one_by_one && variance)
        row_of(variance, map, y, rgb_plane[1], from, end);
}

const struct stat *map_file_about(const struct radiance_file *file)
{
    return &file->about;
}

void map_file_close(struct radiance_file *file)
{
    if (file) {
        munmap((void *)file->base, file->size);
        free(file->veil.field.value);
    }
    free(file);
}

static struct radiance_file *map_whole(const char *path)
{
    struct stat about;
    struct radiance_file *made = calloc(1, sizeof *made);
    int fd = made ? open(path, O_RDONLY | O_CLOEXEC) : -1;
    void *base = MAP_FAILED;
    if (fd >= 0 && fstat(fd, &about) == 0 && about.st_size > 0)
        base = mmap(NULL, (size_t)about.st_size, PROT_READ, MAP_SHARED, fd, 0);
    if (fd >= 0)
        close(fd);
    if (base == MAP_FAILED) {
        free(made);
        return NULL;
    }
    *made = (struct radiance_file){.base = base, .size = (size_t)about.st_size, .about = about};
    return made;
}

// Do the rows follow each other without a gap, to an end within the file? The table of their
// places stands right before the first.
static bool is_regular(const struct radiance_file *file, int height)
{
    size_t table = (size_t)height * sizeof(uint64_t), leader = file->first - 8;
    if (file->first < 8 + table || file->first + (size_t)height * file->pitch - 8 > file->size)
        return false;
    for (int y = 0; y < height; y++) {
        uint64_t place;
        memcpy(&place, file->base + leader - table + (size_t)y * sizeof place, sizeof place);
        if (place != leader + (size_t)y * file->pitch)
            return false;
    }
    return true;
}

enum status cap_radiance_open(struct radiance *map, const char *path, struct error *err)
{
    struct radiance made = {0};
    size_t first;
    if (exr_is_plain(&made, &first, path)) {
        size_t planes = made.channels == 3 ? 6 : 2;
        made.channels = 3;
        made.file = map_whole(path);
        if (made.file) {
            made.file->first = first;
            made.file->pitch = 8 + planes * (size_t)made.width * sizeof(float);
        }
        if (made.file && is_regular(made.file, made.height)) {
            *map = made;
            return STATUS_OK;
        }
        map_file_close(made.file);
    }
    return cap_radiance_read(map, path, err);
}

enum status cap_radiance_load(struct radiance *map, const int low[2], const int end[2],
                              struct error *err)
{
    if (!map->file)
        return STATUS_OK;
    size_t width = (size_t)map->width, count = 3 * width * (size_t)map->height;
    float *value = map_room_take(count), *variance = map_room_take(count);
    if (!value || !variance) {
        map_room_give(value);
        map_room_give(variance);
        return cap_fail(err, STATUS_MEMORY, "a radiance map of %zu values", 2 * count);
    }
    int left = low[0] > 0 ? low[0] : 0, right = end[0] < map->width ? end[0] : map->width;
    int top = low[1] > 0 ? low[1] : 0, bottom = end[1] < map->height ? end[1] : map->height;
    for (int y = top; left < right && y < bottom; y++) {
        size_t at = 3 * ((size_t)y * width + (size_t)left);
        cap_radiance_row(map, y, left, right, value + at, variance + at);
    }
    map_file_close(map->file);
    map->file = NULL;
    map->value = value;
    map->variance = variance;
    return STATUS_OK;
}
