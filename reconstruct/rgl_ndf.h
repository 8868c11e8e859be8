/* rgl_ndf.h -- the distribution of normals that an RGL file is built on. */
#ifndef GONIOCAM_RGL_NDF_H
#define GONIOCAM_RGL_NDF_H

#include "reconstruct.h"

enum {
    RGL_NDF = 181
};  // nodes, even in u(theta) = sqrt(2 theta / pi): two for each of MERL's bins

/** D(theta) at the nodes, 1/sr, linear in u between them: above 0 everywhere, and its projected
 * area straight down, the integral of D cos(theta), is 1. */
void rec_rgl_ndf(double ndf[RGL_NDF], const struct brdf *brdf);
/** Its projected area towards theta: the integral of D max(0, wi.m) over the normals m. */
double rec_rgl_projected_area(const double ndf[RGL_NDF], double theta);
#endif
