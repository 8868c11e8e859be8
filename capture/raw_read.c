/* raw_read.c -- raw files through LibRaw, as the sensor wrote them: never demosaicked.
 *
 * Every photosite is one measurement of one channel; `cfa` says of which. The whole of what the
 * sensor wrote is taken, its masked border too, and the camera's orientation is not applied: pixel
 * coordinates stay those of the file, whatever crop a program prefers. A black level that differs
 * over the 2 x 2 cell is evened out here, so that one level holds for all photosites.
 */
#include "photo.h"

#include <libraw/libraw.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

struct raw_file {
    struct photo_file base;
    libraw_data_t *raw;
    bool unpacked, damaged;
    float extra_black[4];  // of the cell's photosites, above info.black
};

/* LibRaw goes on after damage. */
static void note_damage(void *user, const char *name, const int offset)
{
    (void)name, (void)offset;
    ((struct raw_file *)user)->damaged = true;
}

/* Opening is cheap, decoding is not: only who reads pixels pays. */
static enum status unpack(struct raw_file *file, struct error *err)
{
    int result = file->unpacked ? LIBRAW_SUCCESS : libraw_unpack(file->raw);
    if (result)
        return cap_fail(err, STATUS_FORMAT, "%s: %s", file->base.path, libraw_strerror(result));
    file->unpacked = true;
    if (file->damaged)
        return cap_fail(err, STATUS_FORMAT, "%s: damaged or truncated", file->base.path);
    if (!file->raw->rawdata.raw_image)
        return cap_fail(err, STATUS_FORMAT, "%s: not a mosaic of 16-bit numbers", file->base.path);
    return STATUS_OK;
}

static enum status read_rows(struct photo_file *base, float *dn, int rows, struct error *err)
{
    struct raw_file *file = (struct raw_file *)base;
    enum status status = dn ? unpack(file, err) : STATUS_OK;
    if (!dn || status)
        return status;
    const libraw_image_sizes_t *size = &file->raw->sizes;
    size_t pitch = size->raw_pitch / sizeof(uint16_t), width = (size_t)base->info.width;
    for (int y = 0; y < rows; y++) {
        const uint16_t *from = file->raw->rawdata.raw_image + (size_t)(base->row + y) * pitch;
        const float *extra = file->extra_black + 2 * ((base->row + y) % 2);
        for (size_t x = 0; x < width; x++)
            dn[(size_t)y * width + x] = (float)from[x] - extra[x % 2];
    }
    return STATUS_OK;
}

static void close_file(struct photo_file *base)
{
    struct raw_file *file = (struct raw_file *)base;
    libraw_close(file->raw);
    free(base->path);
    free(file);
}

/* LibRaw counts the cell's places from the first visible pixel. */
static int color_at(libraw_data_t *raw, int k)
{
    int top = raw->sizes.top_margin % 2, left = raw->sizes.left_margin % 2;
    return libraw_COLOR(raw, (k / 2 + top) % 2, (k % 2 + left) % 2);
}

/* The letters of the 2 x 2 cell at the first pixel; false: it is no such mosaic. */
static bool read_cell(struct raw_file *file)
{
    libraw_data_t *raw = file->raw;
    const unsigned foveon = 0, xtrans = 9;  // LibRaw's marks in `filters`
    if (raw->idata.filters == foveon || raw->idata.filters == xtrans)
        return false;
    for (int k = 0; k < 4; k++) {
        char letter = raw->idata.cdesc[color_at(raw, k)];
        if (!strchr("RGB", letter))
            return false;
        file->base.info.cfa[k] = letter;
    }
    return true;
}

static void read_levels(struct raw_file *file)
{
    const libraw_colordata_t *color = &file->raw->color;
    unsigned top = file->raw->sizes.top_margin, left = file->raw->sizes.left_margin;
    double level[4], lowest = INFINITY;
    for (unsigned k = 0; k < 4; k++) {
        unsigned rows = color->cblack[4], columns = color->cblack[5];
        level[k] = color->black + color->cblack[color_at(file->raw, (int)k)];
        if (rows > 0 && columns > 0)
            level[k] +=
                color
                    ->cblack[6 + (k / 2 + top) % 2 % rows * columns + (k % 2 + left) % 2 % columns];
        lowest = fmin(lowest, level[k]);
    }
    for (int k = 0; k < 4; k++)
        file->extra_black[k] = (float)(level[k] - lowest);
    file->base.info.black = lowest;
    file->base.info.white = color->maximum;
}

static void read_settings(struct photo *info, const libraw_data_t *raw)
{
    time_t seconds = raw->other.timestamp;
    struct tm when;
    info->exposure_time = (double)raw->other.shutter;
    info->aperture = (double)raw->other.aperture;
    info->iso = (double)raw->other.iso_speed;
    info->focal_length = (double)raw->other.focal_len;
    info->orientation = 0;
    snprintf(info->make, sizeof info->make, "%s", raw->idata.make);
    snprintf(info->model, sizeof info->model, "%s", raw->idata.model);
    snprintf(info->lens, sizeof info->lens, "%.63s", raw->lens.Lens);
    // LibRaw reads the camera's clock as local time, so this gives it back as it stood.
    if (seconds > 0 && localtime_r(&seconds, &when))
        strftime(info->taken, sizeof info->taken, "%Y:%m:%d %H:%M:%S", &when);
}

static enum status begin(struct raw_file *file, struct error *err)
{
    struct photo *info = &file->base.info;
    int result = libraw_open_file(file->raw, file->base.path);
    if (result)
        return cap_fail(err, STATUS_FORMAT,
                        "%s: no photograph that can be read (raw, TIFF, PNG, JPEG, EXR): %s",
                        file->base.path, libraw_strerror(result));
    if (!read_cell(file))
        return cap_fail(err, STATUS_FORMAT,
                        "%s: not a Bayer mosaic of R, G and B; develop it to a linear 16-bit TIFF",
                        file->base.path);
    info->width = file->raw->sizes.raw_width;
    info->height = file->raw->sizes.raw_height;
    info->channels = 1;
    info->bits = 16;
    read_levels(file);
    // Some formats tell their black level within the compressed data only.
    if (!(info->black > 0) && unpack(file, NULL) == STATUS_OK)
        read_levels(file);
    read_settings(info, file->raw);
    const char *dot = strrchr(file->base.path, '.');
    if (dot && strcasecmp(dot, ".crw") == 0)
        ciff_take(info, file->base.path);
    return STATUS_OK;
}

enum status raw_open(struct photo_file **opened, const char *path, struct error *err)
{
    static const struct photo_format format = {read_rows, close_file};
    struct raw_file *file = calloc(1, sizeof *file);
    char *copy = strdup(path);
    libraw_data_t *raw = libraw_init(LIBRAW_OPIONS_NO_DATAERR_CALLBACK);
    if (!file || !copy || !raw) {
        free(file);
        free(copy);
        if (raw)
            libraw_close(raw);
        return cap_fail(err, STATUS_MEMORY, "%s", path);
    }
    file->raw = raw;
    libraw_set_dataerror_handler(raw, note_damage, file);
    file->base = (struct photo_file){.format = &format,
                                     .path = copy,
                                     .info = photo_unknown(),
                                     .rows_at_once = 2,
                                     .any_row = true};
    enum status status = begin(file, err);
    if (status)
        close_file(&file->base);
    else
        *opened = &file->base;
    return status;
}
