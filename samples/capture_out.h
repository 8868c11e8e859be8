/* capture_out.h -- capture.yaml of a rendered capture: what a person with a ruler would write. */
#ifndef GONIOCAM_SAMPLES_CAPTURE_OUT_H
#define GONIOCAM_SAMPLES_CAPTURE_OUT_H

#include "scene.h"

/** STATUS_IO, STATUS_MEMORY. */
enum status sam_capture_write(const struct scene *scene, const char *path, struct error *err);
#endif
