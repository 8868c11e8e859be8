/* ceres_shim.h -- bounded robust least squares by Ceres, behind plain C. */
#ifndef GONIOCAM_RECONSTRUCT_CERES_SHIM_H
#define GONIOCAM_RECONSTRUCT_CERES_SHIM_H

#include "capture.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Minimise sum over points of rho(|r|^2), low <= parameters <= high. Everything is borrowed; the
 *  solver writes parameters and cost. */
struct least_squares {
    /** r [residuals] of a point, and where slope is not NULL its derivatives [residuals][size]. */
    void (*residual)(const void *context, int point, const double *parameters, double *r,
                     double *slope);
    const void *context;
    const double *low, *high;  // [size]
    double *parameters;        // [size]
    double cost;               // half the robust sum of squares
    double scale;              // of |r|, where Cauchy's loss bends; 0: the cube root; < 0: none
    int points, residuals, size, iterations;
};

/** Below this |r| the cube root goes on evenly to 0. */
#define CUBE_ROOT_EVEN 1e-4

/** One thread. Coming to the last iteration is no failure. STATUS_SOLVER if Ceres finds no
 *  finite cost, or throws: no exception crosses this line. */
enum status rec_least_squares(struct least_squares *problem, struct error *err);

#ifdef __cplusplus
}
#endif
#endif
