/* coding.h -- what the encoder of a JPEG photograph dropped, block by block. */
#ifndef GONIOCAM_CODING_H
#define GONIOCAM_CODING_H

#include "capture.h"

enum { BLOCK_SIDE = 8 };  // of JPEG's transform

/** What the codes of a photograph are worth, over the blocks of its full size: variances of red,
 *  green and blue, in codes. Owns kept and lost; {0} is empty: not a JPEG file. */
struct coding {
    int across, down;
    float *kept;  // [down][across][3] of what is in the file: its rounding, and the sensor's noise
    float *lost;  // [down][across][3] of what is not
};

/** Variance of the sensor's noise where a code stands, in codes. */
struct code_noise {
    double variance[256][3];
};
/** Of any file; of others than JPEG it comes out empty. STATUS_IO, STATUS_FORMAT, STATUS_MEMORY. */
enum status coding_read(struct coding *coding, const char *path, const struct code_noise *noise,
                        struct error *err);
void coding_free(struct coding *coding);
#endif
