/* models.c -- the tables of reflectance models. A new model is a file and a line here. */
#include "models.h"

#include <assert.h>
#include <string.h>

const struct model *const rec_models[] = {
    &rec_model_lambert, &rec_model_ggx, &rec_model_ggx_schlick, &rec_model_beckmann_schlick, NULL,
};

const struct model *const rec_models_by_name[] = {
    &rec_model_oren_nayar,    &rec_model_blinn_phong,
    &rec_model_lafortune,     &rec_model_ward,
    &rec_model_beckmann,      &rec_model_cook_torrance,
    &rec_model_ggx_conductor, &rec_model_ashikhmin_shirley,
    &rec_model_abc,           &rec_model_sgd,
    &rec_model_disney,        NULL,
};

static const struct model *find(const struct model *const *models, const char *name)
{
    for (; *models; models++)
        if (strcmp((*models)->name, name) == 0)
            return *models;
    return NULL;
}

const struct model *rec_model_find(const char *name)
{
    const struct model *model = find(rec_models, name);
    return model ? model : find(rec_models_by_name, name);
}

int rec_model_size(const struct model *model)
{
    int size = 0;
    for (const struct parameter *p = model->parameter; p->name; p++)
        size += p->size;
    assert(size <= MODEL_PARAMETERS_MAX);
    return size;
}
