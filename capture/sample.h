/* sample.h -- some rows of all shots of a camera, to learn from. */
#ifndef GONIOCAM_SAMPLE_H
#define GONIOCAM_SAMPLE_H

#include "sensor.h"

/** Bands of rows, sorted into channels: channel[c][samples]. Owns all; {0} is empty. */
struct sample_set {
    struct bracket_sample *channel[3];
    int samples;  // one a shot that could be read
    // Bands of `rows` rows of `width` pixels, beginning with a whole cell of the mosaic.
    int width, rows;
    char cfa[CFA_SIZE];  // "": all channels everywhere
};

/** Read bands of the shots of a camera, spread over the height of the image, some 400000 pixels
 *  in all; encoded photographs as codes. Damaged photographs are passed over: the merge tells about
 *  them. STATUS_MEMORY; STATUS_DATA: no shot can be read. */
enum status sample_read(struct sample_set *set, const struct capture *capture, int camera,
                        const double *seconds, const struct run *run, struct error *err);
/** A set of its own with the same values. false: no memory, and nothing to free. */
bool sample_copy(struct sample_set *copy, const struct sample_set *set);
void sample_free(struct sample_set *set);
#endif
