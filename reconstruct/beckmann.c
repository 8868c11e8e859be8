/* beckmann.c -- plastic with Gaussian slopes: a matt body under a rough dielectric surface.
 *
 *      f = albedo/pi + F(wi.h; ior) D(h) G / (4 cos_i cos_o)
 *
 * beckmann takes separable Smith shadowing (Walter's approximation), cook_torrance that of V-shaped
 * grooves, G = min(1, 2 n.h cos_i / (wi.h), 2 n.h cos_o / (wo.h)). As in ggx.c, the body is not
 * attenuated by what the surface reflects.
 */
#include "lobes.h"
#include "models.h"

enum { ALBEDO = 0, ALPHA = 3, IOR = 4 };

static void combine(const double *parameters, facet a, double lobe, double f[3])
{
    double gloss = rec_fresnel_dielectric(a.c, parameters[IOR]) * lobe;
    for (int c = 0; c < 3; c++)
        f[c] = parameters[ALBEDO + c] / CAP_PI + gloss;
}

static void eval_beckmann(const double *parameters, vec3 wi, vec3 wo, double f[3])
{
    facet a = rec_facet(wi, wo);
    combine(parameters, a, rec_lobe_beckmann(a, parameters[ALPHA]), f);
}

// V-shaped grooves, and the slopes' derivative by alpha.
static double cook_torrance(facet a, double alpha, double *by_alpha)
{
    double a2 = alpha * alpha, tan2 = a.sin2_h / a.cos2_h;
    double d = exp(-tan2 / a2) / (CAP_PI * a2 * a.cos2_h * a.cos2_h);
    double g = fmin(1, 2 * sqrt(a.cos2_h) * fmin(a.cos_i, a.cos_o) / a.c);
    double lobe = d * g / (4 * a.cos_i * a.cos_o);
    *by_alpha = 2 * lobe * (tan2 / a2 - 1) / alpha;
    return lobe;
}

static void eval_cook_torrance(const double *parameters, vec3 wi, vec3 wo, double f[3])
{
    facet a = rec_facet(wi, wo);
    double by_alpha;
    combine(parameters, a, cook_torrance(a, parameters[ALPHA], &by_alpha), f);
}

static void slopes_beckmann(const double *parameters, vec3 wi, vec3 wo, double f[3], double *slope)
{
    facet a = rec_facet(wi, wo);
    double by_alpha, lobe = rec_lobe_beckmann_slope(a, parameters[ALPHA], &by_alpha);
    rec_plastic_slopes(parameters, a, lobe, by_alpha, f, slope);
}

static void slopes_cook_torrance(const double *parameters, vec3 wi, vec3 wo, double f[3],
                                 double *slope)
{
    facet a = rec_facet(wi, wo);
    double by_alpha, lobe = cook_torrance(a, parameters[ALPHA], &by_alpha);
    rec_plastic_slopes(parameters, a, lobe, by_alpha, f, slope);
}

static int lobes(const double *parameters, vec3 wi, struct lobe *lobe)
{
    double gloss = rec_fresnel_dielectric(wi.z, parameters[IOR]);
    int n = rec_lobe_body(lobe, parameters + ALBEDO);
    lobe[n] = rec_lobe(LOBE_BECKMANN, gloss, parameters[ALPHA], 0);
    return n + 1;
}

static const struct parameter parameters[] = {
    {"albedo", 3, 0, 1}, {"alpha", 1, 1e-3, 1}, {"ior", 1, 1, 4}, {0}};

const struct model rec_model_beckmann = {
    .name = "beckmann",
    .source = "Beckmann slopes after Walter et al., EGSR 2007; dielectric Fresnel over Lambert",
    .parameter = parameters,
    .eval = eval_beckmann,
    .slopes = slopes_beckmann,
    .lobes = lobes,
};

const struct model rec_model_cook_torrance = {
    .name = "cook_torrance",
    .source = "Cook and Torrance, ACM TOG 1982, with 1/4; dielectric Fresnel over Lambert",
    .parameter = parameters,
    .eval = eval_cook_torrance,
    .slopes = slopes_cook_torrance,
    .lobes = lobes,
};
