/* interchange.h -- calibrations for other programs. Internal to calib/. */
#ifndef GONIOCAM_INTERCHANGE_H
#define GONIOCAM_INTERCHANGE_H

#include "lens.h"

/** One camera as OpenCV's FileStorage reads it: camera_matrix, distortion_coefficients. */
enum status cal_write_opencv(const struct camera *camera, const char *path, struct error *err);
/** FOLDER/cameras.txt, images.txt, points3D.txt (empty): COLMAP's text model, FULL_OPENCV lenses.
 *  COLMAP counts pixels from the corner of the first one. The folder is made. */
enum status cal_write_colmap(const struct calibration *c, const char *folder, struct error *err);

/** COLMAP's text model, read into an empty calibration: FOLDER/cameras.txt and images.txt (views
 *  without lamps), or a cameras.txt alone. Lens models that are ours with terms left out are known.
 *  STATUS_IO, STATUS_FORMAT (file and line), STATUS_MEMORY. */
enum status colmap_read_model(struct calibration *c, const char *folder, struct error *err);
enum status colmap_read_cameras(struct calibration *c, const char *path, struct error *err);
/** Append a camera under a copy of that name. STATUS_FORMAT: its numbers are none of a camera. */
enum status cal_add_camera(struct calibration *c, const struct camera *camera, const char *name,
                           struct error *err);

/** Unit quaternion (w, x, y, z), w >= 0, of a rotation vector. */
void cal_quaternion(vec3 rotation, double q[4]);
#endif
