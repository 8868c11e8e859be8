/* lobe.h -- a reflectance that fits any isotropic sample, for finding lamps. Internal to calib/. */
#ifndef GONIOCAM_LOBE_H
#define GONIOCAM_LOBE_H

#include "calib.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Coefficients, in this order: log diffuse [3]; cubic B-splines of log D over theta_h, of log F
 *  over theta_d for each channel, of log G over theta_i and (the same) theta_o. */
enum {
    LOBE_H = 17,
    LOBE_D = 7,
    LOBE_G = 7,
    LOBE_SIZE = 3 + LOBE_H + 3 * LOBE_D + LOBE_G,
    LOBE_PRIORS = 3 + 2 * LOBE_H + 6 * LOBE_D + 2 * LOBE_G,  // see cal_lobe_priors
};

/** ln f[3] of the lobe for cosines of the angles of wi, wo and h with the normal and of wi with h
 *  (all in (0, 1]); derivative, where not NULL, is [3][LOBE_SIZE].
 *
 *      f_c = exp(d_c) + exp(D(theta_h) + F_c(theta_d) + G(theta_i) + G(theta_o))
 *
 *  A microfacet model is of this form whatever its distribution, Fresnel term and shadowing. */
void cal_lobe_log(const double coefficient[LOBE_SIZE], double cos_i, double cos_o, double cos_h,
                  double cos_d, double log_f[3], double *derivative);
/** A start: a matte surface of reflectance albedo with a faint broad gloss. */
void cal_lobe_start(double coefficient[LOBE_SIZE], const double albedo[3]);
/** A better start for the gloss, from measurements: f[3] at count angles theta_h (cosines), at any
 *  theta_d; in each step of theta_h the gloss is the median of what f is above the albedo's. False:
 *  out of memory. */
bool cal_lobe_start_gloss(double coefficient[LOBE_SIZE], int count, const double *cos_h,
                          const double (*f)[3]);
/** What is assumed before any measurement, as residuals [LOBE_PRIORS] that are 1 at one sigma:
 *  splines are smooth, and coefficients that nothing measures stay where they are harmless.
 *  jacobian [LOBE_PRIORS][LOBE_SIZE] or NULL. */
void cal_lobe_priors(const double coefficient[LOBE_SIZE], double residual[LOBE_PRIORS],
                     double *jacobian);

/** Fill a table with the lobe of these coefficients. What of the gloss is there in all directions
 *  counts as matte: the fit cannot tell a flat lobe from a matte surface. */
void cal_lobe_tabulate(struct lobe_table *table, const double coefficient[LOBE_SIZE]);
/** Directional albedo [3] of what is not matte: integral of (f - matte) cos_i. */
void cal_lobe_gloss_albedo(const struct lobe_table *table, double cos_o, double albedo[3]);

#ifdef __cplusplus
}
#endif
#endif
