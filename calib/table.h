/* table.h -- a calibration as a table for people. Internal to calib/. */
#ifndef GONIOCAM_TABLE_H
#define GONIOCAM_TABLE_H

#include "calib.h"

/** What was found and how well; what is good, what is not, and what to photograph again. */
void cal_print_table(const struct calibration *c, FILE *to);
#endif
