/* times.h -- exposure times as the photosites saw them. */
#ifndef GONIOCAM_TIMES_H
#define GONIOCAM_TIMES_H

#include "sample.h"

/** Replace seconds[] of the sampled photographs by times that agree with their pixels; method:
 *  times.c. stated[] are the times of the files; both [capture->photos]. Where the photographs do
 *  not contradict the stated times, these stay. Then set->...->time follow. curve_sigma: of values
 *  whose curve was recovered from the same photographs, ln, common to all shots; such a curve
 * leaves a power of all times open, which stays as it is stated. 0: values are known to be linear.
 * true: seconds[] have changed. */
bool times_estimate(double *seconds, const double *stated, int photos, struct sample_set *set,
                    const struct sensor *sensor, double curve_sigma, int threads);
#endif
