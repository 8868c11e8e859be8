/* checks.h -- is it physics? What a run found about its material and its measurement. */
#ifndef GONIOCAM_CHECKS_H
#define GONIOCAM_CHECKS_H

#include "albedo.h"
#include "gather.h"

enum { ALBEDO_ANGLES = 7, COVERAGE_BANDS = 9 };

struct checks {
    // f(wi, wo) against f(wo, wi), over bins that hold both kinds and channels.
    struct {
        int bins;
        double mean, sigma;  // of the relative difference, signed
        double typical;      // its median size
        double chi2;         // mean of (difference / its noise)^2, outliers at most 16
    } reciprocity;
    unevenness isotropy, homogeneity;
    struct albedo albedo[ALBEDO_ANGLES];
    // By the larger of theta_i and theta_o, in bands of 10 degrees.
    struct {
        int bins, measured;
    } coverage[COVERAGE_BANDS];
    darkness dark[NIGHT_ZONES];   // where the lamp does not reach: parts of its light
    double excess, sigma_excess;  // of the dark side over the board's predicted light on it
    double stray;  // part of the photosites that were left out because neighbours disagree
};

/** state and fit_error as for rec_albedos; around: the board's light. STATUS_MEMORY. */
enum status rec_checks(struct checks *checks, const struct bins *bins, const struct census *census,
                       const struct merl *table, const uint8_t *state, double fit_error,
                       const struct surroundings *around, struct error *err);
/** Tell the person what to look at. */
void rec_checks_warn(const struct checks *checks, struct run *run);

#endif
