/* ggx.c -- plastic: a matte body under a rough dielectric surface.
 *
 *      f = albedo/pi + F(wi.h; ior) D(h) G1(wi) G1(wo) / (4 cos_i cos_o)
 *
 * GGX slopes of width alpha, separable Smith shadowing, exact Fresnel; the body is not attenuated
 * by what the surface reflects, so energy is conserved only while albedo + F <= 1.
 */
#include "lobes.h"
#include "models.h"

enum { ALBEDO = 0, ALPHA = 3, IOR = 4 };

static void eval(const double *parameters, vec3 wi, vec3 wo, double f[3])
{
    facet a = rec_facet(wi, wo);
    double gloss =
        rec_fresnel_dielectric(a.c, parameters[IOR]) * rec_lobe_ggx(a, parameters[ALPHA]);
    for (int c = 0; c < 3; c++)
        f[c] = parameters[ALBEDO + c] / CAP_PI + gloss;
}

static int lobes(const double *parameters, vec3 wi, struct lobe *lobe)
{
    double gloss = rec_fresnel_dielectric(wi.z, parameters[IOR]);
    int n = rec_lobe_body(lobe, parameters + ALBEDO);
    lobe[n] = rec_lobe(LOBE_VISIBLE, gloss, parameters[ALPHA], 0);
    return n + 1;
}

const struct model rec_model_ggx = {
    .name = "ggx",
    .source = "Walter et al., EGSR 2007; dielectric Fresnel over Lambert",
    .parameter =
        (const struct parameter[]){
            {"albedo", 3, 0, 1}, {"alpha", 1, 1e-3, 1}, {"ior", 1, 1, 4}, {0}},
    .eval = eval,
    .lobes = lobes,
};
