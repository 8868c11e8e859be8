/* quantile.h -- order statistics. */
#ifndef GONIOCAM_QUANTILE_H
#define GONIOCAM_QUANTILE_H

/** The q-quantile of value[count], 0 <= q <= 1, without interpolation; reorders value[]. NaN where
 *  there is none. Requires that no value is NaN. */
double rec_quantile(double *value, int count, double q);

#endif
