/* material.c -- reflectance of what a scene is made of: a sum of models and measured tables. */
#include "material.h"

#include <stdlib.h>
#include <string.h>

struct material sam_material(const struct model *model, const double *parameters)
{
    struct material material = {.parts = 1};
    material.part[0] = (struct material_part){.model = model, .scale = {1, 1, 1}};
    memcpy(material.part[0].parameter, parameters, (size_t)rec_model_size(model) * sizeof(double));
    return material;
}

/** Along one axis of a table: the two bins whose middles are about a place, and the share of the
 *  second. Places are in bins; beyond the outermost middles the outermost bins answer alone. */
struct between {
    int bin[2];
    double share[2];
};

static struct between between(double place, int bins)
{
    double from_first = fmin(fmax(place - 0.5, 0), bins - 1);
    int low = (int)fmin(floor(from_first), bins - 2);
    return (struct between){{low, low + 1}, {1 - (from_first - low), from_first - low}};
}

/** The same around a circle. */
static struct between around(double place, int bins)
{
    double from_first = place - 0.5, low = floor(from_first), share = from_first - low;
    int first = ((int)low + bins) % bins;
    return (struct between){{first, (first + 1) % bins}, {1 - share, share}};
}

static void eval_table(const struct merl *table, vec3 wi, vec3 wo, double f[3])
{
    half_diff a = rec_half_diff(wi, wo);
    double phi_d = a.phi_d < 0 ? a.phi_d + CAP_PI : a.phi_d;
    struct between h = between(MERL_THETA_H * sqrt(a.theta_h / (CAP_PI / 2)), MERL_THETA_H);
    struct between d = between(MERL_THETA_D * a.theta_d / (CAP_PI / 2), MERL_THETA_D);
    struct between p = around(MERL_PHI_D * phi_d / CAP_PI, MERL_PHI_D);
    double sum[3] = {0, 0, 0}, weights = 0;
    for (int k = 0; k < 8; k++) {
        int i = k & 1, j = k >> 1 & 1, l = k >> 2;
        int bin = p.bin[l] + MERL_PHI_D * (d.bin[j] + MERL_THETA_D * h.bin[i]);
        double weight = h.share[i] * d.share[j] * p.share[l];
        if (table->value[bin] < 0)
            continue;
        weights += weight;
        for (int c = 0; c < 3; c++)
            sum[c] += weight * fmax(0, table->value[(size_t)c * MERL_BINS + (size_t)bin]);
    }
    for (int c = 0; c < 3; c++)
        f[c] = weights > 0 ? sum[c] / weights : 0;
}

void sam_material_eval(const struct material *material, vec3 wi, vec3 wo, double f[3])
{
    f[0] = f[1] = f[2] = 0;
    for (int i = 0; i < material->parts; i++) {
        const struct material_part *part = &material->part[i];
        double one[3];
        if (part->model)
            part->model->eval(part->parameter, wi, wo, one);
        else
            eval_table(&part->table, wi, wo, one);
        for (int c = 0; c < 3; c++)
            f[c] += part->scale[c] * one[c];
    }
}

bool sam_material_mirrors(const struct material *material)
{
    return material->mirror[0] + material->mirror[1] + material->mirror[2] > 0;
}

void sam_material_free(struct material *material)
{
    for (int i = 0; i < material->parts; i++)
        rec_merl_free(&material->part[i].table);
    *material = (struct material){0};
}
