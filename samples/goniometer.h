/* goniometer.h -- the BRDF of a patch of explicit geometry, by counting the light that leaves it.
 */
#ifndef GONIOCAM_SAMPLES_GONIOMETER_H
#define GONIOCAM_SAMPLES_GONIOMETER_H

#include "surface.h"

/** What became of the light, as parts of what arrived, mean of the channels. */
struct light_balance {
    double out, absorbed;
    double lost;  // left the patch sideways or below, or bounced too often
};
/** Measure a surface: an isotropic table, a value in every bin above the horizon (method:
 *  goniometer.c). The same at any number of threads. STATUS_MEMORY. */
enum status sam_goniometer(struct merl *table, struct light_balance *balance,
                           const struct surface *surface, struct run *run, struct error *err);
#endif
