/* sgd.h -- what sgd.c computes besides its model. */
#ifndef GONIOCAM_SGD_H
#define GONIOCAM_SGD_H

#include "microfacet.h"

/** Upper incomplete gamma function, integral of t^(a-1) exp(-t) from x to infinity, for x > 0 and
 *  a of either sign, |a| < 20; accurate to about 1e-13. */
double rec_upper_gamma(double a, double x);
/** kap, which normalises D; and D. */
double rec_sgd_normalisation(double alpha, double p);
double rec_sgd_slopes(facet a, double alpha, double p, double kap);
#endif
