/* render.h -- a scene becomes a capture folder. */
#ifndef GONIOCAM_SAMPLES_RENDER_H
#define GONIOCAM_SAMPLES_RENDER_H

#include "scene.h"

/** Write all photographs of a scene, the flat frame and radiance maps it asks for, truth.json and
 *  last capture.yaml. Every file appears whole or not at all. The same bytes at any number of
 *  threads. STATUS_IO (also when `out` holds other photographs already), STATUS_MEMORY. */
enum status sam_render(const struct scene *scene, const char *out, struct run *run,
                       struct error *err);
#endif
