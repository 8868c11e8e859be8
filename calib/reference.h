/* reference.h -- how strong the lamps are, by a capture of its own. Internal to calib/. */
#ifndef GONIOCAM_REFERENCE_H
#define GONIOCAM_REFERENCE_H

#include "calib.h"

/** Merge and calibrate the capture that `capture->reference` names, into OUT/reference/ (its maps
 *  are kept there for the next run), and take from it how strong the named lamps of *calibration
 *  are: fills known, and intensities to start from. Lamps go by name; a reference with one lamp has
 *  that for all. STATUS_FORMAT: it names another reference, or has no sample for an albedo;
 *  STATUS_DATA: it was taken with another camera, lacks a patch or a lamp; else the statuses of
 *  cap_capture_read(), cap_merge() and cal_calibrate(). */
enum status reference_strengths(struct calibration *calibration, const struct capture *capture,
                                const char *out, struct run *run, struct error *err);
#endif
