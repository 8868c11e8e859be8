/* tensor_file.c -- named arrays in one file, as the RGL material database publishes them.
 *
 * Layout.   "tensor_file\0", version {1, 0}, uint32 fields; of each field uint16 length of its
 * name, the name, uint16 dimensions, uint8 type, uint64 offset, uint64 shape [dimensions];
 *           little-endian. The arrays follow, each at a multiple of 8 bytes.
 * Source.   J. Dupuy, W. Jakob, "An Adaptive Parameterization for Efficient Material Acquisition
 *           and Rendering", SIGGRAPH Asia 2018, and the files published with it.
 */
#include "tensor_file.h"

#include <assert.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

static const char magic[12] = "tensor_file";

// Bytes of one number of a type; 0: there is no such type.
static size_t size_of(int type)
{
    static const size_t size[] = {0, 1, 1, 2, 2, 4, 4, 8, 8, 2, 4, 8};
    return type > 0 && type < (int)(sizeof size / sizeof *size) ? size[type] : 0;
}

size_t rec_tensor_numbers(const struct tensor *tensor)
{
    size_t numbers = 1;
    for (int i = 0; i < tensor->dims; i++)
        numbers *= tensor->shape[i];
    return numbers;
}

const struct tensor *rec_tensor_find(const struct tensors *tensors, const char *name)
{
    for (int i = 0; i < tensors->count; i++)
        if (strcmp(tensors->tensor[i].name, name) == 0)
            return &tensors->tensor[i];
    return NULL;
}

void rec_tensors_free(struct tensors *tensors)
{
    free(tensors->tensor);
    free(tensors->bytes);
    *tensors = (struct tensors){0};
}

/* ---- reading ----------------------------------------------------------------------------------
 */

// The bytes of a file, and how far they are understood.
struct cursor {
    unsigned char *bytes;
    size_t size, at;
    bool torn;  // something was wanted beyond the end
};

static uint64_t take(struct cursor *c, int bytes)
{
    uint64_t value = 0;
    if (c->size - c->at < (size_t)bytes) {
        c->torn = true;
        return 0;
    }
    for (int i = 0; i < bytes; i++)
        value |= (uint64_t)c->bytes[c->at++] << 8 * i;
    return value;
}

// The name is moved one byte to the front, over its length, which makes room for its zero.
static const char *take_name(struct cursor *c)
{
    size_t length = take(c, 2);
    if (c->torn || c->size - c->at < length) {
        c->torn = true;
        return NULL;
    }
    char *name = (char *)c->bytes + c->at - 1;
    memmove(name, name + 1, length);
    name[length] = '\0';
    c->at += length;
    return name;
}

// One entry of the list of arrays. false: it is torn, or its array does not lie in the file.
static bool take_field(struct tensor *field, struct cursor *c)
{
    *field = (struct tensor){.name = take_name(c)};
    field->dims = (int)take(c, 2);
    field->type = (int)take(c, 1);
    uint64_t offset = take(c, 8), numbers = 1;
    if (c->torn || field->dims > TENSOR_DIMS || !size_of(field->type) || offset > c->size)
        return false;
    uint64_t room = (c->size - offset) / size_of(field->type);
    for (int i = 0; i < field->dims; i++) {
        uint64_t length = take(c, 8);
        if (c->torn || !length || numbers > room / length)
            return false;
        field->shape[i] = length;
        numbers *= length;
    }
    field->data = c->bytes + offset;
    return numbers <= room && offset % size_of(field->type) == 0;
}

static enum status take_fields(struct tensors *tensors, struct cursor *c, const char *path,
                               struct error *err)
{
    enum { FIELD_MIN = 13 };  // bytes that the entry of a field takes at least
    if (c->size < sizeof magic + 6 || memcmp(c->bytes, magic, sizeof magic) != 0)
        return cap_fail(err, STATUS_FORMAT, "%s: not a tensor file (RGL's .bsdf)", path);
    c->at = sizeof magic;
    int major = (int)take(c, 1);
    take(c, 1);
    size_t count = take(c, 4);
    if (major != 1 || count > c->size / FIELD_MIN)
        return cap_fail(err, STATUS_FORMAT, "%s: not a tensor file of version 1", path);
    tensors->tensor = calloc(count + 1, sizeof *tensors->tensor);
    if (!tensors->tensor)
        return cap_fail(err, STATUS_MEMORY, "%s: no memory for its list", path);
    for (size_t i = 0; i < count; i++)
        if (!take_field(&tensors->tensor[i], c))
            return cap_fail(err, STATUS_FORMAT, "%s: field %zu is torn: the file is cut short",
                            path, i + 1);
    tensors->count = (int)count;
    return STATUS_OK;
}

static enum status read_all(struct cursor *c, const char *path, struct error *err)
{
    const long limit = 1L << 31;
    FILE *file = fopen(path, "rb");
    if (!file)
        return cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
    enum status status = STATUS_OK;
    long size = fseek(file, 0, SEEK_END) ? -1 : ftell(file);
    rewind(file);
    if (size < 0 || size > limit)
        status = cap_fail(err, STATUS_IO, "%s: no file, or one of more than 2 GiB", path);
    else if (!(c->bytes = malloc((size_t)size + 1)))
        status = cap_fail(err, STATUS_MEMORY, "%s: no memory to read it", path);
    else if ((c->size = fread(c->bytes, 1, (size_t)size, file)) != (size_t)size)
        status = cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
    fclose(file);
    return status;
}

enum status rec_tensors_read(struct tensors *tensors, const char *path, struct error *err)
{
    struct cursor c = {0};
    struct tensors made = {0};
    enum status status = read_all(&c, path, err);
    made.bytes = c.bytes;
    if (!status)
        status = take_fields(&made, &c, path, err);
    if (status)
        rec_tensors_free(&made);
    else
        *tensors = made;
    return status;
}

/* ---- writing ----------------------------------------------------------------------------------
 */

static bool put(FILE *to, uint64_t value, int bytes)
{
    unsigned char raw[8];
    for (int i = 0; i < bytes; i++)
        raw[i] = (unsigned char)(value >> 8 * i);
    return fwrite(raw, 1, (size_t)bytes, to) == (size_t)bytes;
}

static size_t entry_size(const struct tensor *t)
{
    return 2 + strlen(t->name) + 2 + 1 + 8 + 8 * (size_t)t->dims;
}

static size_t aligned(size_t offset)
{
    return (offset + 7) / 8 * 8;
}

static bool put_entry(FILE *to, const struct tensor *t, size_t offset)
{
    bool ok = put(to, strlen(t->name), 2) && fputs(t->name, to) >= 0
              && put(to, (uint64_t)t->dims, 2) && put(to, (uint64_t)t->type, 1)
              && put(to, offset, 8);
    for (int i = 0; ok && i < t->dims; i++)
        ok = put(to, t->shape[i], 8);
    return ok;
}

static bool put_all(FILE *to, const struct tensor *tensor, int count)
{
    _Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "tensor files are little-endian");
    size_t offset = sizeof magic + 6, end;
    for (int i = 0; i < count; i++)
        offset += entry_size(&tensor[i]);
    end = offset;
    bool ok = fwrite(magic, sizeof magic, 1, to) == 1 && put(to, 1, 1) && put(to, 0, 1)
              && put(to, (uint64_t)count, 4);
    for (int i = 0; ok && i < count; i++) {
        offset = aligned(offset);
        ok = put_entry(to, &tensor[i], offset);
        offset += rec_tensor_numbers(&tensor[i]) * size_of(tensor[i].type);
    }
    for (int i = 0; ok && i < count; i++) {
        size_t bytes = rec_tensor_numbers(&tensor[i]) * size_of(tensor[i].type);
        ok = put(to, 0, (int)(aligned(end) - end)) && fwrite(tensor[i].data, 1, bytes, to) == bytes;
        end = aligned(end) + bytes;
    }
    return ok;
}

enum status rec_tensors_write(const struct tensor *tensor, int count, const char *path,
                              struct error *err)
{
    struct atomic_file file;
    enum status status = cap_file_begin(&file, path, true, err);
    if (status)
        return status;
    if (put_all(file.stream, tensor, count))
        return cap_file_commit(&file, err);
    status = cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
    cap_file_abandon(&file);
    return status;
}
