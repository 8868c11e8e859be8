/* footprint.h -- what a photosite spans on the sample: mean directions and irradiance. */
#ifndef GONIOCAM_FOOTPRINT_H
#define GONIOCAM_FOOTPRINT_H

#include "samples.h"
#include "surface.h"

/** The patch of surface that a photosite averages. Vectors are in the world. */
typedef struct {
    vec3 point;           // at the photosite's centre
    vec3 normal, wi, wo;  // unit; means weighted by irradiance
    double distance;      // from the lamp, mm
    double spread[2];     // variance of n over the photosite, rad^2: towards h, and across
    double irradiance;    // mean of cos(theta_i) / r^2, or of cos(theta_i) for a lamp at infinity
} footprint;

/** FATE_USED and *spot, or why there is none; *hit: the centre's ray meets the sample. */
enum fate rec_footprint(footprint *spot, const struct viewing *viewing, double u, double v,
                        bool *hit);

#endif
