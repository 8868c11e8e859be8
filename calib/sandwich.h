/* sandwich.h -- standard deviations that stay true where errors are shared. Internal to calib/. */
#ifndef GONIOCAM_SANDWICH_H
#define GONIOCAM_SANDWICH_H

#include "ceres_shim.h"

/** Standard deviations of all numbers of a solved problem, one parameter after another, 0 where
 *  held: sigma [sum of sizes]. Terms with the same cluster[term] ([terms], 0..clusters-1, or -1:
 *  independent of all) may share errors; sigma comes from
 *
 *      H^-1 (sum over clusters of g g^T) H^-1,     g the gradient of a cluster,
 *
 *  and is never below sqrt(diag H^-1). P. J. Huber, "The behavior of maximum likelihood estimates
 *  under nonstandard conditions", 1967; clusters: Liang and Zeger 1986.
 *  STATUS_DATA: the terms leave unknowns undetermined. */
enum status cal_sandwich(double *sigma, const struct ceres_problem *problem, const int *cluster,
                         int clusters, struct error *err);
/** The same with all that the numbers share: covariance [numbers][numbers]. Where the formal
 *  variance of a number is the larger one, its row and column grow with it. */
enum status cal_sandwich_covariance(double *covariance, const struct ceres_problem *problem,
                                    const int *cluster, int clusters, struct error *err);
/** The same where terms may share errors in two ways, such as views and places on a board: B is the
 *  sum over the clusters of both, less that over those that terms share in both ways, and no number
 *  is surer than by the first way alone. A. C. Cameron, J. B. Gelbach, D. L. Miller, "Robust
 *  inference with multiway clustering", Journal of Business & Economic Statistics, 2011. */
enum status cal_sandwich_two_ways(double *covariance, const struct ceres_problem *problem,
                                  const int *cluster, int clusters, const int *other, int others,
                                  struct error *err);
#endif
