/* optics.h -- what the lens does to the radiance image: point spread and veiling glare. */
#ifndef GONIOCAM_SAMPLES_OPTICS_H
#define GONIOCAM_SAMPLES_OPTICS_H

#include "scene.h"

/** Blur value [height][width][3] and veil it, in place. STATUS_MEMORY. */
enum status sam_optics_apply(const struct scene *scene, int threads, float *value,
                             struct error *err);
#endif
