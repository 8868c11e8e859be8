/* merge.h -- the frames of a bracket become one linear value with its variance. */
#ifndef GONIOCAM_MERGE_H
#define GONIOCAM_MERGE_H

#include "capture.h"

/** What merging a row needs to know of each of its values (channels interleaved), in DN. Owns
 *  its memory; {0} is empty; release with merge_row_free(). */
struct merge_row {
    int count;
    float *black;
    float *usable;     // of DN
    float *verge;      // 1 / (2 standard deviations of a frame at `usable`), 1/DN
    float *read2;      // variance of read noise, DN^2
    float *slope;      // variance per signal, DN
    float *relative2;  // variance of the photosite's response, of the signal squared
    float *full;       // 1 / (white - black)
    float *scale;      // DN per second to radiance; full at first
};
/** For 3 channels, or for the row y of a mosaic: its cell is cfa, "RGGB". */
enum status merge_row_make(struct merge_row *row, const struct sensor *sensor, int width,
                           const char *cfa, int y, struct error *err);
void merge_row_free(struct merge_row *row);
/** Set scale: full, divided by flat ([count], may be NULL). */
void merge_row_scale(struct merge_row *row, const float *flat);

/** Merge dn[frames][count], times in seconds, ascending; see merge.c. */
void merge_row(float *value, float *variance, const struct merge_row *row, const float *const *dn,
               const double *time, int frames);
#endif
