/* conserve.h -- no more light out than in. */
#ifndef GONIOCAM_CONSERVE_H
#define GONIOCAM_CONSERVE_H

#include "reconstruct.h"

/** Scale the filled bins of a table [3][MERL_BINS] down, so that no direction returns more light
 *  than it got, in any channel. state [MERL_BINS] is enum bin_status: measured bins and their
 *  mirrors stay, so that measurements which return more than all light are not hidden. */
void rec_conserve(double *value, const uint8_t *state, int threads);

#endif
