/* exr.h -- radiance maps as OpenEXR files, with the identity of what they were made from. */
#ifndef GONIOCAM_EXR_H
#define GONIOCAM_EXR_H

#include "capture.h"

#define EXR_CFA    "cfa"              // attribute of a mosaic: its cell, "RGGB"
#define EXR_CHROMA "goniocam:chroma"  // attribute where photosites share their colour: how many

/** What a map's file tells besides pixels; texts may be NULL. */
struct exr_header {
    int width, height, channels;  // channels 3, or 1 with cfa
    const char *cfa, *inputs, *make, *model, *times;
    bool let_go;    // nobody will look at it soon: what is on the disk leaves memory
    int chroma[2];  // of struct photo
};

/** A map under construction. */
struct exr_writer;
/** Begin a file. On success end with exr_end(). */
enum status exr_begin(struct exr_writer **writer, const char *path, const struct exr_header *header,
                      struct error *err);
/** Row y of a map, [width][channels]. Any thread, in any order; each row once, all before the end.
 *  STATUS_IO, STATUS_MEMORY. */
enum status exr_put(struct exr_writer *writer, int y, const float *value, const float *variance,
                    struct error *err);
/** Give the file its name, or (keep false) leave nothing; frees the writer, which may be NULL. */
enum status exr_end(struct exr_writer *writer, bool keep, struct error *err);

/** Write a map; inputs (may be NULL) is kept in the file's attribute "goniocam:inputs". */
enum status exr_write(const struct radiance *map, const char *path, const char *inputs,
                      struct error *err);
/** Is path a complete map made from these inputs? False where it is anything else, or missing. */
bool exr_made_from(const char *path, const char *inputs);
#endif
