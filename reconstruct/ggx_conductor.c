/* ggx_conductor.c -- bare metal: GGX facets with the exact Fresnel reflectance of a conductor.
 *
 *      f = F(wi.h; eta, k) D(h) G / (4 cos_i cos_o)
 *
 * Smith shadowing, separable or height-correlated; eta - i k is the complex refractive index in
 * each channel, against air.
 */
#include "lobes.h"
#include "models.h"

enum { ETA = 0, K = 3, ALPHA = 6 };

/** Unpolarised reflectance; k = 0 is a dielectric's. The refracted ray has (a - i b)^2 =
 *  (eta - i k)^2 - sin^2 (Born and Wolf, Principles of Optics, section 14.2). */
static double fresnel_conductor(double c, double eta, double k)
{
    double cos2 = c * c, sin2 = fmax(0, 1 - cos2);
    double real = eta * eta - k * k - sin2;
    double modulus = hypot(real, 2 * eta * k);  // a^2 + b^2
    double twice_ac = 2 * c * sqrt(fmax(0, 0.5 * (modulus + real)));
    double s = (modulus + cos2 - twice_ac) / (modulus + cos2 + twice_ac);
    double sum = cos2 * modulus + sin2 * sin2, cross = twice_ac * sin2;
    return 0.5 * s * (1 + (sum - cross) / (sum + cross));
}

static void combine(const double *parameters, facet a, double lobe, double f[3])
{
    for (int c = 0; c < 3; c++)
        f[c] = lobe * fresnel_conductor(a.c, parameters[ETA + c], parameters[K + c]);
}

static void eval(const double *parameters, vec3 wi, vec3 wo, double f[3])
{
    facet a = rec_facet(wi, wo);
    combine(parameters, a, rec_lobe_ggx(a, parameters[ALPHA]), f);
}

static void eval_correlated(const double *parameters, vec3 wi, vec3 wo, double f[3])
{
    facet a = rec_facet(wi, wo);
    combine(parameters, a, rec_lobe_correlated(a, parameters[ALPHA]), f);
}

static int lobes(const double *parameters, vec3 wi, struct lobe *lobe)
{
    (void)wi;
    *lobe = rec_lobe(LOBE_VISIBLE, 1, parameters[ALPHA], 0);
    return 1;
}

static const struct parameter parameters[] = {
    {"eta", 3, 0.01, 10}, {"k", 3, 0, 30}, {"alpha", 1, 1e-3, 1}, {0}};

const struct model rec_model_ggx_conductor = {
    .name = "ggx_conductor",
    .source = "Walter et al., EGSR 2007; Fresnel of conductors, Born and Wolf",
    .parameter = parameters,
    .eval = eval,
    .lobes = lobes,
};

const struct model rec_model_ggx_conductor_correlated = {
    .name = "ggx_conductor_correlated",
    .source = "Walter et al., EGSR 2007; Heitz, JCGT 2014; Fresnel of conductors, Born and Wolf",
    .parameter = parameters,
    .eval = eval_correlated,
    .lobes = lobes,
};
