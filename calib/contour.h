/* contour.h -- the outline of a solid of any shape in one photograph. Internal to calib/. */
#ifndef GONIOCAM_CONTOUR_H
#define GONIOCAM_CONTOUR_H

#include "solid.h"

#ifdef __cplusplus
extern "C" {
#endif

/** A place on the outline as the sample's present place has it, and how it moves: when the surface
 *  at `point` moves by v, the outline moves outwards by px_per_mm (across.v) pixels. */
struct contour_point {
    double pixel[2], normal[2];  // outwards; unit
    double bend;                 // a step t along the outline leaves it bend t^2 outwards; 1/pixel
    vec3 point, across;          // world; across: unit
    double px_per_mm;
};

/** A place where the sample ends in a photograph, `off` pixels outwards from where the outline was
 *  expected. */
struct contour_edge {
    struct contour_point at;
    int view;
    double off, sigma_px;
};

/** Follow the outline of the sample in a view: places EDGE_PX apart or more, those left out where
 *  it turns sharply. The caller owns *point. STATUS_MEMORY. */
enum status cal_contour(struct contour_point **point, int *count, const struct sample *sample,
                        const struct camera *camera, const struct view *view, struct error *err);

/** Find the edges of the sample in one map, within `search` pixels of the outline. fine: by the
 *  limb model, within 2.5 pixels; else by the steepest step. The caller owns *edge.
 *  STATUS_MEMORY only: an outline that is not there gives no edges. */
enum status cal_contour_edges(struct contour_edge **edge, int *count, const struct radiance *map,
                              const struct sample *sample, const struct camera *camera,
                              const struct view *view, int view_index, double search, bool fine,
                              struct error *err);

#ifdef __cplusplus
}
#endif
#endif
