/* bounce_sum.h -- the lit board's light at one place of the sample, through a table. */
#ifndef GONIOCAM_BOUNCE_SUM_H
#define GONIOCAM_BOUNCE_SUM_H

#include "lookup.h"
#include "samples.h"

/** What a table does to the board's light. */
struct bounce_through {
    const struct lookup *table;  // borrowed
    double gloss;                // theta_h at which its lobe has fallen to half; pi/2: it has none
};
struct bounce_through rec_bounce_through(const struct lookup *table);

/** Radiance that comes by way of the board, and the standard deviation of its mean over channels
 *  by what cells do not tell of the board, as a part of it. */
struct bounced_light {
    double radiance[3], doubt;
};
/** The sum over cells [count] at a point with a unit normal towards wo: for power and strength 1
 *  (method: bounce_sum.c). Requires wo above the horizon. */
struct bounced_light rec_bounce_sum(const struct bounce_through *through, const struct glow *cell,
                                    int count, vec3 point, vec3 normal, vec3 wo);

#endif
