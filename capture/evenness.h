/* evenness.h -- how unequal the photosites of a sensor are, and which of them are dead. */
#ifndef GONIOCAM_EVENNESS_H
#define GONIOCAM_EVENNESS_H

#include "photo.h"
#include "response.h"

/** What a flat frame tells of single photosites. Owns defect; {0} is empty; evenness_free(). */
struct evenness {
    double relative[3];  // standard deviation of their response, of the signal
    size_t *defect;      // [defects] values of the image that stand out by far, ascending
    size_t defects;
};
/** One row [count] of an evenly lit surface, less black, in DN: row y of channels 3 or of a mosaic.
 *  Begin with {0}; sums gather in it. */
struct evenness_sums {
    double excess[3], count[3];
};
enum status evenness_add(struct evenness *to, struct evenness_sums *sums, const float *row,
                         int count, int y, const char *cfa, const struct sensor *sensor,
                         struct error *err);
/** From the sums; relative is 0 where noise explains all. */
void evenness_end(struct evenness *to, const struct evenness_sums *sums);
void evenness_free(struct evenness *e);

/** Of a flat frame. STATUS_IO, STATUS_FORMAT, STATUS_MEMORY. */
enum status evenness_read(struct evenness *evenness, const char *path, const struct sensor *sensor,
                          const struct curve *curve, struct error *err);
/** The defects of row y, of `count` values: variance +inf. */
void evenness_mark(const struct evenness *evenness, int y, int count, float *variance);
#endif
