/* ceres_shim.h -- Ceres Solver for C: nonlinear least squares over plain arrays.
 *
 * It only translates: callers say what the residuals and their derivatives are. Sums are made in
 * one thread, so that the result is the same to the last bit everywhere; many terms are evaluated
 * in all threads, so that evaluations must not write what they share.
 */
#ifndef GONIOCAM_CALIB_CERES_SHIM_H
#define GONIOCAM_CALIB_CERES_SHIM_H

#include "capture.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Residuals of a term and, where asked for, their derivatives. parameters[k] is the term's k-th
 *  array; jacobians may be NULL, and so may jacobians[k], [residuals][size of k]. Returns false
 *  where the residuals are not defined (the solver then tries a shorter step). */
typedef bool (*ceres_evaluate)(const void *context, double const *const *parameters,
                               double *residuals, double **jacobians);

/** An array of unknowns. The solver writes value; where held[i], value[i] stays as it is. */
struct ceres_parameter {
    double *value;  // [size]
    int size;
    const bool *held;          // [size], NULL: none
    const double *low, *high;  // [size] bounds, NULL: none
    bool eliminate;            // one of many that share no term (poses): solved by Schur complement
    double *covariance;        // [size][size] from arrow_covariance(); 0 where held; may be NULL
};

enum { CERES_TERM_PARAMETERS = 8 };
/** A term of the cost: 1/2 loss(|residuals|^2). */
struct ceres_term {
    ceres_evaluate evaluate;
    const void *context;
    int residuals, parameters;
    int parameter[CERES_TERM_PARAMETERS];  // [parameters], indices
    double cauchy;                         // a: loss(s) = a^2 ln(1 + s/a^2); 0: loss(s) = s
};

/** Everything is borrowed from the caller. */
struct ceres_problem {
    struct ceres_parameter *parameter;
    const struct ceres_term *term;
    int parameters, terms;
    int iterations;    // at most; 0: 100
    double tolerance;  // relative change of the cost that ends them; 0: 1e-12
    double cost;       // out
};

/** Minimise the cost. STATUS_SOLVER if Ceres gives up or throws; values are then the best met. */
enum status ceres_solve(struct ceres_problem *problem, struct error *err);

#ifdef __cplusplus
}
#endif
#endif
