/* models.c -- the table of reflectance models. A new model is a file and a line here. */
#include "models.h"

#include <assert.h>
#include <string.h>

const struct model *const rec_models[] = {
    &rec_model_lambert, &rec_model_ggx, &rec_model_ggx_schlick, &rec_model_beckmann_schlick, NULL,
};

const struct model *rec_model_find(const char *name)
{
    for (const struct model *const *m = rec_models; *m; m++)
        if (strcmp((*m)->name, name) == 0)
            return *m;
    return NULL;
}

int rec_model_size(const struct model *model)
{
    int size = 0;
    for (const struct parameter *p = model->parameter; p->name; p++)
        size += p->size;
    assert(size <= MODEL_PARAMETERS_MAX);
    return size;
}
