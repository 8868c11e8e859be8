/* coverage.h -- which bins of the table photographs measure, or would measure if they were made. */
#ifndef GONIOCAM_COVERAGE_H
#define GONIOCAM_COVERAGE_H

#include "reconstruct.h"

#ifdef __cplusplus
extern "C" {
#endif

/** The bins that one view sees: those into which a photosite falls that shows the sample lit, a
 *  photosite away from its outline and terminator. Sorted, each once. Owns bin; {0} is empty;
 *  release with rec_seen_free(). */
struct seen_bins {
    int32_t *bin;  // rec_merl_index
    int count;
};
void rec_seen_free(struct seen_bins *seen);

/** What every view of a calibration sees, whether its photograph exists or not: only cameras,
 * poses, sample and the places of the lamps matter. Rows are `step` photosites apart: 1 for the
 * whole picture. seen is [views]; on success the caller owns its members. STATUS_MEMORY. */
enum status rec_coverage(struct seen_bins *seen, const struct calibration *calibration, int step,
                         struct run *run, struct error *err);

/** Set seen [MERL_BINS] to 1 where OUT/bins.h5 holds a measurement, to 0 elsewhere. STATUS_IO,
 *  STATUS_FORMAT, STATUS_MEMORY. */
enum status rec_coverage_measured(uint8_t *seen, const char *out, struct error *err);

/** Parts of the table's bins with both theta_i and theta_o (of the bin's middle) up to 60, 75 and
 *  90 degrees that are set in seen [MERL_BINS]. */
struct coverage {
    double within_60, within_75, whole;
};
struct coverage rec_coverage_of(const uint8_t *seen);

/** Draw which bins are set before and after, over theta_i and theta_o and over theta_h and theta_d,
 *  to FILE.png, .svg or .pdf; complete or not at all. STATUS_FORMAT (another ending), STATUS_IO,
 *  STATUS_MEMORY. */
enum status rec_coverage_draw(const uint8_t *before, const uint8_t *after, const char *path,
                              struct error *err);

#ifdef __cplusplus
}
#endif
#endif
