/* hemisphere.h -- directions over a hemisphere, for sums of what a surface returns. */
#ifndef GONIOCAM_HEMISPHERE_H
#define GONIOCAM_HEMISPHERE_H

#include "brdf.h"

typedef void hemisphere_visitor(void *user, vec3 wi, vec3 wo, double weight);

/** Visit directions wo above the horizon for light from theta_i (radians, below pi/2), some 30000,
 *  with weights by which f sums up to the directional albedo: the sum of weight f is the integral
 *  of f cos(theta_o). */
void rec_hemisphere(double theta_i, hemisphere_visitor *visit, void *user);

#endif
