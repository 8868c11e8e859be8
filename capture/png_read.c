/* png_read.c -- PNG photographs through libpng: RGB, gray or of a palette.
 *
 * The rows of an interlaced file come in seven passes: it is decoded whole, by the first row that
 * is read.
 *
 * libpng's errors leave by longjmp. Files of 8 bits and less are taken for encoded, 16-bit ones for
 * linear, as TIFF files are, unless they say themselves that they are not: by a chunk sRGB, or by
 * gAMA, the power of linear light that their numbers are. Those are made linear here.
 */
#include "photo.h"
#include "response.h"

#include <errno.h>
#include <png.h>
#include <stdlib.h>
#include <string.h>

struct png_file {
    struct photo_file base;
    png_structp png;
    png_infop info;
    FILE *stream;
    png_bytep line;
    png_bytep
        *whole;     // [height] rows of an interlaced file, one block of memory; NULL: not decoded
    float *linear;  // [65536] DN of 16-bit codes that are encoded; else NULL
    char message[200];
};

static void leave_with_message(png_structp png, png_const_charp text)
{
    struct png_file *file = png_get_error_ptr(png);
    snprintf(file->message, sizeof file->message, "%s", text);
    png_longjmp(png, 1);
}

static void print_nothing(png_structp png, png_const_charp text)
{
    (void)png, (void)text;
}

static enum status fail(struct png_file *file, struct error *err, const char *what)
{
    return cap_fail(err, STATUS_FORMAT, "%s: %s", file->base.path, what);
}

/* Any colour becomes three numbers of 8 or 16 bits. */
static void ask_for_rgb(struct png_file *file)
{
    struct photo *info = &file->base.info;
    int type = png_get_color_type(file->png, file->info);
    info->gray = !(type & PNG_COLOR_MASK_COLOR);
    if (type == PNG_COLOR_TYPE_PALETTE)
        png_set_palette_to_rgb(file->png);
    if (info->gray && png_get_bit_depth(file->png, file->info) < 8)
        png_set_expand_gray_1_2_4_to_8(file->png);
    if (info->gray)
        png_set_gray_to_rgb(file->png);
    png_set_strip_alpha(file->png);
    file->base.at_once = png_set_interlace_handling(file->png) > 1;
    file->base.any_row = file->base.at_once;
    if (png_get_bit_depth(file->png, file->info) == 16)
        png_set_swap(file->png);
    png_read_update_info(file->png, file->info);
}

/* The power of linear light that the codes are; 1 where nothing says so, 0: sRGB's curve. */
static double stated_gamma(const struct png_file *file)
{
    int intent;
    double gamma = 1;
    if (png_get_sRGB(file->png, file->info, &intent))
        return 0;
    // Powers near 1 are rounding; beyond reason, nobody meant it.
    if (!png_get_gAMA(file->png, file->info, &gamma) || fabs(gamma - 1) < 0.01
        || !(gamma > 0.1 && gamma < 10))
        return 1;
    return gamma;
}

static enum status make_linear(struct png_file *file, struct error *err)
{
    enum { CODES = 65536 };
    double gamma = stated_gamma(file);
    if (file->base.info.bits != 16 || gamma == 1)
        return STATUS_OK;
    file->base.info.decoded = true;
    file->linear = malloc(CODES * sizeof *file->linear);
    if (!file->linear)
        return cap_fail(err, STATUS_MEMORY, "%s", file->base.path);
    for (int code = 0; code < CODES; code++) {
        double v = code / 65535.0;
        file->linear[code] = (float)(65535 * (gamma > 0 ? pow(v, 1 / gamma) : response_srgb(v)));
    }
    return STATUS_OK;
}

static enum status begin(struct png_file *file, struct error *err)
{
    if (setjmp(png_jmpbuf(file->png)))
        return fail(file, err, file->message);
    png_init_io(file->png, file->stream);
    png_read_info(file->png, file->info);
    struct photo *info = &file->base.info;
    info->width = (int)png_get_image_width(file->png, file->info);
    info->height = (int)png_get_image_height(file->png, file->info);
    info->channels = 3;
    ask_for_rgb(file);
    info->bits = png_get_bit_depth(file->png, file->info);
    info->encoded = info->bits == 8;
    png_bytep block = NULL;
    png_uint_32 size = 0;
    if (png_get_eXIf_1(file->png, file->info, &size, &block) && block)
        exif_take(info, block, size);
    file->line = malloc(png_get_rowbytes(file->png, file->info));
    return file->line ? make_linear(file, err)
                      : cap_fail(err, STATUS_MEMORY, "%s", file->base.path);
}

static void take_row(const struct png_file *file, png_const_bytep line, float *dn)
{
    const size_t count = 3 * (size_t)file->base.info.width;
    const uint8_t *narrow = line;
    const uint16_t *wide = (const void *)line;
    for (size_t i = 0; i < count; i++)
        dn[i] = file->base.info.bits == 8 ? narrow[i]
                : file->linear            ? file->linear[wide[i]]
                                          : wide[i];
}

/* Room for the rows of an interlaced file. */
static enum status make_whole(struct png_file *file, struct error *err)
{
    const size_t height = (size_t)file->base.info.height;
    const size_t line = (png_get_rowbytes(file->png, file->info) + 1) / 2 * 2;  // 16 bits, aligned
    photo_make_room();
    png_bytep *row = malloc(height * sizeof *row);
    png_bytep all = row ? calloc(height, line) : NULL;
    if (!all) {
        free(row);
        return cap_fail(err, STATUS_MEMORY, "%s", file->base.path);
    }
    for (size_t y = 0; y < height; y++)
        row[y] = all + y * line;
    file->whole = row;
    return STATUS_OK;
}

static void free_whole(struct png_file *file)
{
    if (file->whole)
        free(file->whole[0]);
    free(file->whole);
    file->whole = NULL;
}

static enum status read_whole(struct png_file *file, struct error *err)
{
    enum status status = make_whole(file, err);
    if (status)
        return status;
    if (setjmp(png_jmpbuf(file->png))) {
        free_whole(file);
        return fail(file, err, file->message);
    }
    png_read_image(file->png, file->whole);
    return STATUS_OK;
}

static enum status read_rows(struct photo_file *base, float *dn, int rows, struct error *err)
{
    struct png_file *file = (struct png_file *)base;
    const size_t count = 3 * (size_t)base->info.width;
    if (base->at_once) {
        enum status status = dn && !file->whole ? read_whole(file, err) : STATUS_OK;
        for (int y = 0; y < rows && dn && !status; y++)
            take_row(file, file->whole[base->row + y], dn + (size_t)y * count);
        return status;
    }
    if (setjmp(png_jmpbuf(file->png)))
        return fail(file, err, file->message);
    for (int y = 0; y < rows; y++) {
        png_read_row(file->png, file->line, NULL);
        if (dn)
            take_row(file, file->line, dn + (size_t)y * count);
    }
    return STATUS_OK;
}

static void close_file(struct photo_file *base)
{
    struct png_file *file = (struct png_file *)base;
    if (file->png)
        png_destroy_read_struct(&file->png, &file->info, NULL);
    if (file->stream)
        fclose(file->stream);
    free_whole(file);
    free(file->line);
    free(file->linear);
}

enum status png_open(struct photo_file **opened, const char *path, struct error *err)
{
    static const struct photo_format format = {read_rows, close_file};
    struct png_file *file = photo_begin(sizeof *file, &format, path, err);
    if (!file)
        return STATUS_MEMORY;
    file->png =
        png_create_read_struct(PNG_LIBPNG_VER_STRING, file, leave_with_message, print_nothing);
    file->info = file->png ? png_create_info_struct(file->png) : NULL;
    file->stream = fopen(path, "rb");
    enum status status;
    if (!file->info)
        status = cap_fail(err, STATUS_MEMORY, "%s", path);
    else
        status = file->stream ? begin(file, err)
                              : cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
    return photo_opened(opened, &file->base, status);
}
