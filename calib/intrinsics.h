/* intrinsics.h -- what is known of cameras before they are calibrated. Internal to calib/. */
#ifndef GONIOCAM_INTRINSICS_H
#define GONIOCAM_INTRINSICS_H

#include "bundle.h"

/** Nothing is known. */
struct lens_prior intrinsics_unknown(void);
/** Where photographs leave a camera open: what nobody told in *prior becomes what cameras are like
 *  (a centre in the middle of the image to 1 % of its longer side, square pixels to 0.03 %, p1 and
 *  p2 of 0.0005). Borrows both. */
void intrinsics_assume_usual(struct lens_prior *prior, const struct camera *camera);
/** What capture.yaml's `camera` tells of the camera of one kind: *camera receives the values of its
 *  file, or of the capture that it names (calibrated into OUT/lens), and *prior says how far they
 *  are held; without a file nothing is known. STATUS_IO,
 *  STATUS_FORMAT (what the file is not), STATUS_DATA (it holds no camera of this size). */
enum status intrinsics_prior(struct lens_prior *prior, struct camera *camera,
                             const struct capture *capture, int kind, const char *out,
                             struct run *run, struct error *err);
/** The camera in a calibration that took photographs of that size: by name where several did. NULL:
 *  none. */
const struct camera *intrinsics_match(const struct calibration *c, const struct camera *like);
#endif
