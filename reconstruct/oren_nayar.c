/* oren_nayar.c -- rough matt: facets that are Lambertian, with masking and shadowing.
 *
 *      f = albedo/pi (A + B max(0, cos(phi_i - phi_o)) sin a tan b)     a, b: the larger, smaller
 * theta A = 1 - s^2 / (2 (s^2 + 0.33))         B = 0.45 s^2 / (s^2 + 0.09)
 *
 * sigma = s is the standard deviation of the facets' slope angle in radians. This is the paper's
 * "qualitative model"; at grazing incidence it sends back up to 1.5 % more than `albedo`.
 */
#include "lobes.h"
#include "models.h"

enum { ALBEDO = 0, SIGMA = 3 };

static void eval(const double *parameters, vec3 wi, vec3 wo, double f[3])
{
    double s2 = parameters[SIGMA] * parameters[SIGMA];
    double a = 1 - 0.5 * s2 / (s2 + 0.33), b = 0.45 * s2 / (s2 + 0.09);
    // sin_i sin_o cos(phi_i - phi_o); over the larger cosine it is cos(phi) sin a tan b.
    double across = wi.x * wo.x + wi.y * wo.y;
    double rough = a + b * fmax(0, across) / fmax(wi.z, wo.z);
    for (int c = 0; c < 3; c++)
        f[c] = parameters[ALBEDO + c] / CAP_PI * rough;
}

static int lobes(const double *parameters, vec3 wi, struct lobe *lobe)
{
    (void)wi;
    return rec_lobe_body(lobe, parameters + ALBEDO);
}

const struct model rec_model_oren_nayar = {
    .name = "oren_nayar",
    .source = "Oren and Nayar, SIGGRAPH 1994, qualitative model",
    .parameter = (const struct parameter[]){{"albedo", 3, 0, 1}, {"sigma", 1, 0, CAP_PI / 2}, {0}},
    .eval = eval,
    .lobes = lobes,
};
