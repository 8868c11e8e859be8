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
    .lobes = lobes,
};
