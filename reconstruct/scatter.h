/* scatter.h -- a BRDF known at scattered pairs of directions. */
#ifndef GONIOCAM_SCATTER_H
#define GONIOCAM_SCATTER_H

#include "reconstruct.h"

enum { SCATTER_AXES = 4 };

/** One measurement, and its place among the others (set by rec_scatter_brdf). */
struct scattered {
    vec3 wi, wo;
    double f[3];
    double place[SCATTER_AXES];
};

/** A BRDF from measurements [count], which it takes over; it frees them too where it fails. Between
 *  them f is a mean of the nearest, weighted by distance in half/difference angles; at each it is
 *  the measured value (or the mean of several in one place). An isotropic surface without grain is
 *  taken for granted. STATUS_MEMORY; STATUS_FORMAT: no measurement above the horizon. */
enum status rec_scatter_brdf(struct brdf *brdf, struct scattered *sample, int count,
                             const char *path, struct error *err);
#endif
