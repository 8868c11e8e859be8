/* rays.h -- the rays of a strip's photosites, to the sample and on to the lamp. */
#ifndef GONIOCAM_RAYS_H
#define GONIOCAM_RAYS_H

#include "raster.h"

/** Rays on their way: directions and irradiance where they meet the sample. */
struct ray_ends {
    struct meetings m;
    vec3_lanes ray, wi;
    double distance[LANES], cos_i[LANES], irradiance[LANES];
};

/** Where the rays of a strip come from and go to. */
struct pencil {
    const struct viewing *v;
    struct lens_row lens;
    struct patches mesh;  // of a mesh
};

/** Rays of an offset (du, dv) from the centres of a span's photosites, in photosites. */
void rec_trace(struct ray_ends *ends, const struct pencil *pencil, double du, double dv,
               lane_span span);

#endif
