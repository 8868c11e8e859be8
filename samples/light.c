/* light.c -- lamps: points, balls, distant ones; fixed in the world or on the camera.
 *
 * Method.   A point: I / r^2. A ball of radius a that radiates evenly fills a cone of half angle
 *           asin(a / r) with constant radiance I / (pi a^2); n directions, spread over the cone by
 *           the golden angle in equal steps of the cosine, carry equal parts of it (H. Vogel's
 *           spiral, Mathematical Biosciences 1979, on a sphere's cap).
 * Accuracy. A ball's light on a matt surface that sees all of it, n = 16: better than 1e-4; its
 *           penumbra has n steps.
 */
#include "light.h"

#include "shapes.h"

#include <assert.h>

struct lighting sam_lighting(const struct scene *scene, const struct scene_shot *shot)
{
    const struct scene_lamp *lamp = &scene->lamp[shot->lamp];
    struct lighting light = {.kind = lamp->kind,
                             .position = lamp->position,
                             .radius = lamp->radius,
                             .direction = lamp->direction,
                             .beam = lamp->beam,
                             .beam_exponent = lamp->beam_exponent};
    if (lamp->on_camera) {  // its place, direction and beam are the camera's
        mat3 r = cal_rotation(shot->view_from_world.rotation);
        vec3 p = vec3_sub(lamp->position, shot->view_from_world.translation);
        light.position = mat3_mul_t(&r, p);
        light.direction = mat3_mul_t(&r, lamp->direction);
        light.beam = mat3_mul_t(&r, lamp->beam);
    }
    for (int c = 0; c < 3; c++)
        light.intensity[c] = lamp->intensity[c] * shot->power;
    return light;
}

/** What fall-off leaves of a lamp's light in the direction -wi: cos^exponent about its beam. */
static double falloff(const struct lighting *light, vec3 wi)
{
    if (light->beam_exponent == 0)
        return 1;
    double cosine = -vec3_dot(light->beam, wi);
    return cosine > 0 ? pow(cosine, light->beam_exponent) : 0;
}

/** Direction i of n that are spread evenly over the cone of a given cosine about z. */
static vec3 in_cone(vec3 z, double cosine, int i, int n)
{
    static const double GOLDEN_ANGLE = 2.39996322972865332;  // pi (3 - sqrt 5)
    if (n == 1)
        return z;
    double cos_t = 1 - (1 - cosine) * (i + 0.5) / n, sin_t = sqrt(fmax(0, 1 - cos_t * cos_t));
    vec3 x, y;
    sam_frame(z, &x, &y);
    vec3 across = vec3_add(vec3_scale(x, sin_t * cos(i * GOLDEN_ANGLE)),
                           vec3_scale(y, sin_t * sin(i * GOLDEN_ANGLE)));
    return vec3_add(vec3_scale(z, cos_t), across);
}

struct incidence sam_light_part(const struct lighting *light, vec3 point, int i, int n)
{
    assert(i >= 0 && i < n);
    struct incidence in = {.wi = light->direction, .distance = INFINITY};
    double weight = 1;
    if (light->kind == LAMP_POINT) {
        vec3 to = vec3_sub(light->position, point);
        // A point inside a lamp does not occur in scenes that are read; from 0.999 of its radius
        // the cone would open to a half space.
        double r = vec3_length(to), sine = fmin(light->radius / r, 0.999);
        in.wi = vec3_scale(to, 1 / r);
        in.distance = r;
        weight = falloff(light, in.wi) / (r * r);
        if (light->radius > 0) {
            double cosine = sqrt(1 - sine * sine);
            in.wi = in_cone(in.wi, cosine, i, n);
            in.distance = n == 1 ? r : r * cosine;  // of the rim; nothing stands nearer than that
            // radiance x solid angle of the cone: I / (pi a^2) x 2 pi (1 - cos), cancellation-free
            weight *= n == 1 ? 1 : 2 / (1 + cosine);
        }
    }
    for (int c = 0; c < 3; c++)
        in.irradiance[c] = light->intensity[c] * weight / n;
    return in;
}
