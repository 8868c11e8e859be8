/* microfacet.c -- Fresnel, GGX and Beckmann distributions, separable Smith shadowing.
 *
 * Source.   B. Walter, S. Marschner, H. Li, K. Torrance, "Microfacet Models for Refraction through
 *           Rough Surfaces", EGSR 2007; C. Schlick, "An Inexpensive BRDF Model for Physically-based
 *           Rendering", Eurographics 1994.
 * Accuracy. A few roundings. The distributions take sin^2 and cos^2 of theta_h from parts of
 *           wi + wo: 1 - cos^2 would lose all digits in the highlight of a smooth surface.
 */
#include "microfacet.h"

#include <assert.h>

facet rec_facet(vec3 wi, vec3 wo)
{
    assert(wi.z > 0 && wo.z > 0);
    vec3 sum = vec3_add(wi, wo);
    double length2 = vec3_dot(sum, sum);
    return (facet){
        .cos_i = wi.z,
        .cos_o = wo.z,
        .sin2_h = (sum.x * sum.x + sum.y * sum.y) / length2,
        .cos2_h = sum.z * sum.z / length2,
        .c = vec3_dot(wi, sum) / sqrt(length2),
    };
}

double rec_fresnel_dielectric(double c, double ior)
{
    assert(ior >= 1);
    double g = sqrt(ior * ior - 1 + c * c);
    double a = (g - c) / (g + c);
    double b = (c * (g + c) - 1) / (c * (g - c) + 1);
    return 0.5 * a * a * (1 + b * b);
}

double rec_schlick(double c)
{
    double m = 1 - c, m2 = m * m;
    return m2 * m2 * m;
}

double rec_ggx_g1_over_cos(double cosine, double alpha)
{
    double cos2 = cosine * cosine;
    return 2 / (cosine + sqrt(cos2 + alpha * alpha * fmax(0, 1 - cos2)));
}

double rec_lobe_ggx(facet a, double alpha)
{
    double a2 = alpha * alpha;
    double q = a.cos2_h * a2 + a.sin2_h;
    double d = a2 / (CAP_PI * q * q);
    return 0.25 * d * rec_ggx_g1_over_cos(a.cos_i, alpha) * rec_ggx_g1_over_cos(a.cos_o, alpha);
}

// Walter's rational approximation of Smith's G1 for Beckmann slopes, equation 27: within 0.35 %.
static double beckmann_g1(double cosine, double alpha)
{
    double sine = sqrt(fmax(0, 1 - cosine * cosine));
    if (cosine >= 1.6 * alpha * sine)
        return 1;
    double k = cosine / (alpha * sine);
    return k * (3.535 + 2.181 * k) / (1 + k * (2.276 + 2.577 * k));
}

double rec_lobe_beckmann(facet a, double alpha)
{
    double a2 = alpha * alpha;
    double d = exp(-a.sin2_h / (a.cos2_h * a2)) / (CAP_PI * a2 * a.cos2_h * a.cos2_h);
    return d * beckmann_g1(a.cos_i, alpha) * beckmann_g1(a.cos_o, alpha) / (4 * a.cos_i * a.cos_o);
}
