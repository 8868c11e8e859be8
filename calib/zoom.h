/* zoom.h -- a lens that was zoomed or focused anew between photographs. Internal to calib/. */
#ifndef GONIOCAM_ZOOM_H
#define GONIOCAM_ZOOM_H

#include "bundle.h"

/** Where the views of a camera without a prior clearly want different focal lengths, in groups of
 *  three or more, each group becomes a camera of its own, with a warning. Views of no group go to
 *  the nearest. STATUS_MEMORY. */
enum status zoom_split(struct bundle *bundle, struct run *run, struct error *err);
#endif
