/* exr_write.c -- radiance maps as OpenEXR files, in bands of rows: R, G, B, var.R, var.G, var.B, or Y
 * and var.Y of a mosaic; 32-bit float.
 *
 * Written uncompressed, one scan line a chunk: noise does not compress, and deflate would take
 * longer than the merge. So each row has its place in the file before it is made: OpenEXR makes the
 * header, and whichever thread made a band of rows writes it to its place, in one piece.
 */
#include "exr_library.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char inputs_attribute[] = "goniocam:inputs";

enum { LEADER = 8 };  // bytes before a row: its number, and how many bytes follow

struct exr_writer {
    struct atomic_file file;
    struct exr_header header;
    int fd;
    size_t first;  // where row 0 begins in the file, with its leader
};

static enum status fail(const struct exr_writer *writer, const char *why, struct error *err)
{
    return cap_fail(err, STATUS_IO, "%s: cannot be written: %s", writer->file.name, why);
}

static exr_result_t set_text(exr_context_t file, const char *name, const char *text)
{
    return text && *text ? exr_attr_set_string(file, 0, name, text) : EXR_ERR_SUCCESS;
}

static exr_result_t make_header(exr_context_t file, const struct exr_header *header)
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

/* What OpenEXR writes, and its last message. */
struct begin {
    struct error story;  // first: its text is what OpenEXR knows this by
    unsigned char *bytes;
    size_t size;
};

static int64_t keep_bytes(exr_const_context_t exr, void *text, const void *buffer, uint64_t size,
                          uint64_t offset, exr_stream_error_func_ptr_t fail_with)
{
    struct begin *begin =
        (void *)((char *)text - offsetof(struct begin, story) - offsetof(struct error, text));
    size_t end = (size_t)(offset + size);
    if (end > begin->size) {
        unsigned char *grown = realloc(begin->bytes, end);
        if (!grown) {
            fail_with(exr, EXR_ERR_OUT_OF_MEMORY, "out of memory");
            return -1;
        }
        memset(grown + begin->size, 0, end - begin->size);
        begin->bytes = grown;
        begin->size = end;
    }
    memcpy(begin->bytes + offset, buffer, size);
    return (int64_t)size;
}

/* The rows' places follow the header. false: out of memory. */
static bool add_table(struct begin *begin, const struct exr_header *header)
{
    size_t table = (size_t)header->height * sizeof(uint64_t);
    unsigned char *grown = realloc(begin->bytes, begin->size + table);
    if (!grown)
        return false;
    begin->bytes = grown;
    for (int y = 0; y < header->height; y++) {
        uint64_t place = begin->size + table + (size_t)y * exr_line_size(header);
        memcpy(grown + begin->size + (size_t)y * sizeof place, &place, sizeof place);
    }
    begin->size += table;
    return true;
}

static enum status put(const struct exr_writer *writer, const unsigned char *data, size_t size,
                       size_t at, struct error *err)
{
    while (size > 0) {
        ssize_t n = pwrite(writer->fd, data, size, (off_t)at);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return fail(writer, strerror(n < 0 ? errno : ENOSPC), err);
        data += n;
        at += (size_t)n;
        size -= (size_t)n;
    }
    return STATUS_OK;
}

/* Open the file and write all that stands before the rows. */
static enum status put_begin(struct exr_writer *writer, struct error *err)
{
    struct begin begin = {0};
    const struct exr_header *header = &writer->header;
    exr_context_t exr = NULL;
    exr_context_initializer_t init = exr_initializer(&begin.story);
    init.write_fn = keep_bytes;
    exr_result_t result = exr_start_write(&exr, writer->file.aside, EXR_WRITE_FILE_DIRECTLY, &init);
    if (!result)
        result = make_header(exr, header);
    char why[sizeof begin.story.text] = "";
    memcpy(why, begin.story.text, sizeof why);  // of the end, it only knows that rows are missing
    if (exr)
        exr_finish(&exr);
    enum status status = STATUS_OK;
    if (result)
        status = fail(writer, *why ? why : exr_get_default_error_message(result), err);
    else if (!add_table(&begin, header))
        status = cap_fail(err, STATUS_MEMORY, "%s", writer->file.name);
    else if ((writer->fd = open(writer->file.aside, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666))
             < 0)
        status = fail(writer, strerror(errno), err);
    if (!status) {
        writer->first = begin.size;
        // The file system finds room at once instead of page by page; one that cannot, later.
        (void)fallocate(writer->fd, FALLOC_FL_KEEP_SIZE, 0,
                        (off_t)(begin.size + exr_line_size(header) * (size_t)header->height));
        status = put(writer, begin.bytes, begin.size, 0, err);
    }
    free(begin.bytes);
    return status;
}

enum status exr_begin(struct exr_writer **writer, const char *path, const struct exr_header *header,
                      struct error *err)
{
    struct exr_writer *made = calloc(1, sizeof *made);
    if (!made)
        return cap_fail(err, STATUS_MEMORY, "%s", path);
    made->fd = -1;
    made->header = *header;
    enum status status = cap_file_begin(&made->file, path, false, err);
    if (status) {
        free(made);
        return status;
    }
    status = put_begin(made, err);
    if (status)
        exr_end(made, false, NULL);
    else
        *writer = made;
    return status;
}

size_t exr_line_size(const struct exr_header *header)
{
    return LEADER + 2 * (size_t)header->channels * (size_t)header->width * sizeof(float);
}

/* A file's channels stand in alphabetical order: B, G, R, var.B, var.G, var.R. Its numbers are
 * little-endian, as those of every machine this is built for. */
void exr_pack(unsigned char *packed, const struct exr_header *header, int y, const float *value,
              const float *variance)
{
    _Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "EXR files are little-endian");
    size_t width = (size_t)header->width, bytes = width * sizeof(float);
    const int32_t leader[2] = {y, (int32_t)(exr_line_size(header) - LEADER)};
    _Static_assert(sizeof leader == LEADER, "a row's number and its bytes");
    memcpy(packed, leader, sizeof leader);
    packed += sizeof leader;
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

enum status exr_put(const struct exr_writer *writer, const unsigned char *packed, int y, int rows,
                    struct error *err)
{
    const size_t line = exr_line_size(&writer->header);
    return put(writer, packed, (size_t)rows * line, writer->first + (size_t)y * line, err);
}

enum status exr_end(struct exr_writer *writer, bool keep, struct error *err)
{
    if (!writer)
        return STATUS_OK;
    enum status status = STATUS_OK;
    if (writer->fd >= 0 && close(writer->fd) != 0 && keep)
        status = fail(writer, strerror(errno), err);
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
        exr_pack(packed, &header, y, map->value + y * line, map->variance + y * line);
        status = exr_put(writer, packed, y, 1, err);
    }
    free(packed);
    enum status ended = exr_end(writer, !status, err);
    return status ? status : ended;
}

enum status cap_radiance_write(const struct radiance *map, const char *path, struct error *err)
{
    return exr_write(map, path, NULL, err);
}
