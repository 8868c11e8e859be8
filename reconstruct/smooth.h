/* smooth.h -- fields over the bins of a table, smoothed along its axes. */
#ifndef GONIOCAM_SMOOTH_H
#define GONIOCAM_SMOOTH_H

#include "reconstruct.h"

/** Replace field [MERL_BINS] by its convolution with exp(-|dh|/l0 - |dd|/l1 - |dp|/l2), distances
 *  in bins; phi_d closes upon itself (reciprocity), the other axes end. */
void rec_smooth(float *field, const double length[3]);

#endif
