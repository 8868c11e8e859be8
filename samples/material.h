/* material.h -- what a surface is made of: reflectance models and tables, summed; or a mirror. */
#ifndef GONIOCAM_SAMPLES_MATERIAL_H
#define GONIOCAM_SAMPLES_MATERIAL_H

#include "reconstruct.h"

enum { MATERIAL_PARTS = 4 };

/** One summand: a model with its parameters, or a table where model is NULL. */
struct material_part {
    const struct model *model;
    double parameter[MODEL_PARAMETERS_MAX];
    struct brdf table;  // of a table, prepared
    double scale[3];    // f is multiplied by it
};

/** The sum of its parts, and of an ideal mirror. Owns the tables; {0} is black; release with
 *  sam_material_free(). */
struct material {
    struct material_part part[MATERIAL_PARTS];
    int parts;
    double mirror[3];  // reflectance; 0: no mirror
};

/** A material of one model. */
struct material sam_material(const struct model *model, const double *parameters);
/** f of the parts; the mirror is not in it. Requires wi.z > 0 and wo.z > 0. Tables are
 *  interpolated as everywhere (rec_brdf_eval). */
void sam_material_eval(const struct material *material, vec3 wi, vec3 wo, double f[3]);
bool sam_material_mirrors(const struct material *material);
void sam_material_free(struct material *material);
#endif
