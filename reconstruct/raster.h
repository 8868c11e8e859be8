/* raster.h -- where the rays of a view's photosites meet a mesh, looked up once. */
#ifndef GONIOCAM_RASTER_H
#define GONIOCAM_RASTER_H

#include "strip.h"

/** What the ray of one photosite's centre meets. */
struct raster_cell {
    float point[3], normal[3];  // point: from the sample's centre
    bool hit, shadowed;         // shadowed: the mesh itself keeps the lamp's light off
};

/** The photosites of a box, and one more each way. Owns cell; {0} is empty; rec_raster_free(). */
struct raster {
    struct raster_cell *cell;  // [rows][columns], the first at (x0, y0)
    int x0, y0, columns, rows;
};

/** Trace a view of a mesh. STATUS_MEMORY. */
enum status rec_raster_make(struct raster *raster, const struct viewing *viewing, pixel_box box,
                            struct error *err);
void rec_raster_free(struct raster *raster);

/** Photosites of a strip on a mesh, with the mesh's derivatives from one photosite to the next. */
struct patches {
    struct meetings center;
    vec3_lanes point_by[2], normal_by[2];  // by x and y of the pixel
    double shadowed[LANES];                // the photosite's own; 1 or 0
    double rim[LANES];   // 1: one of the eight around is off the surface: past an edge, or a crease
    double dusk[LANES];  // 1: one of them is in shadow
    double curvature[LANES];  // 1/mm
};
void rec_raster_patches(struct patches *patches, const struct raster *raster,
                        const struct viewing *viewing, int x0, int y);
/** Meetings of an offset (du, dv) from the photosites' centres, |du| and |dv| at most a half. */
void rec_patches_meet(struct meetings *m, const struct patches *patches, double du, double dv,
                      lane_span span);

#endif
