/* overlay.h -- pictures of what the calibration found. */
#ifndef GONIOCAM_OVERLAY_H
#define GONIOCAM_OVERLAY_H

#include "calib.h"

/** OUT/overlay/SHOT.png for each view: the photograph with the tags that were found, the way from
 *  each corner's projection to its measured place (magnified), the outlines of sample and balls,
 *  the highlights that the calibration predicts on them (crosses) and those seen (rings). Each file
 *  is complete or absent.
 *  STATUS_IO, STATUS_MEMORY. */
enum status cal_overlay(const struct calibration *c, const struct capture *capture, const char *out,
                        struct run *run, struct error *err);

#endif
