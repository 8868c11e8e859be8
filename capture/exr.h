/* exr.h -- radiance maps as OpenEXR files, with the identity of what they were made from. */
#ifndef GONIOCAM_EXR_H
#define GONIOCAM_EXR_H

#include "capture.h"

#define EXR_CFA "cfa"  // attribute of a mosaic: its cell, "RGGB"

/** What a map's file tells besides pixels; texts may be NULL. */
struct exr_header {
    int width, height, channels;  // channels 3, or 1 with cfa
    const char *cfa, *inputs, *make, *model, *times;
};

/** A map under construction. */
struct exr_writer;
/** Begin a file. On success end with exr_end(). */
enum status exr_begin(struct exr_writer **writer, const char *path, const struct exr_header *header,
                      struct error *err);
/** Bytes of a packed row. */
size_t exr_line_size(const struct exr_header *header);
/** Row y of a map, [width][channels], as it stands in the file. Any thread. */
void exr_pack(unsigned char *packed, const struct exr_header *header, int y, const float *value,
              const float *variance);
/** Rows y and following, packed one after the other. Any thread, in any order; all rows must have
 *  been put before the end. STATUS_IO. */
enum status exr_put(const struct exr_writer *writer, const unsigned char *packed, int y, int rows,
                    struct error *err);
/** Give the file its name, or (keep false) leave nothing; frees the writer, which may be NULL. */
enum status exr_end(struct exr_writer *writer, bool keep, struct error *err);

/** Write a map; inputs (may be NULL) is kept in the file's attribute "goniocam:inputs". */
enum status exr_write(const struct radiance *map, const char *path, const char *inputs,
                      struct error *err);
/** Is path a complete map made from these inputs? False where it is anything else, or missing. */
bool exr_made_from(const char *path, const char *inputs);
#endif
