/* models.h -- the reflectance models, each in the file of its name. */
#ifndef GONIOCAM_MODELS_H
#define GONIOCAM_MODELS_H

#include "brdf.h"

extern const struct model rec_model_lambert;
extern const struct model rec_model_ggx;
extern const struct model rec_model_ggx_schlick;
extern const struct model rec_model_beckmann_schlick;

extern const struct model rec_model_ggx_correlated;
extern const struct model rec_model_ggx_schlick_correlated;
extern const struct model rec_model_ggx2;
extern const struct model rec_model_gtr;
extern const struct model rec_model_oren_nayar_ggx;
extern const struct model rec_model_oren_nayar;
extern const struct model rec_model_blinn_phong;
extern const struct model rec_model_lafortune;
extern const struct model rec_model_ward;
extern const struct model rec_model_beckmann;
extern const struct model rec_model_cook_torrance;
extern const struct model rec_model_ggx_conductor;
extern const struct model rec_model_ggx_conductor_correlated;
extern const struct model rec_model_ashikhmin_shirley;
extern const struct model rec_model_abc;
extern const struct model rec_model_sgd;
extern const struct model rec_model_disney;

/** "NAME_rgb", or NULL; what it is made of, or NULL: it is no such model. */
const struct model *rec_model_per_channel_find(const char *name);
const struct model *rec_model_shared(const struct model *model);
/** Its parameters, all channels alike, from the base's. */
void rec_model_split(const struct model *base, const double *shared, double *split);

#endif
