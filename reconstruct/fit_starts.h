/* fit_starts.h -- where fits begin. */
#ifndef GONIOCAM_FIT_STARTS_H
#define GONIOCAM_FIT_STARTS_H

#include "fit_model.h"

enum { FIT_STARTS_MAX = 4, FIT_UNKNOWNS = 3 };

/** The best of a grid over the parameters that f is not linear in, each with the colours that suit
 *  it; best first, in the solver's parameters. Returns how many, 1 .. `most` <= FIT_STARTS_MAX.
 *  f->pick is [picked]. */
int rec_fit_starts(const struct fit_model *f, int picked,
                   double start[FIT_STARTS_MAX][MODEL_PARAMETERS_MAX], int most);
/** Solve the normal equations n x = b of `count` unknowns, none below 0. */
void rec_fit_nonnegative(double n[FIT_UNKNOWNS][FIT_UNKNOWNS], const double b[FIT_UNKNOWNS],
                         int count, double *x);

#endif
