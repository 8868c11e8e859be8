/* expose.h -- radiance becomes the numbers of a photograph. */
#ifndef GONIOCAM_SAMPLES_EXPOSE_H
#define GONIOCAM_SAMPLES_EXPOSE_H

#include "scene.h"

/** What vignetting leaves at a pixel: V = 1 + v1 q + v2 q^2 + v3 q^3, q the squared distance from
 *  the camera's centre in units of half the diagonal. */
double sam_vignetting(const struct scene *scene, double x, double y);
/** Channels of a photograph as the sensor reads it: 1 with a mosaic, else 3. */
static inline int sam_channels(const struct scene *scene)
{
    return scene->sensor.mosaic ? 1 : 3;
}
/** How long photograph `frame` is really exposed, where EXIF will say `seconds`. */
double sam_true_time(const struct scene *scene, double seconds, uint32_t frame);
/** Expose value [height][width][3], radiance, for `seconds` into dn [height][width][channels]:
 *
 *      DN = clip(round(black + (min(Poisson(L g k t V u + h t), full_well) + read_noise N(0, 1))
 * gain))
 *
 *  with the photosite's own sensitivity u and leak h, the same in all photographs. `frame` names
 *  the photograph: frames of one seed have independent noise. A NULL value is darkness. */
void sam_sensor_expose(const struct scene *scene, const float *value, double seconds,
                       uint32_t frame, uint16_t *dn);
/** A photograph of an evenly bright wall that fills the well to `fill` in the middle. */
void sam_sensor_flat(const struct scene *scene, double fill, uint32_t frame, uint16_t *dn);
#endif
