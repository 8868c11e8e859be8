/* fit_model.h -- a model's residuals at fit points, in the parameters that the solver turns. */
#ifndef GONIOCAM_FIT_MODEL_H
#define GONIOCAM_FIT_MODEL_H

#include "fit_points.h"

/** A model and the points it is fitted to. The solver's parameter k is the model's, or its
 *  logarithm where the range spans two decades or more: a lobe's width is known by its ratio. */
struct fit_model {
    const struct model *model;
    const struct fit_point *points;
    const int *pick;  // indices into points that take part
    int size;
    bool logarithm[MODEL_PARAMETERS_MAX];
    double low[MODEL_PARAMETERS_MAX], high[MODEL_PARAMETERS_MAX];  // of the solver's
};

struct fit_model rec_fit_model(const struct model *model, const struct fit_point *points,
                               const int *pick);
/** The model's parameters from the solver's, and back. */
void rec_fit_to_model(const struct fit_model *f, const double *solver, double *model);
void rec_fit_to_solver(const struct fit_model *f, const double *model, double *solver);
/** Residuals r[3] at pick[i] and, where not NULL, slopes [3][size], by differences. The
 *  signature is struct least_squares'; context is a struct fit_model. */
void rec_fit_residual(const void *context, int i, const double *solver, double *r, double *slope);
/** 1 sigma of the model's parameters at a solution: noise, and the calibration's shared errors. */
void rec_fit_sigma(const struct fit_model *f, int picked, const double *solver, double *sigma);

#endif
