/* strip.h -- photosites of a row on their way to samples, side by side. */
#ifndef GONIOCAM_STRIP_H
#define GONIOCAM_STRIP_H

#include "lens_table.h"
#include "consensus.h"
#include "surface.h"

/** The photosites (x0 + i, y), i < LANES; those outside [from, to) are no business of this strip.
 *  x0 is a multiple of LANES. Vectors are in the world; what the photosite averages is so weighted
 *  by irradiance (footprint.c). */
struct strip {
    int x0, y, from, to;
    lane_span use;          // lanes that are still in use lie in it, others have no meaning
    float hit[LANES];       // 1: the centre's ray meets the sample; or 0
    float inner[LANES];     // 1: outline and terminator are some photosites away; or 0
    enum fate fate[LANES];  // all that follows has a meaning where this is FATE_USED
    vec3_lanes point;       // at the photosite's centre
    vec3f_lanes normal, wi, wo;
    float distance[LANES];    // from the lamp, mm
    float irradiance[LANES];  // mean of cos(theta_i) / r^2, or of cos(theta_i)
    float curvature[LANES];   // of the surface, 1/mm
    float spread[2][LANES];   // variance of n over the photosite, rad^2: towards h, and across
    float disc[LANES];        // variance of wi over the lamp's disc, rad^2 each way
    float theta_h[LANES], theta_d[LANES], phi_d[LANES];
    int bin[LANES];                        // rec_merl_index of these
    float systematic[LANES], tilt[LANES];  // see reflectance_sample, also for what follows
    int channel[LANES];
    // Of a mosaic: the other channels' f and noise are those between its neighbours, where it
    // lends.
    int lends[LANES];  // 1 or 0
    float f[3][LANES], noise[3][LANES], bounced[3][LANES];
    float doubt[LANES];  // 1 sigma of the photosite's bounced light, a part of it
    float weight[LANES];
    bool compared;  // what follows has a meaning
    comparison unlike[LANES];
};

/** Look only at lanes that are still in use, from now on; false: there are none. */
static inline bool rec_strip_narrow(struct strip *s)
{
    float used[LANES];
    for (int i = 0; i < LANES; i++)
        used[i] = s->fate[i] == FATE_USED ? 1 : 0;
    s->use = rec_lanes_marked(used);
    return s->use.end > 0;
}

/** All that a strip's photosites measure: x0, y, from and to say which they are. */
void rec_strip_make(struct strip *strip, const struct viewing *viewing, const struct radiance *map);
/** One of them. */
reflectance_sample rec_strip_sample(const struct strip *strip, int lane);

/** The parts of rec_strip_make. Where photosites lie on the sample: fate, hit, and all up to spread
 *  (footprint.c); what stands in the way of used ones (samples.c); half and difference angles, and
 * bin (strip_angles.c); systematic and tilt (sample_errors.c); channel, f, noise, bounced, doubt
 * (strip_read.c). */
void rec_strip_footprints(struct strip *strip, const struct viewing *viewing);
void rec_strip_block(struct strip *strip, const struct viewing *viewing);
void rec_strip_angles(struct strip *strip);
void rec_strip_errors(struct strip *strip, const struct viewing *viewing);
void rec_strip_read(struct strip *strip, const struct viewing *viewing, const struct radiance *map);

/** Blocks in use that lie in the image as a whole; what is left may go beyond its end. */
static inline lane_span rec_strip_whole(const struct strip *s, const struct radiance *map)
{
    const int left = map->width - s->x0, whole = left < LANES ? left & -BLOCK : LANES;
    const int end = s->use.end < whole ? s->use.end : whole;
    return (lane_span){s->use.first, end > s->use.first ? end : s->use.first};
}

/** Does the board or a blocker stand between the camera and a place on the sample? */
bool rec_occluded(const struct viewing *viewing, vec3 point);

#endif
