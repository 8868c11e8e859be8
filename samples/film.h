/* film.h -- the radiance image of one shot. */
#ifndef GONIOCAM_SAMPLES_FILM_H
#define GONIOCAM_SAMPLES_FILM_H

#include "world.h"

/** Mean radiance over every pixel of a shot into value [height][width][3]. The same bits at any
 *  number of threads. STATUS_MEMORY. */
enum status sam_film_expose(const struct world *world, const struct scene_shot *shot, int threads,
                            float *value, struct error *err);
#endif
