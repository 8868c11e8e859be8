/* lamp_scale.h -- what gives lamps their scale where no patch does. Internal to calib/. */
#ifndef GONIOCAM_LAMP_SCALE_H
#define GONIOCAM_LAMP_SCALE_H

#include "lamp_model.h"

/** ceres_evaluate of KIND_STRENGTH: three residuals, by how much ln intensity is more than the
 *  reference's. Blocks: place, ln E [3], the reference's own error of ln intensity [3]. */
bool cal_lamp_evaluate_strength(const void *context, double const *const *block, double *residual,
                                double **jacobian);
/** ceres_evaluate of KIND_STRENGTH_PRIOR: that error, whitened. Block: itself. */
bool cal_lamp_evaluate_strength_prior(const void *context, double const *const *block,
                                      double *residual, double **jacobian);
/** ceres_evaluate of KIND_ALBEDO_PRIOR: a diffuse sample's ln f, lit along its normal and seen at
 *  45 degrees. Block: its lobe. */
bool cal_lamp_evaluate_albedo_prior(const void *context, double const *const *block,
                                    double *residual, double **jacobian);
#endif
