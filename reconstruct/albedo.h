/* albedo.h -- how much of the light from a direction leaves a surface, and how sure that is. */
#ifndef GONIOCAM_ALBEDO_H
#define GONIOCAM_ALBEDO_H

#include "reconstruct.h"

/** Directional-hemispherical reflectance, per channel. */
struct albedo {
    double theta_i_deg;
    double value[3], sigma[3];
    double filled[3];  // the part of value from bins that no photosite measured
};
/** Of any BRDF, [3]: the part of the light from theta_i (radians) that leaves; a table that is
 *  prepared is interpolated (rec_brdf_prepare). Method: hemisphere.c. */
void rec_brdf_albedo(double albedo[3], const struct brdf *brdf, double theta_i);
/** Of a complete table, at the angles that albedo [count] holds. state [MERL_BINS] is enum
 *  bin_status; fit_error is the relative error of what fills bins. STATUS_MEMORY. */
enum status rec_albedos(struct albedo *albedo, int count, const struct merl *table,
                        const uint8_t *state, const struct bins *bins, double fit_error,
                        struct error *err);

#endif
