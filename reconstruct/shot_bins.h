/* shot_bins.h -- sums of one shot's samples per bin, in double, on their way to bins.h. */
#ifndef GONIOCAM_SHOT_BINS_H
#define GONIOCAM_SHOT_BINS_H

#include "bins.h"
#include "strip.h"

enum { SHOT_TERMS = 24 };

/** Bins met in a shot so far. {.grid} is empty; memory is kept from shot to shot; rec_shot_free().
 */
struct shot_bins {
    int32_t *slot;  // [channel][lends][phi_d < 0][bins]: 1 + index into sums, 0 where no
                    // sample fell
    struct shot_sums *sums;
    int count, room;
    struct grid grid;
};

void rec_shot_free(struct shot_bins *shot);
/** Add the used lanes of a strip. STATUS_MEMORY. */
enum status rec_shot_add(struct shot_bins *shot, const struct strip *strip, struct error *err);
/** The shot is over: its sums enter the tally, and none are left. STATUS_MEMORY. */
enum status rec_shot_end(struct shot_bins *shot, struct tally *tally, struct error *err);

#endif
