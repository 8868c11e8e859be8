/* polar.h -- directions in rings about an axis, dense near it. */
#ifndef GONIOCAM_SAMPLES_POLAR_H
#define GONIOCAM_SAMPLES_POLAR_H

#include "calib.h"

/** Rings from the axis to POLAR_WIDEST, in even steps of ln(angle + finest), rad: a lobe of any
 *  width from `finest` up is met by many. */
enum { POLAR_RINGS = 36, POLAR_SPOKES = 20, POLAR_DIRECTIONS = POLAR_RINGS * POLAR_SPOKES };
static const double POLAR_WIDEST = CAP_PI;

/** Direction k of POLAR_DIRECTIONS about the axis z of a frame; unit. Its share of the sphere, in
 *  sr, is 1 / sam_polar_density(). */
vec3 sam_polar_direction(double finest, int k, vec3 x, vec3 y, vec3 z);
/** Directions a sr in a unit direction. */
double sam_polar_density(double finest, vec3 direction, vec3 z);
/** The weight of a sample of density `own` where another rule has samples of density `other` of
 *  the same integral: the two weights there add up to 1, and the denser one's is near 1.
 *  E. Veach and L. Guibas, "Optimally Combining Sampling Techniques", SIGGRAPH 1995. */
double sam_rule_weight(double own, double other);
#endif
