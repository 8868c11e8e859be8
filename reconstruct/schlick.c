/* schlick.c -- coloured gloss: metals, painted metals, and materials without a Fresnel effect.
 *
 *      f = albedo/pi + sum of F(wi.h) D(h) G / (4 cos_i cos_o)         over one lobe or two
 *      F = f0 + edge (1 - f0) (1 - wi.h)^5
 *
 * f0 is a colour, the reflectance at normal incidence; edge = 1 is Schlick's law, edge = 0 a lobe
 * of constant colour. The slopes are GGX or Beckmann of width alpha, the shadowing Smith's,
 * separable or height-correlated. ggx2 has two GGX lobes, the second of f0_2, alpha_2 and edge_2.
 */
#include "lobes.h"
#include "models.h"

// Of a lobe, from its first parameter on.
enum { ALBEDO = 0, LOBE = 3, F0 = 0, ALPHA = 3, EDGE = 4, LOBE_SIZE = 5 };

typedef double shape(facet a, double alpha);
typedef double shape_slope(facet a, double alpha, double *by_alpha);

static void eval(const double *parameters, vec3 wi, vec3 wo, shape *of, int lobes, double f[3])
{
    facet a = rec_facet(wi, wo);
    double schlick = rec_schlick(a.c);
    for (int c = 0; c < 3; c++)
        f[c] = parameters[ALBEDO + c] / CAP_PI;
    for (int l = 0; l < lobes; l++) {
        const double *v = parameters + LOBE + l * LOBE_SIZE;
        double lobe = of(a, v[ALPHA]), rise = v[EDGE] * schlick;
        for (int c = 0; c < 3; c++)
            f[c] += (v[F0 + c] + rise * (1 - v[F0 + c])) * lobe;
    }
}

static void slopes(const double *parameters, vec3 wi, vec3 wo, shape_slope *of, int lobes,
                   double f[3], double *slope)
{
    const int size = LOBE + lobes * LOBE_SIZE;
    facet a = rec_facet(wi, wo);
    double schlick = rec_schlick(a.c);
    for (int k = 0; k < 3 * size; k++)
        slope[k] = 0;
    for (int c = 0; c < 3; c++) {
        f[c] = parameters[ALBEDO + c] / CAP_PI;
        slope[c * size + ALBEDO + c] = 1 / CAP_PI;
    }
    for (int l = 0; l < lobes; l++) {
        const double *v = parameters + LOBE + l * LOBE_SIZE;
        double by_alpha, lobe = of(a, v[ALPHA], &by_alpha), rise = v[EDGE] * schlick;
        for (int c = 0; c < 3; c++) {
            double *s = &slope[c * size + LOBE + l * LOBE_SIZE];
            double fresnel = v[F0 + c] + rise * (1 - v[F0 + c]);
            f[c] += fresnel * lobe;
            s[F0 + c] = (1 - rise) * lobe;
            s[ALPHA] = fresnel * by_alpha;
            s[EDGE] = schlick * (1 - v[F0 + c]) * lobe;
        }
    }
}

static int lobes_of(const double *parameters, vec3 wi, enum lobe_kind kind, int lobes,
                    struct lobe *lobe)
{
    int n = rec_lobe_body(lobe, parameters + ALBEDO);
    for (int l = 0; l < lobes; l++) {
        const double *v = parameters + LOBE + l * LOBE_SIZE;
        double f0 = rec_mean(v + F0), gloss = f0 + v[EDGE] * (1 - f0) * rec_schlick(wi.z);
        lobe[n++] = rec_lobe(kind, gloss, v[ALPHA], 0);
    }
    return n;
}

static void eval_ggx(const double *parameters, vec3 wi, vec3 wo, double f[3])
{
    eval(parameters, wi, wo, rec_lobe_ggx, 1, f);
}
static void slopes_ggx(const double *parameters, vec3 wi, vec3 wo, double f[3], double *slope)
{
    slopes(parameters, wi, wo, rec_lobe_ggx_slope, 1, f, slope);
}
static int lobes_ggx(const double *parameters, vec3 wi, struct lobe *lobe)
{
    return lobes_of(parameters, wi, LOBE_VISIBLE, 1, lobe);
}

static void eval_correlated(const double *parameters, vec3 wi, vec3 wo, double f[3])
{
    eval(parameters, wi, wo, rec_lobe_correlated, 1, f);
}
static void slopes_correlated(const double *parameters, vec3 wi, vec3 wo, double f[3],
                              double *slope)
{
    slopes(parameters, wi, wo, rec_lobe_correlated_slope, 1, f, slope);
}

static void eval_beckmann(const double *parameters, vec3 wi, vec3 wo, double f[3])
{
    eval(parameters, wi, wo, rec_lobe_beckmann, 1, f);
}
static void slopes_beckmann(const double *parameters, vec3 wi, vec3 wo, double f[3], double *slope)
{
    slopes(parameters, wi, wo, rec_lobe_beckmann_slope, 1, f, slope);
}
static int lobes_beckmann(const double *parameters, vec3 wi, struct lobe *lobe)
{
    return lobes_of(parameters, wi, LOBE_BECKMANN, 1, lobe);
}

static void eval_two(const double *parameters, vec3 wi, vec3 wo, double f[3])
{
    eval(parameters, wi, wo, rec_lobe_ggx, 2, f);
}
static void slopes_two(const double *parameters, vec3 wi, vec3 wo, double f[3], double *slope)
{
    slopes(parameters, wi, wo, rec_lobe_ggx_slope, 2, f, slope);
}
static int lobes_two(const double *parameters, vec3 wi, struct lobe *lobe)
{
    return lobes_of(parameters, wi, LOBE_VISIBLE, 2, lobe);
}

static const struct parameter parameters[] = {
    {"albedo", 3, 0, 1}, {"f0", 3, 0, 1}, {"alpha", 1, 1e-3, 1}, {"edge", 1, 0, 1}, {0},
};

const struct model rec_model_ggx_schlick = {
    .name = "ggx_schlick",
    .source = "Walter et al., EGSR 2007; Schlick, Eurographics 1994",
    .parameter = parameters,
    .eval = eval_ggx,
    .slopes = slopes_ggx,
    .lobes = lobes_ggx,
};

const struct model rec_model_ggx_schlick_correlated = {
    .name = "ggx_schlick_correlated",
    .source = "Walter et al., EGSR 2007; Schlick, Eurographics 1994; Heitz, JCGT 2014",
    .parameter = parameters,
    .eval = eval_correlated,
    .slopes = slopes_correlated,
    .lobes = lobes_ggx,
};

const struct model rec_model_beckmann_schlick = {
    .name = "beckmann_schlick",
    .source = "Beckmann slopes after Walter et al., EGSR 2007; Schlick, Eurographics 1994",
    .parameter = parameters,
    .eval = eval_beckmann,
    .slopes = slopes_beckmann,
    .lobes = lobes_beckmann,
};

const struct model rec_model_ggx2 = {
    .name = "ggx2",
    .source = "Two lobes of Walter et al., EGSR 2007; Schlick, Eurographics 1994",
    .parameter = (const struct parameter[]){{"albedo", 3, 0, 1},
                                            {"f0", 3, 0, 1},
                                            {"alpha", 1, 1e-3, 1},
                                            {"edge", 1, 0, 1},
                                            {"f0_2", 3, 0, 1},
                                            {"alpha_2", 1, 1e-3, 1},
                                            {"edge_2", 1, 0, 1},
                                            {0}},
    .eval = eval_two,
    .slopes = slopes_two,
    .lobes = lobes_two,
};
