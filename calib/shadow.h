/* shadow.h -- lamps by the shadow that a sphere casts on the board. Internal to calib/. */
#ifndef GONIOCAM_SHADOW_H
#define GONIOCAM_SHADOW_H

#include "shadow_edge.h"

/** Fill CUE_SHADOW of the lamps of a finished calibration with a sphere, from where they are; and
 *  the radius of lamps whose size nobody told, where their shadows' penumbra shows one (radius and
 *  sigma_radius stay 0 elsewhere). Where no shadow falls on bare board in sight there is no such
 *  cue. Reads OUT/radiance/SHOT.exr. STATUS_IO, STATUS_MEMORY. */
enum status cal_shadow_cues(struct calibration *calibration, const struct capture *capture,
                            const char *out, struct run *run, struct error *err);

/** The cue of lamp l by fitted pieces ([count]) on a board with this normal; its sigma is 0 where
 *  they do not tell. STATUS_MEMORY. */
enum status shadow_cue(struct lamp_cue *cue, const struct calibration *calibration, int l,
                       const struct shadow_piece *piece, int count, vec3 board_normal,
                       struct error *err);
/** The radius of the lamp that cast a shadow with these pieces, and its sigma; 0 where it is not
 *  six sigmas. Fits the pieces. */
double shadow_size(struct shadow_piece *piece, int count, double most, struct run *run,
                   double *sigma);
#endif
