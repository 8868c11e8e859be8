/* exr_write.c -- radiance maps as OpenEXR files, row by row: R, G, B, var.R, var.G, var.B, or Y and
 * var.Y of a mosaic; 32-bit float.
 *
 * Written uncompressed, one scan line a chunk: noise does not compress, and deflate would take
 * longer than the merge. A row is packed by whichever thread made it, and only copied out in order.
 */
#include "exr_library.h"

#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char inputs_attribute[] = "goniocam:inputs";

struct exr_writer {
    struct atomic_file file;
    struct error story;
    exr_context_t exr;
    struct exr_header header;
    int row;
};

static enum status fail(struct exr_writer *writer, exr_result_t result, struct error *err)
{
    return cap_fail(err, STATUS_IO, "%s: cannot be written: %s", writer->file.name,
                    *writer->story.text ? writer->story.text
                                        : exr_get_default_error_message(result));
}

static exr_result_t set_text(exr_context_t file, const char *name, const char *text)
{
    return text && *text ? exr_attr_set_string(file, 0, name, text) : EXR_ERR_SUCCESS;
}

static exr_result_t write_header(exr_context_t file, const struct exr_header *header)
{
    static const char *const names[2][6] = {{"Y", "var.Y"},
                                            {"R", "G", "B", "var.R", "var.G", "var.B"}};
    int part;
    exr_result_t result = exr_add_part(file, "radiance", EXR_STORAGE_SCANLINE, &part);
    if (!result)
        result = exr_initialize_required_attr_simple(file, part, header->width, header->height,
                                                     EXR_COMPRESSION_NONE);
    for (int c = 0; c < 2 * header->channels && !result; c++)
        result = exr_add_channel(file, part, names[header->channels == 3][c], EXR_PIXEL_FLOAT,
                                 EXR_PERCEPTUALLY_LINEAR, 1, 1);
    if (!result && header->channels == 1)
        result = set_text(file, EXR_CFA, header->cfa);
    if (!result)
        result = set_text(file, inputs_attribute, header->inputs);
    if (!result)
        result = set_text(file, "cameraMake", header->make);
    if (!result)
        result = set_text(file, "cameraModel", header->model);
    if (!result)
        result = set_text(file, "goniocam:times", header->times);
    if (!result)
        result = set_text(file, "goniocam:unit", "full scales of the sensor per second");
    return result ? result : exr_write_header(file);
}

/* Tell the file system how long the file will be: it finds room at once instead of page by page.
 * One that cannot will find it later. */
static void reserve(const char *path, const struct exr_header *header)
{
    off_t line = (off_t)exr_line_size(header) + 16;  // with its place in the table, and its leader
    int fd = open(path, O_WRONLY | O_CLOEXEC);
    if (fd < 0)
        return;
    (void)fallocate(fd, FALLOC_FL_KEEP_SIZE, 0, line * header->height);
    close(fd);
}

enum status exr_begin(struct exr_writer **writer, const char *path, const struct exr_header *header,
                      struct error *err)
{
    struct exr_writer *made = calloc(1, sizeof *made);
    if (!made)
        return cap_fail(err, STATUS_MEMORY, "%s", path);
    enum status status = cap_file_begin(&made->file, path, false, err);
    if (status) {
        free(made);
        return status;
    }
    made->header = *header;
    exr_context_initializer_t init = exr_initializer(&made->story);
    exr_result_t result =
        exr_start_write(&made->exr, made->file.aside, EXR_WRITE_FILE_DIRECTLY, &init);
    if (!result)
        reserve(made->file.aside, header);
    if (!result)
        result = write_header(made->exr, header);
    if (!result) {
        *writer = made;
        return STATUS_OK;
    }
    status = fail(made, result, err);
    exr_end(made, false, NULL);
    return status;
}

size_t exr_line_size(const struct exr_header *header)
{
    return 2 * (size_t)header->channels * (size_t)header->width * sizeof(float);
}

/* A file's channels stand in alphabetical order: B, G, R, var.B, var.G, var.R. Its numbers are
 * little-endian, as those of every machine this is built for. */
void exr_pack(unsigned char *packed, const struct exr_header *header, const float *value,
              const float *variance)
{
    _Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "EXR files are little-endian");
    size_t width = (size_t)header->width, bytes = width * sizeof(float);
    if (header->channels == 1) {
        memcpy(packed, value, bytes);
        memcpy(packed + bytes, variance, bytes);
        return;
    }
    float *restrict to = (float *)(void *)packed;
    for (size_t x = 0; x < width; x++) {
        to[x] = value[3 * x + 2];
        to[width + x] = value[3 * x + 1];
        to[2 * width + x] = value[3 * x];
        to[3 * width + x] = variance[3 * x + 2];
        to[4 * width + x] = variance[3 * x + 1];
        to[5 * width + x] = variance[3 * x];
    }
}

enum status exr_put(struct exr_writer *writer, const unsigned char *packed, struct error *err)
{
    exr_result_t result = exr_write_scanline_chunk(writer->exr, 0, writer->row++, packed,
                                                   exr_line_size(&writer->header));
    return result ? fail(writer, result, err) : STATUS_OK;
}

enum status exr_end(struct exr_writer *writer, bool keep, struct error *err)
{
    if (!writer)
        return STATUS_OK;
    enum status status = STATUS_OK;
    exr_result_t result = writer->exr ? exr_finish(&writer->exr) : EXR_ERR_SUCCESS;
    if (keep && result)
        status = fail(writer, result, err);
    if (keep && !status)
        status = cap_file_commit(&writer->file, err);
    else
        cap_file_abandon(&writer->file);
    free(writer);
    return status;
}

enum status exr_write(const struct radiance *map, const char *path, const char *inputs,
                      struct error *err)
{
    struct exr_header header = {.width = map->width,
                                .height = map->height,
                                .channels = map->channels == 1 ? 1 : 3,
                                .cfa = map->cfa,
                                .inputs = inputs};
    size_t line = (size_t)header.width * (size_t)header.channels;
    unsigned char *packed = malloc(exr_line_size(&header));
    struct exr_writer *writer = NULL;
    enum status status =
        packed ? exr_begin(&writer, path, &header, err) : cap_fail(err, STATUS_MEMORY, "%s", path);
    for (int y = 0; y < map->height && !status; y++) {
        exr_pack(packed, &header, map->value + y * line, map->variance + y * line);
        status = exr_put(writer, packed, err);
    }
    free(packed);
    enum status ended = exr_end(writer, !status, err);
    return status ? status : ended;
}

enum status cap_radiance_write(const struct radiance *map, const char *path, struct error *err)
{
    return exr_write(map, path, NULL, err);
}
