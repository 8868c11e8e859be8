/* seek.h -- the sample looked for where nobody said that it is. Internal to calib/. */
#ifndef GONIOCAM_SEEK_H
#define GONIOCAM_SEEK_H

#include "solid.h"

#ifdef __cplusplus
extern "C" {
#endif

/** How a sample is looked for: photographs at reduced size, and how well any outline fits them.
 *  Owns what it holds; {0} is empty. */
struct seek;
/** From OUT/radiance/SHOT.exr of some views of a calibration, which it borrows. nominal: the
 *  sample, its shape and size. STATUS_MEMORY, STATUS_IO. */
enum status cal_seek_begin(struct seek **seek, const struct calibration *calibration,
                           const struct sample *nominal, const char *out, struct run *run,
                           struct error *err);
void cal_seek_end(struct seek *seek);
/** The part of the sample's outline at which photographs show an edge, 0 to 1, where it stands. */
enum status cal_seek_score(double *score, const struct seek *seek, const struct sample *sample,
                           struct error *err);
/** A place of the sample, as cal_solid_move() takes it, and its score there. */
struct place {
    vec3 turn, shift;
    double score;
    int index;  // of the search: settles ties
};
enum { PLACES = 6 };
/** The places within `extent` of sample->center, each way, that have the largest scores, to about a
 *  twentieth of the sample's size: place [PLACES], best first, *count of them. lowest: of the
 * centre's z in the world. The same for any number of threads. STATUS_MEMORY. */
enum status cal_seek_find(struct place *place, int *count, const struct seek *seek,
                          const struct sample *sample, double extent, double lowest,
                          struct run *run, struct error *err);

#ifdef __cplusplus
}
#endif
#endif
