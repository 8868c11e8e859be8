/* lens.h -- derivatives of the camera model, for solvers inside calib/. */
#ifndef GONIOCAM_LENS_H
#define GONIOCAM_LENS_H

#include "calib.h"

#ifdef __cplusplus
extern "C" {
#endif

/** The numbers of a camera that are estimated, in this order: fx fy cx cy k1 k2 p1 p2 k3. */
enum { LENS_PARAMETERS = 9 };
void lens_to_array(double parameters[LENS_PARAMETERS], const struct camera *camera);
void lens_from_array(struct camera *camera, const double parameters[LENS_PARAMETERS]);

/** Distorted from undistorted normalised coordinates; by_x [2][2] (may be NULL): d out / d in. */
void lens_distort(const double distortion[5], const double x[2], double out[2], double by_x[2][2]);
/** The inverse, by Newton's method: to 1e-12 where lens_distort is invertible; beyond its fold
 *  the nearest that was met, always finite. */
void lens_undistort(const double distortion[5], const double distorted[2], double x[2]);

/** cal_project from an array of parameters, with derivatives by the point and the parameters
 *  (each may be NULL). Requires p_view.z > 0. */
void lens_project(const double parameters[LENS_PARAMETERS], vec3 p_view, double pixel[2],
                  double by_point[2][3], double by_parameter[2][LENS_PARAMETERS]);

/** rotation * p with its derivative by the rotation vector (Gallego and Yezzi, "A compact formula
 *  for the derivative of a 3-D rotation in exponential coordinates", 2015). */
vec3 lens_rotate(vec3 rotation, vec3 p, double by_rotation[3][3]);

#ifdef __cplusplus
}
#endif
#endif
