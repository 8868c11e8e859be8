/* formats.h -- the files that hold a BRDF: each format in the file of its name, all in one table.
 */
#ifndef GONIOCAM_FORMATS_H
#define GONIOCAM_FORMATS_H

#include "reconstruct.h"

enum { FORMAT_START = 4096 };

/** One format. */
struct format {
    const char *name;  // for people
    /** Does a file that begins so (its first FORMAT_START bytes, or all; a zero follows them) hold
     *  this format? */
    bool (*probe)(const char *start, size_t size);
    /** As rec_brdf_read. */
    enum status (*read)(struct brdf *brdf, const char *path, struct error *err);
};

extern const struct format rec_format_merl;
extern const struct format rec_format_rgl;
extern const struct format rec_format_mit;
extern const struct format rec_format_fits;
extern const struct format rec_format_published;
extern const struct format rec_format_cornell;
extern const struct format rec_format_samples;

/** The format of a file; NULL, and a message, where it cannot be read (STATUS_IO) or is none of
 *  them (STATUS_FORMAT). */
const struct format *rec_format_of(const char *path, struct error *err);
/** Where "#MODEL/NAME" begins in a path that is no file itself; NULL: nowhere. */
const char *rec_path_mark(const char *path);
#endif
