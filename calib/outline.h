/* outline.h -- the outline of a sphere in one photograph, edge by edge. Internal to calib/. */
#ifndef GONIOCAM_OUTLINE_H
#define GONIOCAM_OUTLINE_H

#include "calib.h"

#ifdef __cplusplus
extern "C" {
#endif

/** A place where the sample ends in a photograph. */
struct edge {
    int view;
    double pixel[2];
    double sigma_px;  // across the outline
};

/** Where a sphere ends, seen from one place: the rays at `half_angle` from `axis`. */
struct cone {
    vec3 eye, axis, u, v;  // u, v: unit, normal to the axis and each other
    double half_angle;
};
/** Requires the eye outside the sphere. */
struct cone cal_outline_cone(vec3 eye, vec3 center, double radius);
/** The unit ray at angle `from_axis` and azimuth `phi` about the axis, in the world. */
vec3 cal_cone_ray(const struct cone *cone, double from_axis, double phi);
/** Pixel of a world direction seen from a view's eye; false: behind the camera. */
bool cal_direction_pixel(const struct camera *camera, const mat3 *view_from_world, vec3 direction,
                         double pixel[2]);

/** Find the edges of a sphere, nominally at center, in one map, within `search` pixels of the
 *  outline predicted for it. fine: by the limb model of outline.c, unbiased, within 2.5 pixels;
 *  else by the steepest step. Appends to *edges (realloc'd; the caller owns it) and *count.
 *  STATUS_MEMORY only: an outline that is not there gives no edges. */
enum status cal_outline_edges(struct edge **edges, int *count, const struct radiance *map,
                              const struct camera *camera, const struct view *view, int view_index,
                              vec3 center, double radius, double search, bool fine,
                              struct error *err);

#ifdef __cplusplus
}
#endif
#endif
