/* models.c -- the tables of reflectance models. A new model is a file and a line here. */
#include "models.h"

#include <assert.h>
#include <string.h>

const struct model *const rec_models[] = {
    &rec_model_lambert, &rec_model_ggx, &rec_model_ggx_schlick, &rec_model_beckmann_schlick, NULL,
};

const struct model *const rec_models_more[] = {
    &rec_model_lambert, &rec_model_ggx, &rec_model_ggx_schlick, &rec_model_beckmann_schlick,
    &rec_model_ggx2,    &rec_model_abc, &rec_model_sgd,         NULL,
};

const struct model *const rec_models_all[] = {
    &rec_model_lambert,
    &rec_model_oren_nayar,
    &rec_model_blinn_phong,
    &rec_model_lafortune,
    &rec_model_ward,
    &rec_model_ashikhmin_shirley,
    &rec_model_cook_torrance,
    &rec_model_beckmann,
    &rec_model_beckmann_schlick,
    &rec_model_ggx,
    &rec_model_ggx_correlated,
    &rec_model_ggx_schlick,
    &rec_model_ggx_schlick_correlated,
    &rec_model_ggx_conductor,
    &rec_model_ggx_conductor_correlated,
    &rec_model_ggx2,
    &rec_model_gtr,
    &rec_model_oren_nayar_ggx,
    &rec_model_abc,
    &rec_model_sgd,
    &rec_model_disney,
    NULL,
};

const struct model *rec_model_find(const char *name)
{
    for (const struct model *const *m = rec_models_all; *m; m++)
        if (strcmp((*m)->name, name) == 0)
            return *m;
    return rec_model_per_channel_find(name);
}

int rec_model_size(const struct model *model)
{
    int size = 0;
    for (const struct parameter *p = model->parameter; p->name; p++)
        size += p->size;
    assert(size <= MODEL_PARAMETERS_MAX);
    return size;
}
