/* surface.h -- where a ray meets the sample, in closed form. */
#ifndef GONIOCAM_SURFACE_H
#define GONIOCAM_SURFACE_H

#include "calib.h"

/** A ray's first meeting with the sample. */
typedef struct {
    bool hit;
    vec3 point, normal;  // where hit; the normal is outward and unit
    double depth;        // > 0 where the ray's line cuts the surface: falls to 0 at the outline,
                         // smoothly and linearly in the pixel
} meeting;

/** The ray eye + s direction (unit). Requires the eye outside the sample. */
meeting rec_meet(const struct sample *sample, vec3 eye, vec3 direction);

#endif
