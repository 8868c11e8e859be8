/* solve.h -- small dense linear systems. */
#ifndef GONIOCAM_SOLVE_H
#define GONIOCAM_SOLVE_H

#include <stdbool.h>

/** Solve A x = b, a[n][n] symmetric positive definite (its lower half is read, and lost), by
 *  Cholesky's method; b becomes x. false: it is not positive definite. */
bool solve_spd(double *a, double *b, int n);
#endif
