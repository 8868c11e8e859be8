/* samples.h -- the face of samples/: a renderer that makes photographs of known truth.
 *
 * It shares the camera model with calib/ and the reflectance models with reconstruct/, and none of
 * the code that inverts them.
 */
#ifndef GONIOCAM_SAMPLES_H
#define GONIOCAM_SAMPLES_H

#include "reconstruct.h"

#ifdef __cplusplus
extern "C" {
#endif

extern const struct command sam_commands[];

#ifdef __cplusplus
}
#endif
#endif
