/* exif_block.h -- what a camera writes of itself and of a photograph. */
#ifndef GONIOCAM_SAMPLES_EXIF_BLOCK_H
#define GONIOCAM_SAMPLES_EXIF_BLOCK_H

#include "scene.h"

/** A JPEG's APP1 segment: "Exif", two zeros, and a TIFF of tags. free() *bytes; false: out of
 *  memory. */
bool sam_exif_block(const struct exif *exif, double seconds, unsigned char **bytes, unsigned *size);
#endif
