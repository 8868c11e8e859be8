/* dense.h -- Cholesky for small symmetric matrices, [n][n] row-major. */
#ifndef GONIOCAM_DENSE_H
#define GONIOCAM_DENSE_H

#include <stdbool.h>

/** a = L L^T: L replaces the lower triangle; the upper is not touched. false: not positive. */
bool dense_cholesky(int n, double *a);
/** Solve L L^T x = b in place, with L from dense_cholesky. */
void dense_solve(int n, const double *l, double *b);
/** The inverse of L L^T, whole. */
void dense_inverse(int n, const double *l, double *inverse);
/** W = inverse of L, lower triangular, zero above: W a W^T = 1, so W whitens noise of covariance
 *  a. */
void dense_whitener(int n, const double *l, double *w);

#endif
