/* models.h -- the reflectance models, each in the file of its name. */
#ifndef GONIOCAM_MODELS_H
#define GONIOCAM_MODELS_H

#include "reconstruct.h"

extern const struct model rec_model_lambert;
extern const struct model rec_model_ggx;
extern const struct model rec_model_ggx_schlick;
extern const struct model rec_model_beckmann_schlick;

#endif
