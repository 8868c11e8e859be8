/* gtr.c -- gloss with a tail of any length: the generalised Trowbridge-Reitz slopes of Burley.
 *
 *      f = albedo/pi + F(wi.h) D(h) G1(wi) G1(wo) / (4 cos_i cos_o)
 *      D = k / (alpha^2 cos^2 theta_h + sin^2 theta_h)^gamma       F = f0 + edge (1 - f0) (1 -
 * wi.h)^5
 *
 * gamma = 2 is GGX, 1 Berry's law, a large one and a wide alpha near Beckmann's. The shadowing is
 * that of GGX: that of other gamma has no closed form.
 */
#include "lobes.h"
#include "models.h"

enum { ALBEDO = 0, F0 = 3, ALPHA = 6, EDGE = 7, GAMMA = 8 };

static void eval(const double *parameters, vec3 wi, vec3 wo, double f[3])
{
    facet a = rec_facet(wi, wo);
    double lobe = rec_lobe_gtr(a, parameters[ALPHA], parameters[GAMMA]);
    double rise = parameters[EDGE] * rec_schlick(a.c);
    for (int c = 0; c < 3; c++) {
        double f0 = parameters[F0 + c];
        f[c] = parameters[ALBEDO + c] / CAP_PI + (f0 + rise * (1 - f0)) * lobe;
    }
}

static int lobes(const double *parameters, vec3 wi, struct lobe *lobe)
{
    double f0 = rec_mean(parameters + F0);
    double gloss = f0 + parameters[EDGE] * (1 - f0) * rec_schlick(wi.z);
    int n = rec_lobe_body(lobe, parameters + ALBEDO);
    lobe[n] = rec_lobe(LOBE_GTR, gloss, parameters[ALPHA], parameters[GAMMA]);
    return n + 1;
}

const struct model rec_model_gtr = {
    .name = "gtr",
    .source = "Burley, \"Physically Based Shading at Disney\", SIGGRAPH 2012 course",
    .parameter = (const struct parameter[]){{"albedo", 3, 0, 1},
                                            {"f0", 3, 0, 1},
                                            {"alpha", 1, 1e-3, 1},
                                            {"edge", 1, 0, 1},
                                            {"gamma", 1, 0.5, 10},
                                            {0}},
    .eval = eval,
    .lobes = lobes,
};
