/* ashikhmin_shirley.c -- gloss over a body that gets what the gloss leaves, isotropic.
 *
 *      f = 28 rd (1 - rs) / (23 pi) (1 - (1 - cos_i/2)^5) (1 - (1 - cos_o/2)^5)
 *          + (n + 1)/(8 pi) (n.h)^n F / (wi.h max(cos_i, cos_o))       F = rs + (1 - rs)(1 -
 * wi.h)^5
 */
#include "lobes.h"
#include "models.h"

enum { RD = 0, RS = 3, N = 6 };

static double body(double cosine)
{
    return 1 - rec_schlick(0.5 * cosine);
}

static void eval(const double *parameters, vec3 wi, vec3 wo, double f[3])
{
    facet a = rec_facet(wi, wo);
    double n = parameters[N], power = exp(0.5 * n * log1p(-fmin(a.sin2_h, 1)));
    double lobe = (n + 1) / (8 * CAP_PI) * power / (a.c * fmax(a.cos_i, a.cos_o));
    double matt = 28 / (23 * CAP_PI) * body(a.cos_i) * body(a.cos_o);
    double rise = rec_schlick(a.c);
    for (int c = 0; c < 3; c++) {
        double rs = parameters[RS + c];
        f[c] = parameters[RD + c] * (1 - rs) * matt + (rs + (1 - rs) * rise) * lobe;
    }
}

static int lobes(const double *parameters, vec3 wi, struct lobe *lobe)
{
    double rs = rec_mean(parameters + RS);
    int n = rec_lobe_body(lobe, parameters + RD);
    lobe->weight *= 1 - rs;
    lobe[n] = rec_lobe(LOBE_POWER, rs + (1 - rs) * rec_schlick(wi.z), parameters[N], 0);
    return n + 1;
}

const struct model rec_model_ashikhmin_shirley = {
    .name = "ashikhmin_shirley",
    .source = "Ashikhmin and Shirley, \"An Anisotropic Phong BRDF Model\", JGT 2000",
    .parameter =
        (const struct parameter[]){{"rd", 3, 0, 1}, {"rs", 3, 0, 1}, {"n", 1, 0, 1e6}, {0}},
    .eval = eval,
    .lobes = lobes,
};
