/* png_write.c -- 16-bit RGB PNG with EXIF, by libpng, whose errors leave by longjmp. */
#include "png_write.h"

#include "exif_block.h"

#include <png.h>
#include <stdlib.h>

enum { EXIF_BEGIN = 6 };  // "Exif" and two zeros, which a PNG's chunk does not have

static void leave_with_message(png_structp png, png_const_charp text)
{
    struct error *story = png_get_error_ptr(png);
    snprintf(story->text, sizeof story->text, "%s", text);
    png_longjmp(png, 1);
}

/** false: story->text says why. */
static bool write_image(png_structp png, png_infop info, FILE *stream, const uint16_t *dn,
                        int width, int height, unsigned char *exif, unsigned exif_size)
{
    if (setjmp(png_jmpbuf(png)))
        return false;
    png_init_io(png, stream);
    png_set_IHDR(png, info, (png_uint_32)width, (png_uint_32)height, 16, PNG_COLOR_TYPE_RGB,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_compression_level(png, 1);  // noise does not shrink further
    png_set_eXIf_1(png, info, exif_size - EXIF_BEGIN, exif + EXIF_BEGIN);
    png_write_info(png, info);
    png_set_swap(png);
    for (int y = 0; y < height; y++)
        png_write_row(png, (png_const_bytep)&dn[(size_t)y * (size_t)width * 3]);
    png_write_end(png, NULL);
    return true;
}

enum status sam_png_write(const char *path, const uint16_t *dn, int width, int height,
                          const struct exif *exif, double seconds, struct error *err)
{
    struct atomic_file file = {0};
    struct error story = {0};
    unsigned char *block = NULL;
    unsigned size = 0;
    png_structp png =
        png_create_write_struct(PNG_LIBPNG_VER_STRING, &story, leave_with_message, NULL);
    png_infop info = png ? png_create_info_struct(png) : NULL;
    enum status status = STATUS_OK;
    if (!info || !sam_exif_block(exif, seconds, &block, &size)) {
        status = cap_fail(err, STATUS_MEMORY, "%s: out of memory", path);
    } else if ((status = cap_file_begin(&file, path, true, err))) {
        // told
    } else if (!write_image(png, info, file.stream, dn, width, height, block, size)) {
        status = cap_fail(err, STATUS_IO, "%s: %s", path, story.text);
        cap_file_abandon(&file);
    } else {
        status = cap_file_commit(&file, err);
    }
    png_destroy_write_struct(&png, &info);
    free(block);
    return status;
}
