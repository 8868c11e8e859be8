/* gather.h -- all shots of a calibrated capture become bins. */
#ifndef GONIOCAM_GATHER_H
#define GONIOCAM_GATHER_H

#include "bounce_strength.h"
#include "consensus.h"
#include "night.h"
#include "residuals.h"
#include "samples.h"
#include "samples_hdf5.h"

/** Where the photosites went. Photosites whose ray misses the sample are not counted. */
struct census {
    int64_t photosites[FATES];
    int64_t bounced_ppm;  // sum over used photosites: the part of radiance that the board brought
    int shots;
    struct night night;
    // Of the used photosites, where a consensus was given:
    struct residuals residuals;
    struct bounce_trend trend;
};

void rec_census_add(struct census *to, const struct census *from);

/** Read OUT/radiance/SHOT.exr of every view and bin its samples. The result is the same to the
 *  last bit for any number of threads and any order of the views; memory is one map and one tally
 *  a thread. board may be NULL, consensus (nothing is known of f yet)
 *  and samples (where samples.h5 is not wanted) too. fine (may be NULL) are the same samples on
 *  its own grid. STATUS_IO and others of
 * the maps; STATUS_DATA: no sample at all. */
enum status rec_gather(struct bins *bins, struct bins *fine, struct census *census,
                       const struct calibration *calibration, const struct board_extent *board,
                       const struct blockers *blockers, const struct consensus *consensus,
                       struct samples_file *samples, const char *out, struct run *run,
                       struct error *err);

#endif
