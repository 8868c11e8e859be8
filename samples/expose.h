/* expose.h -- radiance becomes the numbers of a photograph. */
#ifndef GONIOCAM_SAMPLES_EXPOSE_H
#define GONIOCAM_SAMPLES_EXPOSE_H

#include "scene.h"

/** What vignetting leaves at a pixel: V = 1 + v1 q + v2 q^2 + v3 q^3, q the squared distance from
 *  the camera's centre in units of half the diagonal. */
double sam_vignetting(const struct scene *scene, double x, double y);
/** Expose value [height][width][3], radiance, for `seconds` into dn [height][width][3]:
 *
 *      DN = clip(round(black + (min(Poisson(L g k t V), full_well) + read_noise N(0, 1)) gain))
 *
 *  `frame` names the photograph: frames of one seed have independent noise. */
void sam_sensor_expose(const struct scene *scene, const float *value, double seconds,
                       uint32_t frame, uint16_t *dn);
/** A photograph of an evenly bright wall that fills the well to `fill` in the middle. */
void sam_sensor_flat(const struct scene *scene, double fill, uint32_t frame, uint16_t *dn);
#endif
