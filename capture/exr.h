/* exr.h -- radiance maps as OpenEXR files, with the identity of what they were made from. */
#ifndef GONIOCAM_EXR_H
#define GONIOCAM_EXR_H

#include "capture.h"

/** Write a map; inputs (may be NULL) is kept in the file's attribute "goniocam:inputs". */
enum status exr_write(const struct radiance *map, const char *path, const char *inputs,
                      struct error *err);
/** Is path a complete map made from these inputs? False where it is anything else, or missing. */
bool exr_made_from(const char *path, const char *inputs);
#endif
