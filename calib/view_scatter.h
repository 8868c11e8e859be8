/* view_scatter.h -- standard deviations from what the views pull apart. Internal to calib/. */
#ifndef GONIOCAM_VIEW_SCATTER_H
#define GONIOCAM_VIEW_SCATTER_H

/** Standard deviations sigma[n] of a fit whose errors are shared within a view: the roots of the
 *  diagonal of
 *
 *      H^-1 (sum over views of g g^T) H^-1,    times seen / (seen - 1),
 *
 *  H^-1 inverse[n][n], g gradient[views][n] at the solution (zero: the view is not in the fit, and
 *  not seen). Never below those of H^-1: few views know little of their own scatter. The same for
 *  problems of Ceres: cal_sandwich(). */
void cal_view_scatter(double *sigma, const double *inverse, const double *gradient, int n,
                      int views);

#endif
