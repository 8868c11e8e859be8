/* tiff_write.h -- 16-bit RGB TIFF, and DNG, with EXIF. */
#ifndef GONIOCAM_SAMPLES_TIFF_WRITE_H
#define GONIOCAM_SAMPLES_TIFF_WRITE_H

#include "scene.h"

/** Write dn [height][width][3], compressed without loss (deflate, predictor), with what a camera
 *  writes of itself and the exposure time in seconds. dn is used up: libtiff may work in place.
 *  The file appears whole or not at all.
 *  STATUS_IO. */
enum status sam_tiff_write(const char *path, uint16_t *dn, int width, int height,
                           const struct exif *exif, double seconds, struct error *err);
/** Write a mosaic dn [height][width] as an uncompressed DNG with the sensor's levels and filters.
 *  STATUS_IO. */
enum status sam_dng_write(const char *path, uint16_t *dn, int width, int height,
                          const struct exif *exif, double seconds,
                          const struct sensor_model *sensor, struct error *err);
#endif
