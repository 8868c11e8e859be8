/* light.h -- lamps: what reaches a point from a lamp, and from where. */
#ifndef GONIOCAM_SAMPLES_LIGHT_H
#define GONIOCAM_SAMPLES_LIGHT_H

#include "scene.h"

/** The lamp as one shot has it, in the world. */
struct lighting {
    enum lamp_kind kind;
    vec3 position;        // of a point or a ball
    double radius;        // of a ball, else 0
    vec3 direction;       // towards a distant lamp; unit
    double intensity[3];  // with the shot's power; of a distant lamp, the irradiance
    vec3 beam;            // where a lamp with fall-off points to; unit
    double beam_exponent;
};

/** Light at a point from one direction: radiance is f irradiance cos(theta_i). */
struct incidence {
    vec3 wi;               // unit, towards the lamp
    double distance;       // to the lamp; INFINITY for a distant one
    double irradiance[3];  // on a surface at right angles to wi
};

/** How many directions stand for a ball: where all of it is seen, and in its penumbra. One for
 *  the other kinds. */
enum { LIGHT_SAMPLES = 16, LIGHT_SAMPLES_PENUMBRA = 96 };

struct lighting sam_lighting(const struct scene *scene, const struct scene_shot *shot);
/** The i-th of n equal parts of what comes from the lamp. A ball's parts are directions spread
 *  evenly over the cone that it fills, or its middle when n is 1; each carries 1/n of the light. */
struct incidence sam_light_part(const struct lighting *light, vec3 point, int i, int n);
#endif
