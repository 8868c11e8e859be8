/* flaws.h -- what a sample may be that a BRDF does not describe: stained, grained. */
#ifndef GONIOCAM_FLAWS_H
#define GONIOCAM_FLAWS_H

#include "capture.h"

/** {0}: none. */
struct flaws {
    double spots;  // what stains take of the reflectance, [0, 1]
    double grain;  // f is 1 + grain cos(2 azimuth of h) times as large, [0, 1]
};

/** What flaws make of f at a point of a sample about a centre, whose grain runs along an axis
 *  (method: flaws.c). Does not change by swapping wi and wo. */
double sam_flawed(const struct flaws *flaws, const struct sample_place *place, vec3 point,
                  vec3 normal, vec3 wi, vec3 wo);

#endif
