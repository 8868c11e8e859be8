/* exr_picture.c -- plain OpenEXR pictures: R, G, B in 32-bit float, uncompressed. */
#include "exr_library.h"

#include <stdlib.h>

static exr_result_t write_header(exr_context_t file, int width, int height)
{
    static const char *const names[3] = {"R", "G", "B"};
    int part;
    exr_result_t result = exr_add_part(file, "picture", EXR_STORAGE_SCANLINE, &part);
    if (!result)
        result =
            exr_initialize_required_attr_simple(file, part, width, height, EXR_COMPRESSION_NONE);
    for (int c = 0; c < 3 && !result; c++)
        result =
            exr_add_channel(file, part, names[c], EXR_PIXEL_FLOAT, EXR_PERCEPTUALLY_LINEAR, 1, 1);
    return result ? result : exr_write_header(file);
}

// A row of the file: all blue, all green, all red.
static exr_result_t write_row(exr_context_t file, const float *rgb, float *row, int width, int y)
{
    for (int x = 0; x < width; x++)
        for (int c = 0; c < 3; c++)
            row[(2 - c) * width + x] = rgb[3 * x + c];
    return exr_write_scanline_chunk(file, 0, y, row, 3 * (size_t)width * sizeof *row);
}

enum status cap_picture_write(const float *rgb, int width, int height, const char *path,
                              struct error *err)
{
    struct error story = {0};
    struct atomic_file out;
    exr_context_t file;
    exr_context_initializer_t init = exr_initializer(&story);
    float *row = malloc(3 * (size_t)width * sizeof *row);
    if (!row)
        return cap_fail(err, STATUS_MEMORY, "%s: no memory", path);
    enum status status = cap_file_begin(&out, path, false, err);
    if (status) {
        free(row);
        return status;
    }
    exr_result_t result = exr_start_write(&file, out.aside, EXR_WRITE_FILE_DIRECTLY, &init);
    if (!result) {
        result = write_header(file, width, height);
        for (int y = 0; y < height && !result; y++)
            result = write_row(file, rgb + 3 * (size_t)y * (size_t)width, row, width, y);
        exr_result_t ended = exr_finish(&file);
        result = result ? result : ended;
    }
    free(row);
    if (!result)
        return cap_file_commit(&out, err);
    cap_file_abandon(&out);
    return cap_fail(err, STATUS_IO, "%s: %s", path,
                    *story.text ? story.text : exr_get_default_error_message(result));
}
