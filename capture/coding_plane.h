/* coding_plane.h -- what one component of a JPEG photograph is worth. Internal to coding.c. */
#ifndef GONIOCAM_CODING_PLANE_H
#define GONIOCAM_CODING_PLANE_H

#include "coding.h"

#include <stdio.h>

#include <jpeglib.h>

static const double CODE_ROUNDING = 1.0 / 12;  // variance

/** One component: Y, Cb or Cr, or red, green, blue, or gray. jpeg and blocks as
 *  jpeg_read_coefficients() left them; active, kept and lost are
 *  memory of its user's. */
struct plane {
    j_common_ptr jpeg;
    const jpeg_component_info *info;
    jvirt_barray_ptr blocks;
    const struct plane *first;  // of the file: tells how bright a block is
    int across, down;           // blocks
    int wide, high;             // its pixels are so many of the picture's
    double noise[3];            // variance of its noise, of those of red, green and blue
    unsigned char *active;      // [down][across] coefficients that are not 0, but the first
    float *kept, *lost;         // [down][across] variances of its codes: see struct coding
};
/** Find active, kept and lost; method: coding_plane.c. libjpeg's errors leave. */
void plane_find_worth(struct plane *plane, const struct code_noise *noise);
#endif
