/* interchange.h -- calibrations for other programs. Internal to calib/. */
#ifndef GONIOCAM_INTERCHANGE_H
#define GONIOCAM_INTERCHANGE_H

#include "calib.h"

/** One camera as OpenCV's FileStorage reads it: camera_matrix, distortion_coefficients. */
enum status cal_write_opencv(const struct camera *camera, const char *path, struct error *err);
/** FOLDER/cameras.txt, images.txt, points3D.txt (empty): COLMAP's text model, FULL_OPENCV lenses.
 *  COLMAP counts pixels from the corner of the first one. The folder is made. */
enum status cal_write_colmap(const struct calibration *c, const char *folder, struct error *err);

/** Unit quaternion (w, x, y, z), w >= 0, of a rotation vector. */
void cal_quaternion(vec3 rotation, double q[4]);
#endif
