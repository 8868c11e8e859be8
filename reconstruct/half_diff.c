/* half_diff.c -- directions to half/difference angles, and back.
 *
 * Method.   Ry and Rz of the definition turn the frame (x, y, z) into (t, b, h), so
 *           d = (wi.t, wi.b, wi.h); the sines and cosines in t and b are ratios of h.
 * Accuracy. Rounding only, about 1e-16 rad, also in the highlight (theta_h -> 0), where
 *           acos(h.z) would be off by 1e-8: a rounding e in h.z moves it by sqrt(2 e).
 */
#include "brdf.h"

#include <assert.h>

half_diff rec_half_diff(vec3 wi, vec3 wo)
{
    assert(wi.z > 0 && wo.z > 0);
    vec3 h = vec3_normalize(vec3_add(wi, wo));
    double sin_theta_h = sqrt(h.x * h.x + h.y * h.y), cos_theta_h = h.z;
    double cos_phi_h = sin_theta_h > 0 ? h.x / sin_theta_h : 1;
    double sin_phi_h = sin_theta_h > 0 ? h.y / sin_theta_h : 0;
    vec3 t = {cos_theta_h * cos_phi_h, cos_theta_h * sin_phi_h, -sin_theta_h};
    vec3 b = {-sin_phi_h, cos_phi_h, 0};
    vec3 d = {vec3_dot(wi, t), vec3_dot(wi, b), vec3_dot(wi, h)};
    return (half_diff){
        .theta_h = atan2(sin_theta_h, cos_theta_h),
        .theta_d = atan2(sqrt(d.x * d.x + d.y * d.y), d.z),
        .phi_d = atan2(d.y, d.x),
    };
}

// A vector in the frame of h, whose azimuth is 0, into the frame of the surface: Ry(theta_h).
static vec3 from_half(vec3 d, double sin_theta_h, double cos_theta_h)
{
    return (vec3){cos_theta_h * d.x + sin_theta_h * d.z, d.y,
                  cos_theta_h * d.z - sin_theta_h * d.x};
}

void rec_directions(half_diff angles, vec3 *wi, vec3 *wo)
{
    double s = sin(angles.theta_d), c = cos(angles.theta_d);
    double x = s * cos(angles.phi_d), y = s * sin(angles.phi_d);
    double sin_theta_h = sin(angles.theta_h), cos_theta_h = cos(angles.theta_h);
    *wi = from_half((vec3){x, y, c}, sin_theta_h, cos_theta_h);
    *wo = from_half((vec3){-x, -y, c}, sin_theta_h, cos_theta_h);
}
