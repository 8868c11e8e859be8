/* raster.h -- where the rays of a view's photosites meet a mesh, looked up once. */
#ifndef GONIOCAM_RASTER_H
#define GONIOCAM_RASTER_H

#include "strip.h"

/** What is known of a photosite's ray, a plane each. */
enum raster_plane {
    RASTER_POINT,  // from the sample's centre; three
    RASTER_NORMAL = RASTER_POINT + 3,
    RASTER_HIT = RASTER_NORMAL + 3,  // 1 or 0
    RASTER_SHADOWED,                 // 1: the mesh itself keeps the lamp's light off
    RASTER_RIM,  // 1: past an edge, or a crease, lies what the photosite has a part of: rec_reach()
    RASTER_DUSK,  // 1: in shadow does
    RASTER_PLANES
};

/** The photosites of a box's strips, and one more each way. Owns plane[0], which holds all; {0} is
 *  empty; rec_raster_free(). */
struct raster {
    float *plane[RASTER_PLANES];  // [rows][columns], the first at (x0, y0)
    int x0, y0, columns, rows;
};

/** Trace a view of a mesh. STATUS_MEMORY. */
enum status rec_raster_make(struct raster *raster, const struct viewing *viewing, pixel_box box,
                            struct error *err);
void rec_raster_free(struct raster *raster);

/** Fill RASTER_RIM and RASTER_DUSK, which were 0, of photosites that reach beyond their neighbours.
 *  STATUS_MEMORY. */
enum status rec_raster_spread(struct raster *raster, const struct viewing *viewing, pixel_box box,
                              struct error *err);

/** Photosites of a strip on a mesh, with the mesh's derivatives from one photosite to the next. */
struct patches {
    struct meetings center;
    vec3_lanes point_by[2], normal_by[2];  // by x and y of the pixel
    double shadowed[LANES];                // the photosite's own; 1 or 0
    // 1: one of the eight around, or as far as the photosite reaches, is off the surface: past an
    // edge, or a crease.
    double rim[LANES];
    double dusk[LANES];       // 1: one of them is in shadow
    double curvature[LANES];  // 1/mm
};
/** Of a span of the strip that begins at (x0, y), one of the box's. */
void rec_raster_patches(struct patches *patches, const struct raster *raster,
                        const struct viewing *viewing, int x0, int y, lane_span span);
/** Meetings of an offset (du, dv) from the photosites' centres, |du| and |dv| at most a half. */
void rec_patches_meet(struct meetings *m, const struct patches *patches, double du, double dv,
                      lane_span span);

#endif
