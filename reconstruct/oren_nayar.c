/* oren_nayar.c -- rough matt: facets that are Lambertian, with masking and shadowing; alone, and
 * under a GGX lobe with Schlick's Fresnel law (schlick.c).
 *
 *      f = albedo/pi (A + B max(0, cos(phi_i - phi_o)) sin a tan b)     a, b: the larger, smaller
 * theta A = 1 - s^2 / (2 (s^2 + 0.33))         B = 0.45 s^2 / (s^2 + 0.09)
 *
 * sigma = s is the standard deviation of the facets' slope angle in radians. This is the paper's
 * "qualitative model"; at grazing incidence it sends back up to 1.5 % more than `albedo`.
 */
#include "lobes.h"
#include "models.h"

enum { ALBEDO = 0, SIGMA = 3, F0 = 4, ALPHA = 7, EDGE = 8 };

// f over albedo/pi.
static double roughness(double sigma, vec3 wi, vec3 wo)
{
    double s2 = sigma * sigma;
    double a = 1 - 0.5 * s2 / (s2 + 0.33), b = 0.45 * s2 / (s2 + 0.09);
    // sin_i sin_o cos(phi_i - phi_o); over the larger cosine it is cos(phi) sin a tan b.
    double across = wi.x * wo.x + wi.y * wo.y;
    return a + b * fmax(0, across) / fmax(wi.z, wo.z);
}

static void eval(const double *parameters, vec3 wi, vec3 wo, double f[3])
{
    double rough = roughness(parameters[SIGMA], wi, wo);
    for (int c = 0; c < 3; c++)
        f[c] = parameters[ALBEDO + c] / CAP_PI * rough;
}

static int lobes(const double *parameters, vec3 wi, struct lobe *lobe)
{
    (void)wi;
    return rec_lobe_body(lobe, parameters + ALBEDO);
}

static void eval_glossy(const double *parameters, vec3 wi, vec3 wo, double f[3])
{
    facet a = rec_facet(wi, wo);
    double lobe = rec_lobe_ggx(a, parameters[ALPHA]);
    double rise = parameters[EDGE] * rec_schlick(a.c);
    eval(parameters, wi, wo, f);
    for (int c = 0; c < 3; c++)
        f[c] += (parameters[F0 + c] + rise * (1 - parameters[F0 + c])) * lobe;
}

static int lobes_glossy(const double *parameters, vec3 wi, struct lobe *lobe)
{
    double f0 = rec_mean(parameters + F0);
    double gloss = f0 + parameters[EDGE] * (1 - f0) * rec_schlick(wi.z);
    int n = lobes(parameters, wi, lobe);
    lobe[n] = rec_lobe(LOBE_VISIBLE, gloss, parameters[ALPHA], 0);
    return n + 1;
}

const struct model rec_model_oren_nayar = {
    .name = "oren_nayar",
    .source = "Oren and Nayar, SIGGRAPH 1994, qualitative model",
    .parameter = (const struct parameter[]){{"albedo", 3, 0, 1}, {"sigma", 1, 0, CAP_PI / 2}, {0}},
    .eval = eval,
    .lobes = lobes,
};

const struct model rec_model_oren_nayar_ggx = {
    .name = "oren_nayar_ggx",
    .source = "Oren and Nayar, SIGGRAPH 1994; Walter et al., EGSR 2007; Schlick, Eurographics 1994",
    .parameter = (const struct parameter[]){{"albedo", 3, 0, 1},
                                            {"sigma", 1, 0, CAP_PI / 2},
                                            {"f0", 3, 0, 1},
                                            {"alpha", 1, 1e-3, 1},
                                            {"edge", 1, 0, 1},
                                            {0}},
    .eval = eval_glossy,
    .lobes = lobes_glossy,
};
