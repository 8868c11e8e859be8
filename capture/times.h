/* times.h -- exposure times as the photosites saw them. */
#ifndef GONIOCAM_TIMES_H
#define GONIOCAM_TIMES_H

#include "sample.h"

/** Replace seconds[] of the sampled photographs by times that agree with their pixels; method:
 *  times.c. stated[] are the times of the files; both [capture->photos]. Where the photographs do
 *  not contradict the stated times, these stay. Then set->...->time follow. true: seconds[] have
 *  changed. */
bool times_estimate(double *seconds, const double *stated, int photos, struct sample_set *set,
                    const struct sensor *sensor, int threads);
#endif
