/* schlick.c -- coloured gloss: metals, painted metals, and materials without a Fresnel effect.
 *
 *      f = albedo/pi + F(wi.h) D(h) G1(wi) G1(wo) / (4 cos_i cos_o)
 *      F = f0 + edge (1 - f0) (1 - wi.h)^5
 *
 * f0 is a colour, the reflectance at normal incidence; edge = 1 is Schlick's law, edge = 0 a lobe
 * of constant colour. The slopes are GGX or Beckmann of width alpha, the shadowing separable.
 */
#include "lobes.h"
#include "models.h"

enum { ALBEDO = 0, F0 = 3, ALPHA = 6, EDGE = 7 };

static void combine(const double *parameters, facet a, double lobe, double f[3])
{
    double rise = parameters[EDGE] * rec_schlick(a.c);
    for (int c = 0; c < 3; c++) {
        double f0 = parameters[F0 + c];
        f[c] = parameters[ALBEDO + c] / CAP_PI + (f0 + rise * (1 - f0)) * lobe;
    }
}

static void eval_ggx(const double *parameters, vec3 wi, vec3 wo, double f[3])
{
    facet a = rec_facet(wi, wo);
    combine(parameters, a, rec_lobe_ggx(a, parameters[ALPHA]), f);
}

static void eval_beckmann(const double *parameters, vec3 wi, vec3 wo, double f[3])
{
    facet a = rec_facet(wi, wo);
    combine(parameters, a, rec_lobe_beckmann(a, parameters[ALPHA]), f);
}

static int lobes(const double *parameters, vec3 wi, enum lobe_kind kind, struct lobe *lobe)
{
    double f0 = rec_mean(parameters + F0);
    double gloss = f0 + parameters[EDGE] * (1 - f0) * rec_schlick(wi.z);
    int n = rec_lobe_body(lobe, parameters + ALBEDO);
    lobe[n] = rec_lobe(kind, gloss, parameters[ALPHA], 0);
    return n + 1;
}

static int lobes_ggx(const double *parameters, vec3 wi, struct lobe *lobe)
{
    return lobes(parameters, wi, LOBE_VISIBLE, lobe);
}

static int lobes_beckmann(const double *parameters, vec3 wi, struct lobe *lobe)
{
    return lobes(parameters, wi, LOBE_BECKMANN, lobe);
}

static const struct parameter parameters[] = {
    {"albedo", 3, 0, 1}, {"f0", 3, 0, 1}, {"alpha", 1, 1e-3, 1}, {"edge", 1, 0, 1}, {0},
};

const struct model rec_model_ggx_schlick = {
    .name = "ggx_schlick",
    .source = "Walter et al., EGSR 2007; Schlick, Eurographics 1994",
    .parameter = parameters,
    .eval = eval_ggx,
    .lobes = lobes_ggx,
};

const struct model rec_model_beckmann_schlick = {
    .name = "beckmann_schlick",
    .source = "Beckmann slopes after Walter et al., EGSR 2007; Schlick, Eurographics 1994",
    .parameter = parameters,
    .eval = eval_beckmann,
    .lobes = lobes_beckmann,
};
