/* lafortune.c -- a generalised cosine lobe, isotropic.
 *
 *      f = albedo/pi + max(0, cxy (wi.x wo.x + wi.y wo.y) + cz wi.z wo.z)^n
 *
 * cxy = -cz is a Phong lobe about the mirror direction; |cxy| > cz leans it towards grazing, cxy >
 * 0 makes it retro-reflective.
 */
#include "lobes.h"
#include "models.h"

enum { ALBEDO = 0, CXY = 3, CZ = 6, N = 9 };

static void eval(const double *parameters, vec3 wi, vec3 wo, double f[3])
{
    double across = wi.x * wo.x + wi.y * wo.y, along = wi.z * wo.z;
    for (int c = 0; c < 3; c++) {
        double base = parameters[CXY + c] * across + parameters[CZ + c] * along;
        f[c] = parameters[ALBEDO + c] / CAP_PI + pow(fmax(0, base), parameters[N + c]);
    }
}

static int lobes(const double *parameters, vec3 wi, struct lobe *lobe)
{
    int n = rec_lobe_body(lobe, parameters + ALBEDO);
    for (int c = 0; c < 3; c++, n++) {
        double cxy = parameters[CXY + c], cz = parameters[CZ + c], e = parameters[N + c];
        double height = pow(hypot(cxy * hypot(wi.x, wi.y), cz * wi.z), e);
        lobe[n] = rec_lobe(LOBE_AXIS, height * 2 * CAP_PI / (3 * (e + 2)), cxy, cz);
        lobe[n].shape[2] = e;
    }
    return n;
}

const struct model rec_model_lafortune = {
    .name = "lafortune",
    .source = "Lafortune, Foo, Torrance, Greenberg, SIGGRAPH 1997",
    .parameter =
        (const struct parameter[]){
            {"albedo", 3, 0, 1}, {"cxy", 3, -3, 3}, {"cz", 3, -3, 3}, {"n", 3, 0.1, 1e5}, {0}},
    .eval = eval,
    .lobes = lobes,
};
