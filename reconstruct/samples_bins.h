/* samples_bins.h -- samples.h5 read back into bins. */
#ifndef GONIOCAM_SAMPLES_BINS_H
#define GONIOCAM_SAMPLES_BINS_H

#include "reconstruct.h"

/** Is it a file of HDF5's, and one of samples rather than of bins? */
bool rec_is_hdf5(const char *path);
bool rec_has_samples(const char *path);
/** The bins of all samples of a samples.h5, as reconstruct makes them but for what it knows
 * besides: the lens's blur is left in the highlight, and bins of a mosaic borrow no channel from
 * their neighbours. On success the caller owns *bins. STATUS_IO; STATUS_FORMAT: a dataset is
 * missing or of another size, or a sample is no measurement; STATUS_DATA: too few bins;
 * STATUS_MEMORY. */
enum status rec_samples_bins(struct bins *bins, const char *path, struct run *run,
                             struct error *err);

#endif
