/* bins.h -- sums of samples per MERL bin: exact over shots, so that no order of them matters. */
#ifndef GONIOCAM_BINS_H
#define GONIOCAM_BINS_H

#include "reconstruct.h"

__extension__ typedef __int128 fixed128;  // units of 2^-60

/** The sums of one bin. */
struct bin_sums {
    int64_t count;
    fixed128 w, w_f[3], w_ff[3], w_angle[3];  // the weight, times f, f^2, folded angles
    fixed128 ww_noise[3];                     // weight^2 times the variance of f
    fixed128 ww;                              // of each shot's weight, squared
    fixed128 w_systematic, w_tilt, w_spread[2], w_disc, w_bounced[3];
    fixed128 w_back, w_f_back[3], ww_noise_back[3];  // samples with phi_d < 0 before it was folded
};

/** More sums of a bin, where photographs are mosaics. */
struct mosaic_sums {
    fixed128 own_w[3], own_w_angle[3][3];  // of w, w_angle: samples of one channel
    // The same of samples that lend a channel which they did not measure, and what they lend.
    fixed128 lent_w[3], lent_w_angle[3][3], lent_w_f[3], lent_w_noise[3];  // noise: 1 sigma
};

/** Sums of the bins met so far: grows with bins, not with samples. {0} is empty. */
struct tally {
    int32_t *slot;  // [bins of the grid]: 1 + index into sums, 0 where no sample fell
    struct bin_sums *sums;
    struct mosaic_sums *mosaic;  // [as sums]; NULL: no photograph was a mosaic
    int count, room;
    struct grid grid;
};

/** STATUS_MEMORY. */
enum status rec_tally_begin(struct tally *tally, struct grid grid, struct error *err);
void rec_tally_free(struct tally *tally);
/** A number as the sums keep it. Requires |x| < 2^63. */
fixed128 rec_fix(double x);
/** And back, rounded. */
double rec_unfix(fixed128 x);
/** Add sums to those of a bin; mosaic is NULL where it has nothing to add. STATUS_MEMORY. */
enum status rec_tally_add_sums(struct tally *tally, int bin, const struct bin_sums *sums,
                               const struct mosaic_sums *mosaic, struct error *err);
/** The mosaic's sums of a bin that has sums; NULL: there are none. */
const struct mosaic_sums *rec_tally_mosaic(const struct tally *tally, int bin);
/** Means and errors of all bins; *bins is the caller's. */
enum status rec_tally_finish(struct bins *bins, const struct tally *tally, struct error *err);
/** The median over bins and channels of sigma / mean; NaN where no mean is above 0. */
double rec_median_sigma(const struct bins *bins);

#endif
