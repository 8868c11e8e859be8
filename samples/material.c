/* material.c -- reflectance of what a scene is made of: a sum of models and measured tables. */
#include "material.h"

#include <string.h>

struct material sam_material(const struct model *model, const double *parameters)
{
    struct material material = {.parts = 1};
    material.part[0] = (struct material_part){.model = model, .scale = {1, 1, 1}};
    memcpy(material.part[0].parameter, parameters, (size_t)rec_model_size(model) * sizeof(double));
    return material;
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
            rec_brdf_eval(&part->table, wi, wo, one);
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
        rec_brdf_free(&material->part[i].table);
    *material = (struct material){0};
}
