/* rgl.h -- the parameterization of RGL's .bsdf files (Dupuy and Jakob 2018). */
#ifndef GONIOCAM_RGL_H
#define GONIOCAM_RGL_H

#include "reconstruct.h"

/** Write `base`_rgb.bsdf and `base`_spec.bsdf of an isotropic BRDF: both, or neither. STATUS_IO,
 *  STATUS_MEMORY. */
enum status rec_rgl_write(const struct brdf *brdf, const char *base, struct run *run,
                          struct error *err);

/** u(theta), u(phi) of the unit square, and back. */
static inline double rec_rgl_u_theta(double theta)
{
    return sqrt(2 * theta / CAP_PI);
}
static inline double rec_rgl_theta(double u)
{
    return u * u * CAP_PI / 2;
}
static inline double rec_rgl_u_phi(double phi)
{
    double u = (phi + CAP_PI) / (2 * CAP_PI);
    return u - floor(u);
}
#endif
