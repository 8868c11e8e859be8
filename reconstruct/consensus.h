/* consensus.h -- what a bin's neighbours say of it: where f should be, and by how much it strays.
 */
#ifndef GONIOCAM_CONSENSUS_H
#define GONIOCAM_CONSENSUS_H

#include "samples.h"

/** The say of a measured bin's neighbours. */
struct say {
    float middle[3];  // (f + e)/(fit + e), less 1; NAN: too few
    float scale[3];   // real scatter over what sigma predicts, >= 1
    float rest[3];    // 1 sigma of f besides noise, 1/sr
    float own[3];     // the bin's own (f + e)/(fit + e), less 1
    float bounced;    // what the board's light, at strength 1, is of f; mean of the channels
    float others;     // what part of the bin is not one shot's own: 0 of one shot's, to 1 of many's
    // The fit about the bin's centroid, in a bin of many samples; fitted[0] NAN: not expanded.
    float at[3], fitted[3], slope[3][3], bend[3];  // theta_h, theta_d, phi_d; bend: of theta_h
};
/** What all bins' neighbours say. Owns slot, say and table; {0} is empty; rec_consensus_free(). */
struct consensus {
    const struct fit *fit;  // borrowed: f is told relative to it
    int32_t *slot;          // [MERL_BINS]: 1 + index into say; 0: not measured
    struct say *say;        // [bins]
    int bins;
    struct lookup *table;  // f in all directions, where the board's light asks for it; or NULL
    // Of the board's light that was taken out of the bins, and that is from the samples.
    double strength, new_strength;
    double bounce_scatter;  // 1 sigma of a photosite's bounced light, relative to that light
    double bounce_caution;  // 1 sigma of all of it, as it was before samples were compared
};

/** One photosite's f and its variance, as in reflectance_sample. */
typedef struct {
    half_diff angles;
    int channel;
    double f[3], noise[3], bounced[3];
} candidate;

/** How it differs from its bin. */
typedef struct {
    // f over the bin's own, less 1, mean of its channels; NAN: nothing is known. The bin's is
    // what it is at the new strength.
    double residual;
    double others;  // the part of the bin that is other shots', which residual shows
    double excess;  // what the board's light, at strength 1, is of the bin's f, less the bin's
} comparison;

/** Form it from measured bins whose sigma is complete (method: consensus.c). On success the caller
 *  owns *consensus. strength: of the board's light that was taken out of the bins, and of that
 *  which will be taken out of the samples. STATUS_MEMORY. */
enum status rec_consensus_make(struct consensus *consensus, const struct bins *bins,
                               const struct fit *fit, const double strength[2], struct run *run,
                               struct error *err);
void rec_consensus_free(struct consensus *consensus);

/** Is what was measured in a bin what its neighbours allow? */
bool rec_consensus_allows(const struct consensus *consensus, int bin, const candidate *m,
                          comparison *to);

/** Multiply the sigmas of bins, of any grid, by the scale of their neighbourhood (R. T. Birge, "The
 *  calculation of errors by the method of least squares", Physical Review 40, 1932: locally). */
void rec_consensus_widen(struct bins *bins, const struct consensus *consensus);

#endif
