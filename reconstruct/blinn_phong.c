/* blinn_phong.c -- a constant and a power of n.h, as Ngan et al. fitted it to measured materials.
 *
 *      f = kd + ks (n.h)^ke                                       kd, ks in 1/sr, three numbers a
 * channel
 *
 * A lobe alone keeps energy where ks <= (ke + 2)(ke + 4) / (8 pi (2^(-ke/2) + ke)), its albedo at
 * normal incidence.
 */
#include "lobes.h"
#include "models.h"

enum { KD = 0, KS = 3, KE = 6, SIZE = 9 };

static void eval(const double *parameters, vec3 wi, vec3 wo, double f[3])
{
    facet a = rec_facet(wi, wo);
    double ln_cos_h = 0.5 * log1p(-fmin(a.sin2_h, 1));  // keeps its digits in the highlight
    for (int c = 0; c < 3; c++)
        f[c] = parameters[KD + c] + parameters[KS + c] * exp(parameters[KE + c] * ln_cos_h);
}

static void slopes(const double *parameters, vec3 wi, vec3 wo, double f[3], double *slope)
{
    facet a = rec_facet(wi, wo);
    double ln_cos_h = 0.5 * log1p(-fmin(a.sin2_h, 1));
    for (int k = 0; k < 3 * SIZE; k++)
        slope[k] = 0;
    for (int c = 0; c < 3; c++) {
        double *s = &slope[c * SIZE], power = exp(parameters[KE + c] * ln_cos_h);
        f[c] = parameters[KD + c] + parameters[KS + c] * power;
        s[KD + c] = 1;
        s[KS + c] = power;
        s[KE + c] = power > 0 ? parameters[KS + c] * power * ln_cos_h : 0;
    }
}

static int lobes(const double *parameters, vec3 wi, struct lobe *lobe)
{
    (void)wi;
    int n = rec_lobe_body(lobe, parameters + KD);
    lobe->weight *= CAP_PI;
    for (int c = 0; c < 3; c++, n++) {
        double e = parameters[KE + c];
        double whole = 8 * CAP_PI * (pow(2, -0.5 * e) + e) / ((e + 2) * (e + 4));
        lobe[n] = rec_lobe(LOBE_POWER, parameters[KS + c] * whole / 3, e, 0);
    }
    return n;
}

const struct model rec_model_blinn_phong = {
    .name = "blinn_phong",
    .source = "Blinn, SIGGRAPH 1977; form of Ngan, Durand, Matusik, EGSR 2005",
    .parameter =
        (const struct parameter[]){
            {"kd", 3, 0, 1 / CAP_PI}, {"ks", 3, 0, 1e5}, {"ke", 3, 0, 1e6}, {0}},
    .eval = eval,
    .slopes = slopes,
    .lobes = lobes,
};
