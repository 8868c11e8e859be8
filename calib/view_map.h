/* view_map.h -- the radiance map of a view. Internal to calib/. */
#ifndef GONIOCAM_VIEW_MAP_H
#define GONIOCAM_VIEW_MAP_H

#include "calib.h"

/** Read OUT/radiance/NAME.exr of a view, and take the veil off that its glare tells of. On success
 * the caller owns *map. */
enum status cal_view_map(struct radiance *map, const char *out, const struct view *view,
                         struct error *err);

/** Channels of a photosite that were measured: all three, or the one of a mosaic's photosite; 0:
 *  saturated in every frame, in some channel. at: index of its first value in the map. */
int cal_measured(const struct radiance *map, size_t at, bool measured[3]);
/** Mean of the channels and its variance; in a mosaic, of the photosite and what its neighbours
 *  say of the other two. false: saturated. */
bool cal_gray(const struct radiance *map, size_t at, double *value, double *variance);
#endif
