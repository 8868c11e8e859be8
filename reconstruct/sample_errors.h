/* sample_errors.h -- what a wrong calibration does to a reflectance sample. */
#ifndef GONIOCAM_SAMPLE_ERRORS_H
#define GONIOCAM_SAMPLE_ERRORS_H

#include "footprint.h"

/** 1 sigma of ln f at fixed angles, and 1 sigma of theta_h. */
typedef struct {
    double systematic, tilt;
} shared_errors;

shared_errors rec_shared_errors(const struct viewing *viewing, const footprint *spot);

#endif
