/* png_write.h -- 16-bit RGB PNG with EXIF. */
#ifndef GONIOCAM_SAMPLES_PNG_WRITE_H
#define GONIOCAM_SAMPLES_PNG_WRITE_H

#include "scene.h"

/** Write dn [height][width][3] as it is, linear. The file appears whole or not at all. STATUS_IO,
 *  STATUS_MEMORY. */
enum status sam_png_write(const char *path, const uint16_t *dn, int width, int height,
                          const struct exif *exif, double seconds, struct error *err);
#endif
