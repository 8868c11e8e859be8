/* polar.c -- directions in rings about an axis, dense near it.
 *
 * Method.   With u = ln(1 + t/finest) / ln(1 + widest/finest) of the angle t, rings are at the
 *           middles of even steps of u; each is turned against the last, so that edges do not fall
 *           between spokes of all of them.
 */
#include "polar.h"

vec3 sam_polar_direction(double finest, int k, vec3 x, vec3 y, vec3 z)
{
    int ring = k / POLAR_SPOKES;
    double t = finest * expm1((ring + 0.5) / POLAR_RINGS * log1p(POLAR_WIDEST / finest));
    double phi = 2 * CAP_PI * (k % POLAR_SPOKES / (double)POLAR_SPOKES + 0.6180339887498949 * ring);
    vec3 across = vec3_add(vec3_scale(x, cos(phi)), vec3_scale(y, sin(phi)));
    return vec3_add(vec3_scale(z, cos(t)), vec3_scale(across, sin(t)));
}

double sam_polar_density(double finest, vec3 direction, vec3 z)
{
    double sine = vec3_length(vec3_cross(direction, z)), t = atan2(sine, vec3_dot(direction, z));
    double u_by_t = 1 / ((t + finest) * log1p(POLAR_WIDEST / finest));
    double across = t > 1e-9 ? sine : 1e-9;
    return t < POLAR_WIDEST ? POLAR_DIRECTIONS * u_by_t / (2 * CAP_PI * across) : 0;
}

double sam_rule_weight(double own, double other)
{
    return own * own / (own * own + other * other);
}
