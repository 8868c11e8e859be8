/* arrow.h -- covariances of many unknowns that meet only through a few. Internal to calib/. */
#ifndef GONIOCAM_ARROW_H
#define GONIOCAM_ARROW_H

#include "ceres_shim.h"

/** Fill the covariance of every parameter that has a place for it, at the present values, for
 *  residuals of unit variance (loss included). No term may have two parameters that are marked
 *  `eliminate`. STATUS_DATA: the residuals do not determine the parameters; STATUS_MEMORY. */
enum status arrow_covariance(const struct ceres_problem *problem, struct error *err);
#endif
