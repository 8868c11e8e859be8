/* png_write.c -- pictures for people as PNG, compressed as little as helps: half of the bytes go
 * for an eighth of the time. */
#include "capture.h"

#include <png.h>
#include <stdlib.h>

static void to_bytes(unsigned char *to, const uint32_t *rgb, int width, int height, int stride)
{
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
            for (int c = 0; c < 3; c++)
                *to++ = (unsigned char)(rgb[(size_t)y * (size_t)stride + (size_t)x] >> (16 - 8 * c)
                                        & 255);
}

enum status cap_png_write(const uint32_t *rgb, int width, int height, int stride, const char *path,
                          struct error *err)
{
    png_image image = {.version = PNG_IMAGE_VERSION,
                       .width = (png_uint_32)width,
                       .height = (png_uint_32)height,
                       .format = PNG_FORMAT_RGB,
                       .flags = PNG_IMAGE_FLAG_FAST};
    struct atomic_file file;
    unsigned char *bytes = malloc(3 * (size_t)width * (size_t)height);
    enum status status = bytes ? cap_file_begin(&file, path, true, err)
                               : cap_fail(err, STATUS_MEMORY, "%s: no memory", path);
    if (!status) {
        to_bytes(bytes, rgb, width, height, stride);
        bool written = png_image_write_to_stdio(&image, file.stream, 0, bytes, 0, NULL) != 0;
        if (written || ferror(file.stream)) {
            status = cap_file_commit(&file, err);  // it knows why a write failed
        } else {
            cap_file_abandon(&file);
            status = cap_fail(err, STATUS_MEMORY, "%s: %s", path, image.message);
        }
    }
    free(bytes);
    return status;
}
