/* exr_write.c -- radiance maps as OpenEXR files, in bands of rows: R, G, B, var.R, var.G, var.B, or
 * Y and var.Y of a mosaic; 32-bit float.
 *
 * Written uncompressed, one scan line a chunk: noise does not compress, and deflate would take
 * longer than the merge. So each row has its place in the file before it is made: OpenEXR makes the
 * header, and any thread packs its rows into blocks of 2 MB, of which each is written when it is
 * full. The page cache keeps such a block as one page, which is mapped at once when the map is read
 * (map_file.c): a twentieth of the time that its 512 small pages take.
 *
 * To find fresh pages for a map of 24 megapixels, 576 MB, can take longer than to merge it (a
 * virtual machine's have to be found twice: over two seconds a gigabyte). Where nobody will look at
 * the map soon, pages whose bytes have reached the disk are given back, and serve again.
 */
#include "exr_library.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

static const char inputs_attribute[] = "goniocam:inputs";

enum { LEADER = 8 };       // bytes before a row: its number, and how many bytes follow
enum { BLOCK = 2 << 20 };  // bytes
enum { SPARE = 4 };        // blocks that are kept to be filled again

/** Bytes of the file that are not all there yet. */
struct block {
    unsigned char *bytes;  // [BLOCK]; NULL: none is there, or all are written
    size_t missing;
};

struct exr_writer {
    struct atomic_file file;
    struct exr_header header;
    int fd;
    size_t first, size;  // where row 0 begins in the file, with its leader; of the file
    struct block *block;
    unsigned char *spare[SPARE];
    pthread_mutex_t mutex;  // of block and spare; not of the bytes
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
    if (!result && (header->chroma[0] > 1 || header->chroma[1] > 1))
        result = exr_attr_set_v2i(file, part, EXR_CHROMA,
                                  &(exr_attr_v2i_t){{{header->chroma[0], header->chroma[1]}}});
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

/* Of a row, with its leader. */
static size_t line_size(const struct exr_header *header)
{
    return LEADER + 2 * (size_t)header->channels * (size_t)header->width * sizeof(float);
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
        uint64_t place = begin->size + table + (size_t)y * line_size(header);
        memcpy(grown + begin->size + (size_t)y * sizeof place, &place, sizeof place);
    }
    begin->size += table;
    return true;
}

static unsigned char *new_block(struct exr_writer *writer)
{
    for (int k = 0; k < SPARE; k++)
        if (writer->spare[k]) {
            unsigned char *bytes = writer->spare[k];
            writer->spare[k] = NULL;
            return bytes;
        }
    unsigned char *bytes = aligned_alloc(BLOCK, BLOCK);
    if (bytes)
        (void)madvise(bytes, BLOCK, MADV_HUGEPAGE);  // advice
    return bytes;
}

static void end_block(struct exr_writer *writer, unsigned char *bytes)
{
    for (int k = 0; k < SPARE && bytes; k++)
        if (!writer->spare[k]) {
            writer->spare[k] = bytes;
            bytes = NULL;
        }
    free(bytes);
}

/* Block k, to be filled. NULL: out of memory. */
static unsigned char *open_block(struct exr_writer *writer, size_t k)
{
    pthread_mutex_lock(&writer->mutex);
    struct block *block = &writer->block[k];
    if (!block->bytes)
        block->bytes = new_block(writer);
    unsigned char *bytes = block->bytes;
    pthread_mutex_unlock(&writer->mutex);
    return bytes;
}

static enum status write_block(const struct exr_writer *writer, size_t k,
                               const unsigned char *bytes, struct error *err)
{
    size_t at = k * BLOCK, left = writer->size - at < BLOCK ? writer->size - at : BLOCK;
    while (left > 0) {
        ssize_t n = pwrite(writer->fd, bytes, left, (off_t)at);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return fail(writer, strerror(n < 0 ? errno : ENOSPC), err);
        bytes += n;
        at += (size_t)n;
        left -= (size_t)n;
    }
    return STATUS_OK;
}

/* Send block k on its way to the disk, and give back the pages of the block that went LAG blocks
 * before, if it is there: a disk that is slower is not waited for. It is all advice. */
static void let_go(const struct exr_writer *writer, size_t k)
{
    enum { LAG = 16 };
    (void)sync_file_range(writer->fd, (off_t)(k * BLOCK), BLOCK, SYNC_FILE_RANGE_WRITE);
    if (k >= LAG)
        (void)posix_fadvise(writer->fd, (off_t)((k - LAG) * BLOCK), BLOCK, POSIX_FADV_DONTNEED);
}

/* So many bytes of block k are there now; whoever brings the last ones writes it. */
static enum status filled(struct exr_writer *writer, size_t k, size_t bytes, struct error *err)
{
    struct block *block = &writer->block[k];
    pthread_mutex_lock(&writer->mutex);
    block->missing -= bytes;
    const bool full = block->missing == 0;
    pthread_mutex_unlock(&writer->mutex);
    if (!full)
        return STATUS_OK;
    enum status status = write_block(writer, k, block->bytes, err);
    if (!status && writer->header.let_go)
        let_go(writer, k);
    pthread_mutex_lock(&writer->mutex);
    end_block(writer, block->bytes);
    block->bytes = NULL;
    pthread_mutex_unlock(&writer->mutex);
    return status;
}

/* Bytes for a place in the file, which may lie in several blocks. */
static enum status put_bytes(struct exr_writer *writer, const unsigned char *data, size_t size,
                             size_t at, struct error *err)
{
    enum status status = STATUS_OK;
    while (size > 0 && !status) {
        const size_t k = at / BLOCK, from = at % BLOCK;
        const size_t here = size < BLOCK - from ? size : BLOCK - from;
        unsigned char *bytes = open_block(writer, k);
        if (!bytes)
            return cap_fail(err, STATUS_MEMORY, "%s", writer->file.name);
        memcpy(bytes + from, data, here);
        status = filled(writer, k, here, err);
        data += here;
        at += here;
        size -= here;
    }
    return status;
}

/* All blocks of a file whose rows begin at writer->first, empty. false: out of memory. */
static bool make_blocks(struct exr_writer *writer)
{
    const size_t rows = (size_t)writer->header.height;
    writer->size = writer->first + rows * line_size(&writer->header);
    const size_t blocks = (writer->size + BLOCK - 1) / BLOCK;
    writer->block = calloc(blocks + 1, sizeof *writer->block);
    for (size_t k = 0; writer->block && k < blocks; k++)
        writer->block[k].missing = k + 1 < blocks ? BLOCK : writer->size - k * BLOCK;
    return writer->block != NULL;
}

/* Open the file and put what stands before the rows. */
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
        status = make_blocks(writer) ? put_bytes(writer, begin.bytes, begin.size, 0, err)
                                     : cap_fail(err, STATUS_MEMORY, "%s", writer->file.name);
        // The file system finds room at once instead of page by page; one that cannot, later.
        (void)fallocate(writer->fd, FALLOC_FL_KEEP_SIZE, 0, (off_t)writer->size);
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
    pthread_mutex_init(&made->mutex, NULL);
    enum status status = cap_file_begin(&made->file, path, false, err);
    if (status) {
        pthread_mutex_destroy(&made->mutex);
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

/* A file's channels stand in alphabetical order: B, G, R, var.B, var.G, var.R. Its numbers are
 * little-endian, as those of every machine this is built for. */
static void pack(unsigned char *packed, const struct exr_header *header, int y, const float *value,
                 const float *variance)
{
    _Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "EXR files are little-endian");
    size_t width = (size_t)header->width, bytes = width * sizeof(float);
    const int32_t leader[2] = {y, (int32_t)(line_size(header) - LEADER)};
    _Static_assert(sizeof leader == LEADER, "a row's number and its bytes");
    memcpy(packed, leader, sizeof leader);
    packed += sizeof leader;
    if (header->channels == 1) {
        memcpy(packed, value, bytes);
        memcpy(packed + bytes, variance, bytes);
        return;
    }
    typedef float anywhere __attribute__((aligned(1), may_alias));  // headers have any length
    anywhere *restrict to = (anywhere *)(void *)packed;
    for (size_t x = 0; x < width; x++) {
        to[x] = value[3 * x + 2];
        to[width + x] = value[3 * x + 1];
        to[2 * width + x] = value[3 * x];
        to[3 * width + x] = variance[3 * x + 2];
        to[4 * width + x] = variance[3 * x + 1];
        to[5 * width + x] = variance[3 * x];
    }
}

enum status exr_put(struct exr_writer *writer, int y, const float *value, const float *variance,
                    struct error *err)
{
    const size_t line = line_size(&writer->header), at = writer->first + (size_t)y * line;
    const size_t from = at % BLOCK;
    unsigned char *bytes = from + line <= BLOCK ? open_block(writer, at / BLOCK) : malloc(line);
    if (!bytes)
        return cap_fail(err, STATUS_MEMORY, "%s", writer->file.name);
    if (from + line <= BLOCK) {
        pack(bytes + from, &writer->header, y, value, variance);
        return filled(writer, at / BLOCK, line, err);
    }
    pack(bytes, &writer->header, y, value, variance);
    enum status status = put_bytes(writer, bytes, line, at, err);
    free(bytes);
    return status;
}

/* Whatever of the blocks there still is. */
static void free_blocks(struct exr_writer *writer)
{
    for (size_t k = 0; writer->block && k * BLOCK < writer->size; k++)
        free(writer->block[k].bytes);
    free(writer->block);
    for (int k = 0; k < SPARE; k++)
        free(writer->spare[k]);
}

enum status exr_end(struct exr_writer *writer, bool keep, struct error *err)
{
    if (!writer)
        return STATUS_OK;
    enum status status = STATUS_OK;
    if (writer->fd >= 0 && keep && writer->header.let_go)
        (void)posix_fadvise(writer->fd, 0, 0, POSIX_FADV_DONTNEED);
    if (writer->fd >= 0 && close(writer->fd) != 0 && keep)
        status = fail(writer, strerror(errno), err);
    if (keep && !status)
        status = cap_file_commit(&writer->file, err);
    else
        cap_file_abandon(&writer->file);
    free_blocks(writer);
    pthread_mutex_destroy(&writer->mutex);
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
                                .chroma = {map->chroma[0], map->chroma[1]},
                                .inputs = inputs};
    size_t line = (size_t)header.width * (size_t)header.channels;
    struct exr_writer *writer = NULL;
    enum status status = exr_begin(&writer, path, &header, err);
    for (int y = 0; y < map->height && !status; y++)
        status = exr_put(writer, y, map->value + y * line, map->variance + y * line, err);
    enum status ended = exr_end(writer, !status, err);
    return status ? status : ended;
}

enum status cap_radiance_write(const struct radiance *map, const char *path, struct error *err)
{
    return exr_write(map, path, NULL, err);
}
