/* fit_sgd.h -- the SGD model's own way to be fitted. */
#ifndef GONIOCAM_FIT_SGD_H
#define GONIOCAM_FIT_SGD_H

#include "fit_model.h"

/** Fit all channels to f's points `pick` [picked]: solver parameters as rec_fit_model's, from where
 *  they are, or, with search, from the best of a search. STATUS_SOLVER, STATUS_MEMORY. */
enum status rec_fit_sgd(const struct fit_model *f, const int *pick, int picked, bool search,
                        int iterations, double *solver, struct error *err);

#endif
