/* solid.h -- the sample as a solid: where rays meet it, what it hides. Internal to calib/. */
#ifndef GONIOCAM_SOLID_H
#define GONIOCAM_SOLID_H

#include "calib.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Where origin + s direction (unit), from outside, first meets the sample; s is INFINITY where it
 *  does not. The caps of a cylinder are not sample: there `cap` is true. */
typedef struct {
    double s;
    vec3 normal;
    bool cap;
} solid_hit;
solid_hit cal_solid_meet(const struct sample *sample, vec3 origin, vec3 direction);
/** Radius of the ball about sample->center that holds all of it. */
double cal_solid_reach(const struct sample *sample);
/** Does the way from a to b pass within `margin` of the sample? Either end may lie on it when
 *  margin is 0. Of a cylinder with a margin, a capsule is meant. */
bool cal_sample_between(const struct sample *sample, vec3 a, vec3 b, double margin);

/** The same of the balls beside it, and of all of them (balls.c). */
bool cal_ball_between(const struct calibration *calibration, vec3 a, vec3 b, double margin);
bool cal_in_the_way(const struct calibration *calibration, vec3 a, vec3 b, double margin);

/** Point k of SOLID_POINTS that are spread evenly over the surface, its normal, and the area that
 *  is its own. */
enum { SOLID_POINTS = 400 };
void cal_solid_point(const struct sample *sample, int k, vec3 *point, vec3 *normal, double *area);

/** Move the sample: turned about its centre by a rotation vector, then shifted. Of a mesh, its
 *  triangles, and the pose of its file. STATUS_MEMORY. */
enum status cal_solid_move(struct sample *sample, vec3 turn, vec3 shift, struct error *err);

/** Move the sample back to where it was when *to was copied from it. STATUS_MEMORY. */
enum status cal_solid_return(struct sample *sample, const struct sample *to, struct error *err);

/** Of a mesh (mesh.c): turn its triangles about the middle of their ball; and cal_solid_point. */
enum status cal_mesh_turn(struct mesh *mesh, const mat3 *rotation, struct error *err);
void cal_mesh_point(const struct mesh *mesh, int k, vec3 *point, vec3 *normal, double *area);
/** The rotation vector of a rotation matrix, of length below pi (solid.c). */
vec3 cal_rotation_vector(const mat3 *r);

#ifdef __cplusplus
}
#endif
#endif
