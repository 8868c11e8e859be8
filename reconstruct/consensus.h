/* consensus.h -- what a bin's neighbours say of it: where f should be, and by how much it strays.
 */
#ifndef GONIOCAM_CONSENSUS_H
#define GONIOCAM_CONSENSUS_H

#include "samples.h"

/** The say of each bin's neighbours. Owns its arrays; {0} is empty; rec_consensus_free(). */
struct consensus {
    const struct fit *fit;  // borrowed: f is told relative to it
    float (*middle)[3];     // [MERL_BINS] (f + e)/(fit + e) of the neighbours, less 1; NAN: too few
    float (*scale)[3];      // [MERL_BINS] real scatter over what sigma predicts, >= 1
    float (*rest)[3];       // [MERL_BINS] 1 sigma of f besides noise, 1/sr
    double bounce_scatter;  // 1 sigma of a photosite's bounced light, relative to that light
};

/** Form it from measured bins whose sigma is complete (method: consensus.c). On success the caller
 *  owns *consensus. STATUS_MEMORY. */
enum status rec_consensus_make(struct consensus *consensus, const struct bins *bins,
                               const struct fit *fit, struct run *run, struct error *err);
void rec_consensus_free(struct consensus *consensus);

/** Is a sample, with wi and wo in its local frame, what the neighbours of its bin allow?
 *  *residual: f over what they say, less 1, mean of its channels; NAN: they say nothing. */
bool rec_consensus_allows(const struct consensus *consensus, const reflectance_sample *sample,
                          vec3 wi, vec3 wo, double *residual);

/** Multiply the sigmas of the bins by the scale of their neighbourhood (R. T. Birge, "The
 *  calculation of errors by the method of least squares", Physical Review 40, 1932: locally). */
void rec_consensus_widen(struct bins *bins, const struct consensus *consensus);

#endif
