/* start.h -- first values of cameras and poses, for the bundle. */
#ifndef GONIOCAM_START_H
#define GONIOCAM_START_H

#include "bundle.h"

/** Give every camera of the bundle a focal length (centre: the middle; no distortion) and every
 *  view a pose. Requires at least one sighting in each view. STATUS_SOLVER, STATUS_MEMORY. */
enum status start_cameras(const struct bundle *bundle, struct error *err);
/** Solve the pose of each view again with the cameras as they are now, and keep it where it
 *  explains the view's tags better: cures views that began in the wrong one of two mirrored poses.
 */
enum status start_poses_again(const struct bundle *bundle, struct error *err);

#endif
