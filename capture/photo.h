/* photo.h -- photographs, opened by what is in them and read row by row. */
#ifndef GONIOCAM_PHOTO_H
#define GONIOCAM_PHOTO_H

#include "capture.h"

struct photo_file;
/** How one format is read; photo_read() and photo_close() check and count for all of them. */
struct photo_format {
    /** The rows from file->row on, [rows][width][3], 8-bit values as they are; dn NULL: skip. */
    enum status (*read)(struct photo_file *file, uint16_t *dn, int rows, struct error *err);
    void (*close)(struct photo_file *file);
};

/** An open photograph. */
struct photo_file {
    const struct photo_format *format;
    struct photo info;  // its name is NULL, light and shot are -1
    char *path;
    int row;  // the next to be read
};

/** Open a TIFF (8 or 16 bits, RGB) or JPEG (8 bits, RGB) and read what it says of itself. On
 *  success end with photo_close(). STATUS_IO; STATUS_FORMAT where it is no such photograph, or the
 *  file is shorter than it says. */
enum status photo_open(struct photo_file **file, const char *path, struct error *err);
/** The next rows, at most those that are left. STATUS_FORMAT: damaged or truncated. */
enum status photo_read(struct photo_file *file, uint16_t *dn, int rows, struct error *err);
/** Pass over rows; strips and tiles that lie in them are not decoded. */
enum status photo_skip(struct photo_file *file, int rows, struct error *err);
void photo_close(struct photo_file *file);

// The formats. They own file->path once they succeed.
enum status tiff_open(struct photo_file **file, const char *path, struct error *err);
enum status jpeg_open(struct photo_file **file, const char *path, struct error *err);
#endif
