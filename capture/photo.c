/* photo.c -- photographs, opened by what is in them. */
#include "photo.h"

#include <assert.h>
#include <errno.h>
#include <string.h>

enum status photo_open(struct photo_file **file, const char *path, struct error *err)
{
    unsigned char magic[4] = {0};
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
    if (memcmp(magic, "II", 2) == 0 || memcmp(magic, "MM", 2) == 0)
        return tiff_open(file, path, err);
    return cap_fail(err, STATUS_FORMAT, "%s: neither a TIFF nor a JPEG photograph", path);
}

enum status photo_read(struct photo_file *file, uint16_t *dn, int rows, struct error *err)
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

void photo_close(struct photo_file *file)
{
    if (file)
        file->format->close(file);
}
