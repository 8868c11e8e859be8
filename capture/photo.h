/* photo.h -- photographs, opened by what is in them and read row by row. */
#ifndef GONIOCAM_PHOTO_H
#define GONIOCAM_PHOTO_H

#include "capture.h"

struct photo_file;
/** How one format is read; photo_read() and photo_close() check and count for all of them. */
struct photo_format {
    /** The rows from file->row on, [rows][width][channels]; dn NULL: skip. */
    enum status (*read)(struct photo_file *file, float *dn, int rows, struct error *err);
    /** Release what is the format's own. */
    void (*close)(struct photo_file *file);
};

/** An open photograph. */
struct photo_file {
    const struct photo_format *format;
    struct photo info;  // its name is NULL, light and shot are -1
    char *path;
    int row;           // the next to be read
    int rows_at_once;  // rows that are decoded together: a strip, a tile, a chunk
    bool any_row;      // rows can be passed over without decoding them
    bool at_once;      // the first row that is read decodes them all
    bool aside;        // into a file: it holds no rows in memory
};

/** Open a photograph and read what it says of itself: TIFF (8, 16 bits, half or float), PNG, JPEG,
 *  EXR, RGB or gray (which stands in all three channels), EXR also a mosaic Y with its cfa; or what
 *  LibRaw takes for a raw file. On success end with photo_close(). STATUS_IO; STATUS_FORMAT where
 *  it is no such photograph, or the file is shorter than it says. */
enum status photo_open(struct photo_file **file, const char *path, struct error *err);
/** The next rows, at most those that are left: DN as they are in integer files (codes where they
 *  are encoded), 65535 times the number in float files; NaN becomes infinite, as if saturated.
 *  STATUS_FORMAT: damaged or truncated. */
enum status photo_read(struct photo_file *file, float *dn, int rows, struct error *err);
/** Pass over rows. */
enum status photo_skip(struct photo_file *file, int rows, struct error *err);
void photo_close(struct photo_file *file);
/** Files that are decoded at once do not end when they are closed: they are kept, decoded, for
 *  photo_open() to hand out again, aside in a folder (NULL: the last few, in memory). */
void photo_keep_in(const char *folder);
/** Now they end, and no folder is named any longer. */
void photo_forget(void);

/** What a photograph is before its file is read: nothing is known. */
struct photo photo_unknown(void);
/** Begin to open: `size` bytes, 0 but for the struct photo_file that they begin with. NULL: out of
 *  memory, told. */
void *photo_begin(size_t size, const struct photo_format *format, const char *path,
                  struct error *err);
/** End it: the caller's, or closed where status is not OK. Returns status. */
enum status photo_opened(struct photo_file **opened, struct photo_file *file, enum status status);

// What photo_open() and photo_close() keep: a file that is there and unchanged, now the caller's,
// or NULL; a file to keep, which gives back one to end, or NULL. photo_end() ends any.
struct photo_file *photo_kept(const char *path);
struct photo_file *photo_keep(struct photo_file *file);
void photo_make_room(void);  // before one is decoded: the file longest in memory ends
void photo_end(struct photo_file *file);

// The formats.
enum status tiff_open(struct photo_file **file, const char *path, struct error *err);
enum status jpeg_open(struct photo_file **file, const char *path, struct error *err);
enum status png_open(struct photo_file **file, const char *path, struct error *err);
enum status exr_open(struct photo_file **file, const char *path, struct error *err);
enum status raw_open(struct photo_file **file, const char *path, struct error *err);

/** Settings from an EXIF block (a TIFF structure, without "Exif\0\0"); a broken one tells nothing.
 */
void exif_take(struct photo *info, const unsigned char *block, size_t size);
/** Exposure time and aperture of a Canon CRW file; nothing happens where it is none. */
void ciff_take(struct photo *info, const char *path);
#endif
