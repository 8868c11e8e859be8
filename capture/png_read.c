/* png_read.c -- PNG photographs through libpng: RGB, 8 or 16 bits, not interlaced.
 *
 * libpng's errors leave by longjmp. 8-bit files are taken for encoded, 16-bit ones for linear, as
 * TIFF files are; gAMA and colour chunks are not looked at.
 */
#include "photo.h"

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
    int samples;  // a pixel in the file; the first three are R, G, B
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

static enum status begin(struct png_file *file, struct error *err)
{
    if (setjmp(png_jmpbuf(file->png)))
        return fail(file, err, file->message);
    png_init_io(file->png, file->stream);
    png_read_info(file->png, file->info);
    struct photo *info = &file->base.info;
    int type = png_get_color_type(file->png, file->info);
    if (type != PNG_COLOR_TYPE_RGB && type != PNG_COLOR_TYPE_RGBA)
        return fail(file, err, "not an RGB image");
    if (png_get_interlace_type(file->png, file->info) != PNG_INTERLACE_NONE)
        return fail(file, err, "an interlaced PNG; save it without interlacing");
    info->width = (int)png_get_image_width(file->png, file->info);
    info->height = (int)png_get_image_height(file->png, file->info);
    info->bits = png_get_bit_depth(file->png, file->info);
    info->channels = 3;
    info->encoded = info->bits == 8;
    file->samples = type == PNG_COLOR_TYPE_RGBA ? 4 : 3;
    if (info->bits == 16)
        png_set_swap(file->png);
    png_read_update_info(file->png, file->info);
    png_bytep block = NULL;
    png_uint_32 size = 0;
    if (png_get_eXIf_1(file->png, file->info, &size, &block) && block)
        exif_take(info, block, size);
    file->line = malloc(png_get_rowbytes(file->png, file->info));
    return file->line ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%s", file->base.path);
}

static enum status read_rows(struct photo_file *base, float *dn, int rows, struct error *err)
{
    struct png_file *file = (struct png_file *)base;
    if (setjmp(png_jmpbuf(file->png)))
        return fail(file, err, file->message);
    size_t step = (size_t)file->samples, width = (size_t)base->info.width;
    const uint8_t *narrow = file->line;
    const uint16_t *wide = (const void *)file->line;
    for (int y = 0; y < rows; y++) {
        png_read_row(file->png, file->line, NULL);
        for (size_t x = 0; dn && x < width; x++)
            for (size_t c = 0; c < 3; c++)
                dn[((size_t)y * width + x) * 3 + c] =
                    base->info.bits == 8 ? narrow[step * x + c] : wide[step * x + c];
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
    free(file->line);
    free(base->path);
    free(file);
}

enum status png_open(struct photo_file **opened, const char *path, struct error *err)
{
    static const struct photo_format format = {read_rows, close_file};
    struct png_file *file = calloc(1, sizeof *file);
    char *copy = strdup(path);
    if (!file || !copy) {
        free(file);
        free(copy);
        return cap_fail(err, STATUS_MEMORY, "%s", path);
    }
    file->base = (struct photo_file){
        .format = &format, .path = copy, .info = photo_unknown(), .rows_at_once = 1};
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
    if (status)
        close_file(&file->base);
    else
        *opened = &file->base;
    return status;
}
