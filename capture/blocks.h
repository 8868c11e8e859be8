/* blocks.h -- the noise of encoded photographs, block by block. */
#ifndef GONIOCAM_BLOCKS_H
#define GONIOCAM_BLOCKS_H

#include "merge.h"

enum { BLOCK_SIDE = 8 };  // of JPEG's transform

/** How the frames of each value disagree: chi^2 about what merge_row() made of them, and its
 *  degrees of freedom (0 where fewer than two frames serve); [count] each. variance grows to that
 * of the best single frame. row as merge_row() had it. */
void blocks_disagreement(float *chi2, float *freedom, float *variance, const float *value,
                         const struct merge_row *row, const float *const *dn, const double *time,
                         int frames);
/** Give the noise in variance[rows][width][3] the size that the blocks' chi2 tells; what frames
 *  share, relative2 of the value squared, stays. The first row begins a row of blocks. */
void blocks_apply(float *variance, const float *value, const float *chi2, const float *freedom,
                  const struct merge_row *row, int rows);
#endif
