/* bins_hdf5.h -- bins.h5: the measured bins with their errors. */
#ifndef GONIOCAM_BINS_HDF5_H
#define GONIOCAM_BINS_HDF5_H

#include "reconstruct.h"

/** What bins.h5 tells besides the bins; NULL or 0: nothing. */
struct bins_about {
    const char *version, *input_hash;
    double reference_albedo;  // of the white patch; its error is not in stderr
    double lamp_solid_angle, detector_solid_angle;  // sr, largest; 0: not known
};

/** Write bins.h5, complete or not at all. status is [bins of the grid]. STATUS_IO. */
enum status rec_bins_write(const struct bins *bins, const uint8_t *status,
                           const struct bins_about *about, const char *path, struct error *err);
/** The bins with status 1 of a bins.h5 on MERL's grid. What is in sigma besides `systematic` counts
 * as noise; all of it, where the file does not tell. On success the caller owns *bins. STATUS_IO,
 * STATUS_FORMAT, STATUS_MEMORY. */
enum status rec_bins_read(struct bins *bins, const char *path, struct error *err);
/** The status [MERL_BINS] (enum bin_status) of every bin of a bins.h5. STATUS_FORMAT. */
enum status rec_bins_read_status(uint8_t *status, const char *path, struct error *err);

#endif
