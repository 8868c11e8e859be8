/* microfacet.c -- Fresnel, GGX and Beckmann distributions, Smith shadowing, and derivatives.
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

double rec_fresnel_slope(double c, double ior, double *by_ior)
{
    double g = fmax(1e-12, sqrt(ior * ior - 1 + c * c));
    double a = (g - c) / (g + c), down = c * (g - c) + 1, b = (c * (g + c) - 1) / down;
    double a_by_g = 2 * c / ((g + c) * (g + c)), b_by_g = 2 * c * (1 - c * c) / (down * down);
    *by_ior = (a * a_by_g * (1 + b * b) + a * a * b * b_by_g) * ior / g;
    return rec_fresnel_dielectric(c, ior);
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

// D of GGX.
static double ggx_slopes(facet a, double alpha)
{
    double a2 = alpha * alpha, q = a.cos2_h * a2 + a.sin2_h;
    return a2 / (CAP_PI * q * q);
}

// d ln D / d alpha of GGX.
static double ggx_slopes_by_alpha(facet a, double alpha)
{
    return 2 / alpha - 4 * a.cos2_h * alpha / (a.cos2_h * alpha * alpha + a.sin2_h);
}

double rec_lobe_ggx(facet a, double alpha)
{
    return 0.25 * ggx_slopes(a, alpha) * rec_ggx_g1_over_cos(a.cos_i, alpha)
           * rec_ggx_g1_over_cos(a.cos_o, alpha);
}

// d ln G1 / d alpha of GGX, from G1/cos = 2 / (cos + root).
static double ggx_g1_by_alpha(double cosine, double alpha)
{
    double cos2 = cosine * cosine, sin2 = fmax(0, 1 - cos2);
    double root = sqrt(cos2 + alpha * alpha * sin2);
    return -alpha * sin2 / (root * (cosine + root));
}

double rec_lobe_ggx_slope(facet a, double alpha, double *by_alpha)
{
    double lobe = rec_lobe_ggx(a, alpha);
    *by_alpha = lobe
                * (ggx_slopes_by_alpha(a, alpha) + ggx_g1_by_alpha(a.cos_i, alpha)
                   + ggx_g1_by_alpha(a.cos_o, alpha));
    return lobe;
}

// cos (1 + 2 Lambda) = sqrt(cos^2 + alpha^2 sin^2) of GGX.
static double ggx_root(double cosine, double alpha)
{
    double cos2 = cosine * cosine;
    return sqrt(cos2 + alpha * alpha * fmax(0, 1 - cos2));
}

// E. Heitz, "Understanding the Masking-Shadowing Function", JCGT 2014, equation 99.
double rec_lobe_correlated(facet a, double alpha)
{
    double roots = a.cos_o * ggx_root(a.cos_i, alpha) + a.cos_i * ggx_root(a.cos_o, alpha);
    return 0.5 * ggx_slopes(a, alpha) / roots;
}

double rec_lobe_correlated_slope(facet a, double alpha, double *by_alpha)
{
    double root_i = ggx_root(a.cos_i, alpha), root_o = ggx_root(a.cos_o, alpha);
    double roots = a.cos_o * root_i + a.cos_i * root_o;
    double by_roots = alpha
                      * (a.cos_o * fmax(0, 1 - a.cos_i * a.cos_i) / root_i
                         + a.cos_i * fmax(0, 1 - a.cos_o * a.cos_o) / root_o);
    double lobe = 0.5 * ggx_slopes(a, alpha) / roots;
    *by_alpha = lobe * (ggx_slopes_by_alpha(a, alpha) - by_roots / roots);
    return lobe;
}

// Normalised as in Burley 2012, appendix B: gamma = 2 is GGX.
double rec_lobe_gtr(facet a, double alpha, double gamma)
{
    double a2 = alpha * alpha, e = 1 - gamma, rest = a2 - 1;
    double whole = fabs(rest) < 1e-9 ? 1
                   : fabs(e) < 1e-9  ? log(a2) / rest
                                     : expm1(e * log(a2)) / (e * rest);
    double d = pow(a.cos2_h * a2 + a.sin2_h, -gamma) / (CAP_PI * whole);
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

// d ln G1 / d alpha, dk/dalpha = -k/alpha.
static double beckmann_g1_by_alpha(double cosine, double alpha)
{
    double sine = sqrt(fmax(0, 1 - cosine * cosine));
    if (cosine >= 1.6 * alpha * sine)
        return 0;
    double k = cosine / (alpha * sine);
    double up = k * (3.535 + 2.181 * k), down = 1 + k * (2.276 + 2.577 * k);
    return -k / alpha * ((3.535 + 2 * 2.181 * k) / up - (2.276 + 2 * 2.577 * k) / down);
}

double rec_lobe_beckmann(facet a, double alpha)
{
    double a2 = alpha * alpha;
    double d = exp(-a.sin2_h / (a.cos2_h * a2)) / (CAP_PI * a2 * a.cos2_h * a.cos2_h);
    return d * beckmann_g1(a.cos_i, alpha) * beckmann_g1(a.cos_o, alpha) / (4 * a.cos_i * a.cos_o);
}

double rec_lobe_beckmann_slope(facet a, double alpha, double *by_alpha)
{
    double lobe = rec_lobe_beckmann(a, alpha);
    double by_d = 2 * a.sin2_h / (a.cos2_h * alpha * alpha * alpha) - 2 / alpha;
    *by_alpha =
        lobe * (by_d + beckmann_g1_by_alpha(a.cos_i, alpha) + beckmann_g1_by_alpha(a.cos_o, alpha));
    return lobe;
}
