/* shapes.h -- rays against the few shapes a scene is made of, in closed form. */
#ifndef GONIOCAM_SAMPLES_SHAPES_H
#define GONIOCAM_SAMPLES_SHAPES_H

#include "capture.h"

/** Points origin + s direction, s > 0; direction is a unit vector. */
struct ray {
    vec3 origin, direction;
};

/** A crossing of a ray with a surface; s is INFINITY where there is none. The normal points out of
 *  the solid; face tells the faces of one solid apart (0: the curved or only one). */
struct crossing {
    double s;
    vec3 normal;
    int face;
};

/** A solid cylinder: its middle, unit axis, radius and half of its length. */
struct rod {
    vec3 center, axis;
    double radius, half;
};

/** A box: its middle, three unit axes at right angles, and half of its extent along each. */
struct box {
    vec3 center, axis[3];
    double half[3];
};

/** The first crossing with s > nearest from outside, or from inside through the far wall. A ray
 *  that starts on the surface does not see that surface again when `nearest` is above rounding. */
struct crossing sam_cross_sphere(struct ray ray, vec3 center, double radius, double nearest);
/** Faces: 0 the curved side, 1 the cap at -axis, 2 the cap at +axis. */
struct crossing sam_cross_rod(struct ray ray, const struct rod *rod, double nearest);
/** Faces: 2 k for the one at -axis[k], 2 k + 1 for the one at +axis[k]. */
struct crossing sam_cross_box(struct ray ray, const struct box *box, double nearest);
/** Where a ray meets the plane through `point` with a unit `normal`: s, or INFINITY where it runs
 *  along the plane or away from it. */
double sam_cross_plane(struct ray ray, vec3 point, vec3 normal, double nearest);

/** p on the ray at s. */
static inline vec3 sam_at(struct ray ray, double s)
{
    return vec3_add(ray.origin, vec3_scale(ray.direction, s));
}
/** Unit vectors x, y that make a right-handed frame with the unit vector z; continuous but at one
 *  direction. Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 2017. */
void sam_frame(vec3 z, vec3 *x, vec3 *y);
#endif
