/* overlay_photograph.h -- the photograph under an overlay. Internal to calib/. */
#ifndef GONIOCAM_OVERLAY_PHOTOGRAPH_H
#define GONIOCAM_OVERLAY_PHOTOGRAPH_H

#include "capture.h"

#include <cairo.h>

/** Paint a map on a surface (RGB24, of width / n x height / n pixels), n x n photosites a pixel.
 *  The level that 2 % of the values exceed becomes white. false: no memory. */
bool cal_overlay_photograph(cairo_surface_t *surface, const struct radiance *map, int n);

#endif
