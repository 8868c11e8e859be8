/* ggx.c -- plastic: a matte body under a rough dielectric surface.
 *
 *      f = albedo/pi + F(wi.h; ior) D(h) G / (4 cos_i cos_o)
 *
 * GGX slopes of width alpha, exact Fresnel; Smith shadowing, separable in ggx, height-correlated in
 * ggx_correlated. The body is not attenuated by what the surface reflects, so energy is conserved
 * only while albedo + F <= 1.
 */
#include "lobes.h"
#include "models.h"

enum { ALBEDO = 0, ALPHA = 3, IOR = 4, SIZE = 5 };

static void combine(const double *parameters, facet a, double lobe, double f[3])
{
    double gloss = rec_fresnel_dielectric(a.c, parameters[IOR]) * lobe;
    for (int c = 0; c < 3; c++)
        f[c] = parameters[ALBEDO + c] / CAP_PI + gloss;
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

void rec_plastic_slopes(const double *parameters, facet a, double lobe, double by_alpha,
                        double f[3], double *slope)
{
    double by_ior, fresnel = rec_fresnel_slope(a.c, parameters[IOR], &by_ior);
    for (int c = 0; c < 3; c++) {
        double *s = &slope[c * SIZE];
        for (int k = 0; k < 3; k++)
            s[ALBEDO + k] = k == c ? 1 / CAP_PI : 0;
        s[ALPHA] = fresnel * by_alpha;
        s[IOR] = by_ior * lobe;
        f[c] = parameters[ALBEDO + c] / CAP_PI + fresnel * lobe;
    }
}

static void slopes(const double *parameters, vec3 wi, vec3 wo, double f[3], double *slope)
{
    facet a = rec_facet(wi, wo);
    double by_alpha, lobe = rec_lobe_ggx_slope(a, parameters[ALPHA], &by_alpha);
    rec_plastic_slopes(parameters, a, lobe, by_alpha, f, slope);
}

static void slopes_correlated(const double *parameters, vec3 wi, vec3 wo, double f[3],
                              double *slope)
{
    facet a = rec_facet(wi, wo);
    double by_alpha, lobe = rec_lobe_correlated_slope(a, parameters[ALPHA], &by_alpha);
    rec_plastic_slopes(parameters, a, lobe, by_alpha, f, slope);
}

static int lobes(const double *parameters, vec3 wi, struct lobe *lobe)
{
    double gloss = rec_fresnel_dielectric(wi.z, parameters[IOR]);
    int n = rec_lobe_body(lobe, parameters + ALBEDO);
    lobe[n] = rec_lobe(LOBE_VISIBLE, gloss, parameters[ALPHA], 0);
    return n + 1;
}

static const struct parameter parameters[] = {
    {"albedo", 3, 0, 1}, {"alpha", 1, 1e-3, 1}, {"ior", 1, 1, 4}, {0}};

const struct model rec_model_ggx = {
    .name = "ggx",
    .source = "Walter et al., EGSR 2007; dielectric Fresnel over Lambert",
    .parameter = parameters,
    .eval = eval,
    .slopes = slopes,
    .lobes = lobes,
};

const struct model rec_model_ggx_correlated = {
    .name = "ggx_correlated",
    .source = "Walter et al., EGSR 2007; height-correlated Smith, Heitz, JCGT 2014",
    .parameter = parameters,
    .eval = eval_correlated,
    .slopes = slopes_correlated,
    .lobes = lobes,
};
