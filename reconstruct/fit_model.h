/* fit_model.h -- a model's residuals at fit points, in the parameters that the solver turns. */
#ifndef GONIOCAM_FIT_MODEL_H
#define GONIOCAM_FIT_MODEL_H

#include "fit_points.h"

#define FIT_BEND      3.0   // sigmas: residuals beyond it count less and less
#define FIT_LOG_SIGMA 0.05  // of FIT_LOG: what models of real materials miss by; Ngan et al. 2005

/** A model and the points it is fitted to. The solver's parameter k is the model's, or its
 *  logarithm where the range spans two decades or more: a lobe's width is known by its ratio. */
struct fit_model {
    const struct model *model;
    const struct fit_point *points;
    const int *pick;  // indices into points that take part
    // f' of a fit that is near, [of points][3], for FIT_STATISTICAL; NULL: none is known yet.
    double (*near)[3];
    enum fit_cost cost;
    int size;
    bool logarithm[MODEL_PARAMETERS_MAX];
    double low[MODEL_PARAMETERS_MAX], high[MODEL_PARAMETERS_MAX];  // of the solver's
};

struct fit_model rec_fit_model(const struct model *model, const struct fit_point *points,
                               enum fit_cost cost);
/** One channel of a point; the residual of a value fitted to it, and its derivative by that. */
struct fit_value {
    double f, log_f, sigma, m, cosine, shown;
    double per_sigma;  // 1 / sigma of f, by a near fit; 0: none is known
};
struct fit_value rec_fit_value(const struct fit_model *f, int point, int channel);
/** r and by_f are [rec_fit_residuals(cost)]. */
void rec_fit_miss(enum fit_cost cost, const struct fit_value *v, double fitted, double *r,
                  double *by_f);
/** How many residuals a channel has: 1 or 2. */
int rec_fit_residuals(enum fit_cost cost);
/** What one point costs, of the sum of its squared residuals. */
double rec_fit_loss(enum fit_cost cost, double r2);
/** The same of the residuals of all three channels. */
double rec_fit_cost(enum fit_cost cost, const double *r);
/** struct least_squares' scale. */
double rec_fit_scale(enum fit_cost cost);
/** The model's parameters from the solver's, and back. */
void rec_fit_to_model(const struct fit_model *f, const double *solver, double *model);
/** Into the ranges of a model's parameters: what a logarithm has rounded may lie just beside. */
void rec_fit_confine(const struct model *model, double *value);
void rec_fit_to_solver(const struct fit_model *f, const double *model, double *solver);
/** Residuals r[3 or 6] at pick[i] and, where not NULL, slopes [3 or 6][size], by the model's own
 *  derivatives or by differences. The signature is struct least_squares'; context is a struct
 * fit_model. */
void rec_fit_residual(const void *context, int i, const double *solver, double *r, double *slope);
/** Take a solution's values for f->near, which must have room; it changes how later fits weigh. */
void rec_fit_come_near(const struct fit_model *f, int count, const double *solver);
/** The covariance [size][size] of the model's parameters at a solution: noise, and the
 *  calibration's shared errors. */
void rec_fit_covariance(const struct fit_model *f, int picked, const double *solver,
                        double *covariance);

#endif
