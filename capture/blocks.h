/* blocks.h -- the noise of encoded photographs, block by block. */
#ifndef GONIOCAM_BLOCKS_H
#define GONIOCAM_BLOCKS_H

#include "coding.h"
#include "merge.h"
#include "response.h"

/** DN from one code to the next, at a DN of 0 to 65535: step[channel][dn / STEP_DN]. */
enum { STEPS = 4096, STEP_DN = 65536 / STEPS };
struct code_steps {
    float step[3][STEPS];
};
void blocks_steps(struct code_steps *steps, const struct curve *curve);

/** One row of the frames of encoded photographs, before and after merge_row(); all borrowed. */
struct encoded_row {
    const struct merge_row *row;  // as merge_row() had it
    const float *const *dn;       // [frames][count]
    const double *time;           // [frames]
    const float *const *kept;     // [frames] -> [blocks][3] of the row: see coding.h; NULL: unknown
    const float *const *lost;
    const struct code_steps *steps;
    int frames;
};
/** How the frames of each value disagree: the squares of what is between them and what merge_row()
 *  made of them, in variances, and how much that should be (0 where fewer than two frames serve);
 *  [count] each. variance becomes what their codes are worth together. */
void blocks_disagreement(float *chi2, float *freedom, float *variance, const float *value,
                         const struct encoded_row *encoded);
/** Give variance[rows][count] the size that the blocks' chi2 tells, and add what frames share,
 *  relative2 of the value squared; modelled: kept and lost were known. The first row begins a row
 *  of blocks. */
void blocks_apply(float *variance, const float *value, const float *chi2, const float *freedom,
                  const struct merge_row *row, bool modelled, int rows);
#endif
