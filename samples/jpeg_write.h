/* jpeg_write.h -- 8-bit JPEG with EXIF. */
#ifndef GONIOCAM_SAMPLES_JPEG_WRITE_H
#define GONIOCAM_SAMPLES_JPEG_WRITE_H

#include "scene.h"

/** Develop dn [height][width][3] as a camera does, with the scene's tone curve, and write it:
 *
 *      8-bit = round(255 tone(clip((DN - black)/(adc_max - black)/(channel gain/largest gain))))
 *
 *  STATUS_IO, STATUS_MEMORY. */
enum status sam_jpeg_write(const char *path, const uint16_t *dn, const struct scene *scene,
                           double seconds, struct error *err);
#endif
