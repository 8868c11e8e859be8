/* raw_read.c -- raw files through LibRaw, as the sensor wrote them: never demosaicked.
 *
 * Every photosite is one measurement of one channel; `cfa` says of which: Bayer's cells, X-Trans's,
 * and others of red, green and blue. A sensor without filters measures one channel that stands for
 * all three; files that hold three numbers a pixel (linear DNG, reduced raw) are RGB. The whole of
 * what the sensor wrote is taken, its masked border too, and the camera's orientation is not
 * applied: pixel coordinates stay those of the file, whatever crop a program prefers. A black level
 * that differs over the cell is evened out here, so that one level holds for all photosites.
 */
#include "photo.h"
#include "photo_aside.h"

#include <libraw/libraw.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { PERIOD = 48 };  // photosites after which every cell and pattern of black levels repeats

struct raw_file {
    struct photo_file base;
    libraw_data_t *raw;
    bool unpacked, damaged;
    bool late_levels;  // told by what is decoded only
    int numbers;       // a pixel, of 16 bits: 1, 3, or 4 of which the first three count
    int aside;         // the file of all rows, which LibRaw holds no longer; -1: it does
    uint16_t *line;    // a row of that file
    float extra_black[PERIOD * PERIOD];  // of photosites, above info.black
};

/* LibRaw goes on after damage. */
static void note_damage(void *user, const char *name, const int offset)
{
    (void)name, (void)offset;
    ((struct raw_file *)user)->damaged = true;
}

static size_t line_size(const struct raw_file *file)
{
    return (size_t)file->base.info.width * (size_t)file->numbers * sizeof(uint16_t);
}

/* The numbers of a row as LibRaw holds them. */
static const uint16_t *held_row(const struct raw_file *file, int y)
{
    const libraw_rawdata_t *data = &file->raw->rawdata;
    const uint16_t *all = data->raw_image      ? data->raw_image
                          : data->color3_image ? *data->color3_image
                                               : *data->color4_image;
    return all + (size_t)y * (file->raw->sizes.raw_pitch / sizeof(uint16_t));
}

/* All rows go to a file, if there is one to be had, and LibRaw with its memory. */
static void put_aside(struct raw_file *file)
{
    const size_t size = line_size(file), rows = (size_t)file->base.info.height;
    file->line = malloc(size);
    file->aside = file->line ? aside_open(size * rows) : -1;
    bool good = file->aside >= 0;
    for (size_t y = 0; y < rows && good; y++)
        good = aside_write(file->aside, held_row(file, (int)y), size, size * y);
    if (!good && file->aside >= 0) {
        close(file->aside);
        file->aside = -1;
    }
    file->base.aside = good;
    if (good) {
        libraw_close(file->raw);
        file->raw = NULL;
    }
}

/* LibRaw decodes; what it cannot, or we cannot use, is told. */
static enum status decode(struct raw_file *file, struct error *err)
{
    int result = file->damaged ? LIBRAW_SUCCESS : libraw_unpack(file->raw);
    const libraw_rawdata_t *data = &file->raw->rawdata;
    const char *path = file->base.path;
    if (result)
        return cap_fail(err, STATUS_FORMAT, "%s: %s", path, libraw_strerror(result));
    if (file->damaged)
        return cap_fail(err, STATUS_FORMAT, "%s: damaged or truncated", path);
    if (file->base.info.channels == 1 || file->base.info.gray
            ? !data->raw_image
            : !data->color3_image && !data->color4_image)
        return cap_fail(err, STATUS_FORMAT,
                        "%s: its numbers are not 16 bits; develop it to a linear 16-bit TIFF",
                        path);
    if (data->ioparams.fuji_width)
        return cap_fail(err, STATUS_FORMAT,
                        "%s: its photosites stand on a diagonal grid; develop it to a linear "
                        "16-bit TIFF",
                        path);
    file->numbers = data->raw_image ? 1 : data->color3_image ? 3 : 4;
    return STATUS_OK;
}

/* LibRaw counts places from the first visible pixel. */
static int visible(int at, int margin)
{
    return (at + PERIOD - margin % PERIOD) % PERIOD;
}

/* LibRaw's number of the colour of a photosite; 6 where there are no filters. */
static int color_at(libraw_data_t *raw, int x, int y)
{
    return libraw_COLOR(raw, visible(y, raw->sizes.top_margin), visible(x, raw->sizes.left_margin));
}

/* The black level of a photosite. */
static double black_at(const struct raw_file *file, int x, int y)
{
    const libraw_colordata_t *color = &file->raw->color;
    const unsigned rows = color->cblack[4], columns = color->cblack[5];
    int number = file->base.info.channels == 1 ? color_at(file->raw, x, y) : 0;
    double level = color->black + color->cblack[number < 4 ? number : 0];
    if (rows > 0 && columns > 0)
        level +=
            color->cblack[6 + (unsigned)visible(y, file->raw->sizes.top_margin) % rows * columns
                          + (unsigned)visible(x, file->raw->sizes.left_margin) % columns];
    return level;
}

static void read_levels(struct raw_file *file)
{
    double lowest = INFINITY;
    for (int k = 0; k < PERIOD * PERIOD; k++)
        lowest = fmin(lowest, black_at(file, k % PERIOD, k / PERIOD));
    for (int k = 0; k < PERIOD * PERIOD; k++)
        file->extra_black[k] = (float)(black_at(file, k % PERIOD, k / PERIOD) - lowest);
    file->base.info.black = lowest;
    file->base.info.white = file->raw->color.maximum;
}

/* Opening is cheap, decoding is not: only who reads pixels pays. */
static enum status unpack(struct raw_file *file, struct error *err)
{
    if (file->unpacked)
        return STATUS_OK;
    aside_begin();
    photo_make_room();
    enum status status = decode(file, err);
    file->unpacked = !status;
    if (!status && file->late_levels)
        read_levels(file);
    if (!status)
        put_aside(file);
    aside_end();
    return status;
}

/* A row of photosites: one number each, which a gray file stands in all channels. */
static void take_photosites(const struct raw_file *file, const uint16_t *from, int y, float *dn)
{
    size_t width = (size_t)file->base.info.width;
    const float *extra = file->extra_black + PERIOD * (y % PERIOD);
    for (size_t left = 0; left < width; left += PERIOD)
        for (size_t x = 0; x < PERIOD && left + x < width; x++)
            dn[left + x] = (float)from[left + x] - extra[x];
    for (size_t x = width; file->base.info.gray && x-- > 0;)  // from the end: nothing is lost
        dn[3 * x] = dn[3 * x + 1] = dn[3 * x + 2] = dn[x];
}

/* A row of pixels of three numbers, or the first three of four. */
static void take_pixels(const struct raw_file *file, const uint16_t *from, float *dn)
{
    const size_t numbers = (size_t)file->numbers;
    for (size_t x = 0; x < (size_t)file->base.info.width; x++)
        for (size_t c = 0; c < 3; c++)
            dn[3 * x + c] = from[numbers * x + c];
}

static enum status read_rows(struct photo_file *base, float *dn, int rows, struct error *err)
{
    struct raw_file *file = (struct raw_file *)base;
    enum status status = dn ? unpack(file, err) : STATUS_OK;
    if (!dn || status)
        return status;
    const size_t line = (size_t)base->info.width * (size_t)base->info.channels;
    const size_t size = line_size(file);
    for (int k = 0; k < rows; k++) {
        const int y = base->row + k;
        const uint16_t *from = file->line;
        if (file->aside < 0)
            from = held_row(file, y);
        else if (!aside_read(file->aside, file->line, size, size * (size_t)y))
            return cap_fail(err, STATUS_IO, "%s: what was decoded of it cannot be read again",
                            base->path);
        if (file->numbers == 1)
            take_photosites(file, from, y, dn + (size_t)k * line);
        else
            take_pixels(file, from, dn + (size_t)k * line);
    }
    return STATUS_OK;
}

static void close_file(struct photo_file *base)
{
    struct raw_file *file = (struct raw_file *)base;
    if (file->raw)
        libraw_close(file->raw);
    if (file->aside >= 0)
        close(file->aside);
    free(file->line);
}

/* The letter of a photosite; 0: none of R, G and B. */
static char letter_at(libraw_data_t *raw, int x, int y)
{
    int color = color_at(raw, x, y);
    char letter = color < 4 ? raw->idata.cdesc[color] : 0;
    return letter && strchr("RGB", letter) ? letter : 0;
}

/* The smallest cell that repeats; false: other filters than R, G and B, or no cell of ours. */
static bool read_cell(struct raw_file *file)
{
    libraw_data_t *raw = file->raw;
    char *cfa = file->base.info.cfa;
    for (int side = 2; side <= CFA_SIDE_MAX; side += 2) {
        bool same = true;
        for (int k = 0; k < PERIOD * PERIOD && same; k++) {
            int x = k % PERIOD, y = k / PERIOD;
            char letter = letter_at(raw, x, y);
            same = letter && letter == letter_at(raw, x % side, y % side);
            if (x < side && y < side)
                cfa[side * y + x] = letter;
        }
        cfa[side * side] = '\0';
        if (same)
            return true;
    }
    cfa[0] = '\0';
    return false;
}

/* Mosaic, gray or RGB. */
static enum status read_kind(struct raw_file *file, struct error *err)
{
    struct photo *info = &file->base.info;
    if (file->raw->idata.filters) {
        info->channels = 1;
        if (read_cell(file))
            return STATUS_OK;
        return cap_fail(err, STATUS_FORMAT,
                        "%s: its colour filters (%.4s) are not red, green and blue; develop it to "
                        "a linear 16-bit TIFF",
                        file->base.path, file->raw->idata.cdesc);
    }
    info->channels = 3;
    info->gray = file->raw->idata.colors == 1;
    return STATUS_OK;
}

/* EXIF's number of LibRaw's bits (1: left-right, 2: top-bottom, 4: diagonal, applied in turn). */
static int orientation_of(int flip)
{
    static const int exif[8] = {1, 2, 4, 3, 5, 8, 6, 7};
    return exif[flip & 7];
}

static void read_settings(struct photo *info, const libraw_data_t *raw)
{
    time_t seconds = raw->other.timestamp;
    struct tm when;
    info->exposure_time = (double)raw->other.shutter;
    info->aperture = (double)raw->other.aperture;
    info->iso = (double)raw->other.iso_speed;
    info->focal_length = (double)raw->other.focal_len;
    info->orientation = orientation_of(raw->sizes.flip);
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
    enum status status = read_kind(file, err);
    if (status)
        return status;
    info->width = file->raw->sizes.raw_width;
    info->height = file->raw->sizes.raw_height;
    info->bits = 16;
    read_levels(file);
    read_settings(info, file->raw);
    const char *dot = strrchr(file->base.path, '.');
    if (dot && strcasecmp(dot, ".crw") == 0)
        ciff_take(info, file->base.path);
    // Some formats, but not DNG, tell their black level within the compressed data only.
    file->late_levels = !(info->black > 0) && !file->raw->idata.dng_version;
    if (file->late_levels)
        unpack(file, NULL);
    return STATUS_OK;
}

enum status raw_open(struct photo_file **opened, const char *path, struct error *err)
{
    static const struct photo_format format = {read_rows, close_file};
    struct raw_file *file = photo_begin(sizeof *file, &format, path, err);
    if (!file)
        return STATUS_MEMORY;
    file->aside = -1;
    file->base.rows_at_once = 64;  // whole cells, and threads seldom wait for each other
    file->base.any_row = file->base.at_once = true;
    file->raw = libraw_init(LIBRAW_OPIONS_NO_DATAERR_CALLBACK);
    if (file->raw)
        libraw_set_dataerror_handler(file->raw, note_damage, file);
    enum status status = file->raw ? begin(file, err) : cap_fail(err, STATUS_MEMORY, "%s", path);
    return photo_opened(opened, &file->base, status);
}
