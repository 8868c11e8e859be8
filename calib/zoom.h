/* zoom.h -- a lens that was zoomed or focused anew between photographs. Internal to calib/. */
#ifndef GONIOCAM_ZOOM_H
#define GONIOCAM_ZOOM_H

#include "bundle.h"

/** Where a camera without a prior clearly had another focal length from some photograph on, in the
 *  order of their names, the later ones become a camera of their own, with a warning; three views a
 *  camera are the least. STATUS_MEMORY. */
enum status zoom_split(struct bundle *bundle, struct run *run, struct error *err);
#endif
