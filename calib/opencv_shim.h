/* opencv_shim.h -- the pose of a camera from points, by OpenCV. */
#ifndef GONIOCAM_OPENCV_SHIM_H
#define GONIOCAM_OPENCV_SHIM_H

#include "calib.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Pose from points [count][3] in the world and their normalised coordinates [count][2], freed of
 *  lens distortion: the best by SQPnP (globally optimal; points may lie in a plane), in front of
 *  the camera. *rms (normalised units) is of the reprojection. Requires count >= 4.
 *  STATUS_SOLVER: no pose, or OpenCV throws. */
enum status opencv_pose(pose *view_from_world, double *rms, double (*point)[3],
                        double (*normalised)[2], int count, struct error *err);

/** The two poses of a square of that side in the camera's frame (p_view = R p_tag + t, its corners
 *  at +-side/2, its z towards the viewer) from its four corners, in the order of struct seen_tag:
 *  the better one first (IPPE: T. Collins and A. Bartoli, "Infinitesimal Plane-Based Pose
 *  Estimation", 2014). STATUS_SOLVER. */
enum status opencv_square(pose view_from_tag[2], double side, double (*normalised)[2],
                          struct error *err);

#ifdef __cplusplus
}
#endif
#endif
