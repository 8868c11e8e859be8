/* sample_errors.c -- what a wrong calibration does to a reflectance sample.
 *
 * Method.   f = L / (light cos(theta_i)/r^2) moves as ln(cos(theta_i)/r^2) does, and with the
 * angles that it is filed under. Each is differentiated by the sample's centre and radius, the ray
 * (the pose), the lamp's place and strength; the sigmas of these are taken as independent. A step c
 * of the sample's centre makes the ray's point slide along the ray d so as to stay on the surface,
 * by d (n.c)/(n.d); the normal turns by the part of d (n.c)/(n.d) - c in which the surface is
 * curved, over the radius.
 */
#include "sample_errors.h"

static double square(double x)
{
    return x * x;
}

// Variance of g.x where the parts of x have these sigmas.
static double variance(vec3 g, const double sigma[3])
{
    return square(g.x * sigma[0]) + square(g.y * sigma[1]) + square(g.z * sigma[2]);
}

// What is left of a vector where the surface curves: all on a sphere, nothing along a cylinder.
static vec3 curved(const struct sample *s, vec3 w)
{
    if (s->shape != SHAPE_CYLINDER)
        return w;
    vec3 axis = vec3_normalize(s->axis);
    return vec3_sub(w, vec3_scale(axis, vec3_dot(w, axis)));
}

// Gradient of w.n by the sample's centre.
static vec3 by_center(const struct sample *s, vec3 w, vec3 n, vec3 d)
{
    vec3 c = curved(s, w);
    vec3 g = vec3_sub(vec3_scale(n, vec3_dot(c, d) / vec3_dot(n, d)), c);
    return vec3_scale(g, 1 / s->radius);
}

// Derivative of w.n by the radius: the point slides by d/(n.d), n' = n + (slide - n)/R.
static double by_radius(const struct sample *s, vec3 w, vec3 n, vec3 d)
{
    vec3 c = curved(s, w);
    return (vec3_dot(c, d) / vec3_dot(n, d) - vec3_dot(c, n)) / s->radius;
}

// Variance of a quantity with these derivatives by the sample's place: centre, ray and radius.
static double place_variance(const struct viewing *v, vec3 center, double radius)
{
    return variance(center, v->sample->sigma_center) + square(v->shake) * vec3_dot(center, center)
           + square(radius * v->sample->sigma_radius);
}

// Gradient of ln(cos(theta_i)/r^2) by the lamp's position; none for a lamp at infinity.
static vec3 by_lamp(const struct viewing *v, const footprint *a, double cos_i)
{
    if (v->lamp->at_infinity)
        return (vec3){0, 0, 0};
    vec3 g = vec3_sub(vec3_scale(a->normal, 1 / cos_i), vec3_scale(a->wi, 3));
    return vec3_scale(g, 1 / a->distance);
}

static double systematic(const struct viewing *v, const footprint *a)
{
    vec3 n = a->normal, d = vec3_scale(a->wo, -1);
    double cos_i = vec3_dot(n, a->wi), n_d = vec3_dot(n, d);
    vec3 lamp = by_lamp(v, a, cos_i);
    // The point nears the lamp as it slides: the lamp's gradient, backwards, along d/(n.d).
    double near = -vec3_dot(lamp, d) / n_d;
    vec3 center =
        vec3_add(vec3_scale(by_center(v->sample, a->wi, n, d), 1 / cos_i), vec3_scale(n, near));
    double radius = by_radius(v->sample, a->wi, n, d) / cos_i + near;
    double lamp_variance = v->lamp->at_infinity
                               ? variance(n, v->lamp->sigma_direction) / square(cos_i)
                               : variance(lamp, v->lamp->sigma_position);
    return sqrt(place_variance(v, center, radius) + lamp_variance + square(v->dimming));
}

// theta_h turns as n does along h's tangent; where h is n, along any.
static double tilt(const struct viewing *v, const footprint *a)
{
    vec3 n = a->normal, d = vec3_scale(a->wo, -1), h = vec3_normalize(vec3_add(a->wi, a->wo));
    vec3 out = vec3_sub(h, vec3_scale(n, vec3_dot(h, n)));
    if (vec3_length(out) < 1e-9)
        out = vec3_cross(n, fabs(n.x) < 0.7 ? (vec3){1, 0, 0} : (vec3){0, 1, 0});
    vec3 tangent = vec3_normalize(out);
    return sqrt(place_variance(v, by_center(v->sample, tangent, n, d),
                               by_radius(v->sample, tangent, n, d)));
}

shared_errors rec_shared_errors(const struct viewing *viewing, const footprint *spot)
{
    return (shared_errors){systematic(viewing, spot), tilt(viewing, spot)};
}
