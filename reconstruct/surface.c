/* surface.c -- rays against a sphere and a cylinder: the nearer root of a quadratic.
 *
 * Accuracy. q, the discriminant, is a difference of numbers near |eye - center|^2: at a metre its
 *           rounding is 1e-10 mm^2, far below what a photosite spans at the outline.
 */
#include "surface.h"

#include <assert.h>

static meeting meet_sphere(const struct sample *s, vec3 eye, vec3 d)
{
    vec3 m = vec3_sub(eye, s->center);
    double b = vec3_dot(d, m);
    double q = b * b - (vec3_dot(m, m) - s->radius * s->radius);
    if (!(q > 0) || b > 0)
        return (meeting){.depth = b > 0 ? -1 : q};
    vec3 out = vec3_add(m, vec3_scale(d, -b - sqrt(q)));  // from the center
    return (meeting){.hit = true,
                     .point = vec3_add(s->center, out),
                     .normal = vec3_scale(out, 1 / s->radius),
                     .depth = q};
}

static vec3 across(vec3 v, vec3 axis)
{
    return vec3_sub(v, vec3_scale(axis, vec3_dot(v, axis)));
}

// The curved side only: the caps are not sample, and what enters through one has not met it.
static meeting meet_cylinder(const struct sample *s, vec3 eye, vec3 d)
{
    vec3 axis = vec3_normalize(s->axis), m = vec3_sub(eye, s->center);
    vec3 dp = across(d, axis), mp = across(m, axis);
    double a = vec3_dot(dp, dp), b = vec3_dot(dp, mp);
    double q = b * b - a * (vec3_dot(mp, mp) - s->radius * s->radius);
    if (!(q > 0) || b > 0 || !(a > 0))
        return (meeting){.depth = b > 0 ? -1 : q};
    vec3 out = vec3_add(m, vec3_scale(d, (-b - sqrt(q)) / a));
    double along = vec3_dot(out, axis);
    if (fabs(along) > s->height / 2)
        return (meeting){.depth = -1};
    return (meeting){.hit = true,
                     .point = vec3_add(s->center, out),
                     .normal = vec3_scale(across(out, axis), 1 / s->radius),
                     .depth = q};
}

meeting rec_meet(const struct sample *sample, vec3 eye, vec3 direction)
{
    assert(sample->shape == SHAPE_SPHERE || sample->shape == SHAPE_CYLINDER);
    return sample->shape == SHAPE_SPHERE ? meet_sphere(sample, eye, direction)
                                         : meet_cylinder(sample, eye, direction);
}
