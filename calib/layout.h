/* layout.h -- a board whose layout nobody measured, from the size of its tags. Internal to calib/.
 */
#ifndef GONIOCAM_LAYOUT_H
#define GONIOCAM_LAYOUT_H

#include "bundle.h"

/** Find the places of all tags with `unplaced`, and with them a focal length for every camera
 *  without a prior and a pose for every view: a start for the bundle. The world is that of the tags
 *  that are placed; where there are none, that of the tag with the lowest id, which becomes placed:
 *  it lies in the origin, with the axes of its print. Tags that no view ties to the others keep no
 *  place (bundle_placed), and so do views: their pose is left at the origin and posed[v] is false.
 *  STATUS_DATA: no two views share tags. STATUS_SOLVER, STATUS_MEMORY. */
enum status layout_start(const struct bundle *bundle, bool *posed, struct error *err);
#endif
