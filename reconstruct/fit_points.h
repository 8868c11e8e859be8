/* fit_points.h -- the bins that models are fitted to and judged by. */
#ifndef GONIOCAM_FIT_POINTS_H
#define GONIOCAM_FIT_POINTS_H

#include "reconstruct.h"

/** A bin as a fit sees it. Where no fit is known the residual of a model value f' is
 *  (log_f - ln(f' m + e)) / sigma. */
struct fit_point {
    vec3 wi, wo;
    double f[3];
    double m;              // cos_i cos_o
    double error[3];       // 1 sigma of f
    double log_f[3];       // ln(f m + e)
    double sigma[3];       // of the residual: the measurement, and what any model is allowed
    double systematic[3];  // of log_f: the part that all bins share
    double shown;          // root of its share of lit spheres' pictures over the mean share
    double tilt;           // 1 sigma of theta_h
    bool held;             // out of the fit, to judge it by
};

/** e of the log cost: below this reflectance differences do not count (formulas.md). */
#define FIT_DARK 1e-3

/** The best any of these models does on a real material, relative: bins measured better than this
 *  do not drive a fit. Real materials miss such models by several per cent; Ngan et al. 2005. */
#define FIT_MODEL_ERROR 0.01

/** ln(f m + e), for any f: noise may take f below 0. */
double rec_fit_log(double f, double m);

/** Some `wanted` bins, spread evenly over strata of theta_h and theta_d. The caller frees *points.
 *  STATUS_DATA: fewer than 100 serve; STATUS_MEMORY. */
enum status rec_fit_points(struct fit_point **points, int *count, const struct bins *bins,
                           int wanted, struct error *err);

#endif
