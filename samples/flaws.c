/* flaws.c -- what a sample may be that a BRDF does not describe.
 *
 * Stains.   Caps about directions from the sample's centre, spread by the golden angle, take
 *           their part of the light, with soft edges.
 * Grain.    f times 1 + g cos(2 phi), phi the azimuth of h about the normal from the axis: a
 *           brushed surface in its simplest form.
 */
#include "flaws.h"

enum { STAINS = 20 };

static vec3 axis_of(const struct sample_place *place)
{
    return place->shape == SHAPE_CYLINDER ? vec3_normalize(place->axis) : (vec3){0, 0, 1};
}

// How deep in a stain a place is, [0, 1].
static double stained(vec3 out)
{
    const double golden = 2.39996322972865332, cosine = 0.97, soft = 0.01;
    double most = 0;
    for (int i = 0; i < STAINS; i++) {
        double z = 1 - 2 * (i + 0.5) / STAINS, flat = sqrt(1 - z * z), turn = i * golden;
        double near = vec3_dot(out, (vec3){flat * cos(turn), flat * sin(turn), z});
        most = fmax(most, fmin(1, (near - cosine) / soft));
    }
    return most;
}

double sam_flawed(const struct flaws *flaws, const struct sample_place *place, vec3 point,
                  vec3 normal, vec3 wi, vec3 wo)
{
    double f = 1;
    if (flaws->spots > 0)
        f *= 1 - flaws->spots * stained(vec3_normalize(vec3_sub(point, place->center)));
    vec3 x = vec3_cross(axis_of(place), normal), h = vec3_add(wi, wo);
    double c = vec3_dot(h, x), s = vec3_dot(h, vec3_cross(normal, x)), r2 = c * c + s * s;
    if (flaws->grain > 0 && r2 > 0)
        f *= 1 + flaws->grain * (c * c - s * s) / r2;
    return f;
}
