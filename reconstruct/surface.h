/* surface.h -- where rays meet the sample, in closed form. */
#ifndef GONIOCAM_SURFACE_H
#define GONIOCAM_SURFACE_H

#include "lanes.h"

/** A ray's first meeting with the sample. */
typedef struct {
    bool hit;
    vec3 point, normal;  // where hit; the normal is outward and unit
} meeting;

/** The ray eye + s direction (unit). Requires the eye outside the sample. */
meeting rec_meet(const struct sample *sample, vec3 eye, vec3 direction);

/** Meetings of rays from one eye. Where a ray misses, point and normal are numbers without
 *  meaning. */
struct meetings {
    vec3_lanes point, normal;
    double hit[LANES];  // 1 or 0
};
/** The rays of a span; of a sphere or cylinder. */
void rec_meet_all(struct meetings *m, const struct sample *sample, vec3 eye, const vec3_lanes *ray,
                  lane_span span);

#endif
