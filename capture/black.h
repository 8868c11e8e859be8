/* black.h -- the black level by all that brackets know of it. */
#ifndef GONIOCAM_BLACK_H
#define GONIOCAM_BLACK_H

#include "sensor.h"

/** Make black[] of a sensor better whose levels and noise are found: black.c. left_out[] are
 *  photographs not to be asked (may be NULL). Nothing changes where black is known, or where the
 *  brackets do not tell more. */
void sensor_refine_black(struct sensor *sensor, struct bracket_sample *const sample[3], int samples,
                         const struct sensor_known *known, const bool *left_out);
#endif
