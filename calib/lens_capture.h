/* lens_capture.h -- cameras from a capture of their own. Internal to calib/. */
#ifndef GONIOCAM_LENS_CAPTURE_H
#define GONIOCAM_LENS_CAPTURE_H

#include "calib.h"

/** Is this a capture folder (it has a capture.yaml, and no calibration.yaml)? */
bool lens_capture_is(const char *folder);
/** Merge and calibrate the capture in `folder`, cameras and poses only, into OUT/lens/: its maps
 *  are kept there for the next run. On success the caller owns *calibration. Statuses are those of
 *  cap_capture_read, cap_merge and cal_geometry; STATUS_FORMAT where it names a capture in turn. */
enum status lens_capture_calibrate(struct calibration *calibration, const char *folder,
                                   const char *out, struct run *run, struct error *err);
#endif
