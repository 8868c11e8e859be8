/* lambert.c -- the matte model: f = albedo / pi in every direction. */
#include "lobes.h"
#include "models.h"

static void eval(const double *parameters, vec3 wi, vec3 wo, double f[3])
{
    (void)wi;
    (void)wo;
    for (int c = 0; c < 3; c++)
        f[c] = parameters[c] / CAP_PI;
}

static void slopes(const double *parameters, vec3 wi, vec3 wo, double f[3], double *slope)
{
    eval(parameters, wi, wo, f);
    for (int k = 0; k < 9; k++)
        slope[k] = k % 4 ? 0 : 1 / CAP_PI;  // the diagonal of 3 x 3
}

static int lobes(const double *parameters, vec3 wi, struct lobe *lobe)
{
    (void)wi;
    return rec_lobe_body(lobe, parameters);
}

const struct model rec_model_lambert = {
    .name = "lambert",
    .source = "J. H. Lambert, Photometria, 1760",
    .parameter = (const struct parameter[]){{"albedo", 3, 0, 1}, {0}},
    .eval = eval,
    .slopes = slopes,
    .lobes = lobes,
};
