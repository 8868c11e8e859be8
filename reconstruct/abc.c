/* abc.c -- facets whose slopes follow the ABC law of optical surfaces' scatter.
 *
 *      f = kD/pi + F(wi.h; ior) G A / (1 + B (1 - n.h))^C / (pi cos_i cos_o)
 *      G = min(1, 2 n.h cos_i / (wi.h), 2 n.h cos_o / (wo.h))
 *
 * The paper writes no pi; the published fits to the MERL materials want it.
 */
#include "lobes.h"
#include "models.h"

enum { KD = 0, A = 3, B = 6, C = 7, IOR = 8, SIZE = 9 };

static void eval(const double *parameters, vec3 wi, vec3 wo, double f[3])
{
    facet a = rec_facet(wi, wo);
    double cos_h = sqrt(a.cos2_h);
    double fall = a.sin2_h / (1 + cos_h);  // 1 - n.h, with all its digits
    double g = fmin(1, 2 * cos_h * fmin(a.cos_i, a.cos_o) / a.c);
    double lobe = rec_fresnel_dielectric(a.c, parameters[IOR]) * g
                  / (CAP_PI * a.cos_i * a.cos_o * pow(1 + parameters[B] * fall, parameters[C]));
    for (int c = 0; c < 3; c++)
        f[c] = parameters[KD + c] / CAP_PI + parameters[A + c] * lobe;
}

static void slopes(const double *parameters, vec3 wi, vec3 wo, double f[3], double *slope)
{
    facet a = rec_facet(wi, wo);
    double cos_h = sqrt(a.cos2_h), fall = a.sin2_h / (1 + cos_h), by_ior;
    double g = fmin(1, 2 * cos_h * fmin(a.cos_i, a.cos_o) / a.c), wide = 1 + parameters[B] * fall;
    double rest = g / (CAP_PI * a.cos_i * a.cos_o * pow(wide, parameters[C]));
    double fresnel = rec_fresnel_slope(a.c, parameters[IOR], &by_ior), lobe = fresnel * rest;
    for (int k = 0; k < 3 * SIZE; k++)
        slope[k] = 0;
    for (int c = 0; c < 3; c++) {
        double *s = &slope[c * SIZE], height = parameters[A + c];
        f[c] = parameters[KD + c] / CAP_PI + height * lobe;
        s[KD + c] = 1 / CAP_PI;
        s[A + c] = lobe;
        s[B] = -height * lobe * parameters[C] * fall / wide;
        s[C] = -height * lobe * log(wide);
        s[IOR] = height * by_ior * rest;
    }
}

static int lobes(const double *parameters, vec3 wi, struct lobe *lobe)
{
    double b = parameters[B], c = parameters[C], e = 1 - c;
    double whole = b < 1e-9 ? 1 : fabs(e) < 1e-9 ? log1p(b) / b : expm1(e * log1p(b)) / (b * e);
    double gloss = 8 * rec_fresnel_dielectric(wi.z, parameters[IOR]) * whole;
    int n = rec_lobe_body(lobe, parameters + KD);
    lobe[n] = rec_lobe(LOBE_ABC, gloss * rec_mean(parameters + A), b, c);
    return n + 1;
}

const struct model rec_model_abc = {
    .name = "abc",
    .source = "Low, Kronander, Ynnerman, Unger, ACM TOG 2012",
    .parameter = (const struct parameter[]){{"kD", 3, 0, 1},
                                            {"A", 3, 0, 1e9},
                                            {"B", 1, 0, 1e9},
                                            {"C", 1, 0, 10},
                                            {"ior", 1, 1, 100},
                                            {0}},
    .eval = eval,
    .slopes = slopes,
    .lobes = lobes,
};
