/* photo.c -- photographs, opened by what is in them: the first bytes decide, not the name. */
#include "photo.h"

#include <assert.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

/* A TIFF may be a raw file: DNG, NEF, CR2, ARW, ... have its structure. The name decides then. */
static bool has_raw_name(const char *path)
{
    static const char *const plain[] = {".tif", ".tiff"};
    const char *dot = strrchr(path, '.');
    if (!dot || strchr(dot, '/'))
        return false;
    for (int i = 0; i < 2; i++)
        if (strcasecmp(dot, plain[i]) == 0)
            return false;
    return true;
}

enum status photo_open(struct photo_file **file, const char *path, struct error *err)
{
    static const unsigned char png[4] = {0x89, 'P', 'N', 'G'}, exr[4] = {0x76, 0x2F, 0x31, 0x01};
    unsigned char magic[4] = {0};
    if ((*file = photo_kept(path)))
        return STATUS_OK;
    FILE *stream = fopen(path, "rb");
    if (!stream)
        return cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
    errno = 0;
    size_t length = fread(magic, 1, sizeof magic, stream);
    int reason = ferror(stream) ? errno : 0;  // a folder opens, and cannot be read
    fclose(stream);
    if (reason)
        return cap_fail(err, STATUS_IO, "%s: %s", path, strerror(reason));
    if (length == 0)
        return cap_fail(err, STATUS_FORMAT, "%s: the file is empty", path);
    if (magic[0] == 0xFF && magic[1] == 0xD8)
        return jpeg_open(file, path, err);
    if (memcmp(magic, png, sizeof png) == 0)
        return png_open(file, path, err);
    if (memcmp(magic, exr, sizeof exr) == 0)
        return exr_open(file, path, err);
    bool tiff = memcmp(magic, "II*\0", 4) == 0 || memcmp(magic, "MM\0*", 4) == 0
                || memcmp(magic, "II+\0", 4) == 0 || memcmp(magic, "MM\0+", 4) == 0;
    // A file whose name is no TIFF's may be a raw one nevertheless, or a TIFF with an odd name.
    struct error raw = {0};
    if (!tiff || has_raw_name(path))
        if (raw_open(file, path, &raw) == STATUS_OK)
            return STATUS_OK;
    struct error plain = {0};
    if (tiff && tiff_open(file, path, &plain) == STATUS_OK)
        return STATUS_OK;
    return cap_fail(err, raw.status ? raw.status : plain.status, "%s",
                    *raw.text ? raw.text : plain.text);
}

struct photo photo_unknown(void)
{
    return (struct photo){.light = -1, .shot = -1, .black = NAN, .white = NAN};
}

enum status photo_read(struct photo_file *file, float *dn, int rows, struct error *err)
{
    assert(rows >= 0 && file->row + rows <= file->info.height);
    enum status status = file->format->read(file, dn, rows, err);
    if (!status)
        file->row += rows;
    return status;
}

enum status photo_skip(struct photo_file *file, int rows, struct error *err)
{
    return photo_read(file, NULL, rows, err);
}

void *photo_begin(size_t size, const struct photo_format *format, const char *path,
                  struct error *err)
{
    struct photo_file *file = calloc(1, size);
    char *copy = strdup(path);
    if (!file || !copy) {
        free(file);
        free(copy);
        cap_fail(err, STATUS_MEMORY, "%s", path);
        return NULL;
    }
    file->format = format;
    file->path = copy;
    file->info = photo_unknown();
    file->rows_at_once = 1;
    return file;
}

enum status photo_opened(struct photo_file **opened, struct photo_file *file, enum status status)
{
    if (status)
        photo_end(file);
    else
        *opened = file;
    return status;
}

void photo_close(struct photo_file *file)
{
    photo_end(file && file->at_once ? photo_keep(file) : file);
}

void photo_end(struct photo_file *file)
{
    if (!file)
        return;
    file->format->close(file);
    free(file->path);
    free(file);
}
