/* view_map.h -- the radiance map of a view. Internal to calib/. */
#ifndef GONIOCAM_VIEW_MAP_H
#define GONIOCAM_VIEW_MAP_H

#include "calib.h"

/** Read OUT/radiance/NAME.exr of a view. On success the caller owns *map. */
enum status cal_view_map(struct radiance *map, const char *out, const struct view *view,
                         struct error *err);
#endif
