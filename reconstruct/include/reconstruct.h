/* reconstruct.h -- the face of reconstruct/: reflectance samples, MERL bins, fits; what
 * a renderer needs of it (tables, models, their evaluation and sampling) is in brdf.h beside it.
 *
 * Directions are unit vectors in the local frame of the surface, whose normal is +z, and point
 * away from it: wi to the light, wo to the camera. Angles are in radians. f is in 1/sr and holds
 * no foreshortening: L = f I cos(theta_i) / r^2.
 */
#ifndef GONIOCAM_RECONSTRUCT_H
#define GONIOCAM_RECONSTRUCT_H

#include "brdf.h"
#include "calib.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- bins ------------------------------------------------------------------------------------ */

/** A MERL bin that samples fell into. */
struct bin {
    int32_t index;       // rec_grid_index of its samples
    int32_t count;       // of photosites
    half_diff centroid;  // of the samples, phi_d folded to [0, pi); within the bin
    half_diff own[3];    // the centroid of each channel's samples: others than that in a mosaic
    bool lent[3];        // of a mosaic: no photosite here measured this channel, but those around
    double mean[3];      // f, 1/sr; noise may take dark ones below 0
    double sigma[3];     // of the mean: noise, geometry, lamp, and the bin's width
    double noise[3];     // the part of sigma that more photographs would reduce
    double scatter[3];   // standard deviation of the samples
    double swapped[3];   // mean of the samples with phi_d >= 0 less that of the others; NAN: one
                         // kind only. Reciprocity says 0.
    double swapped_noise[3];  // 1 sigma of swapped by noise alone
    double sharpened[3];      // what the mean was multiplied by, less 1
    double bounced[3];        // light from the lit board that was taken out, over what is left
    double systematic;        // relative: the part of sigma that is shared, at fixed angles
    double tilt;              // 1 sigma of theta_h
    double spread[2];  // variance of the normal over a photosite, towards h and across it, rad^2
    double alone;      // 1 over the number of shots (and sides of phi_d) that share in it: 1 to 0
    double disc;       // variance of wi over the lamp's disc, each way, rad^2
};

/** The measured bins of a grid, by index. Owns bin; {0} is empty; release with rec_bins_free(). */
struct bins {
    struct bin *bin;
    int count;
    struct grid grid;       // {0} is MERL's
    double bounce_scatter;  // of the board's light in a photosite, relative, that is in noise
    double blur2;  // variance that the lens adds to a photosite's 1/12, px^2: mean over shots
};
static inline struct grid rec_grid_of(const struct bins *bins)
{
    return bins->grid.theta_h ? bins->grid : rec_merl_grid;
}
void rec_bins_free(struct bins *bins);

/* ---- fits ------------------------------------------------------------------------------------ */

/** What a fit makes small, over all bins; m = cos_i cos_o, e = 1e-3. */
enum fit_cost {
    FIT_STATISTICAL,  // ln((f m + e)/(f' m + e)) in units of its sigma, Cauchy's loss
    FIT_LOG,          // the same with one sigma for all
    FIT_CUBE_ROOT,    // |(f - f') m|^(2/3)
    FIT_PICTURE       // what lit spheres' pictures show, lamps anywhere in front, with some FIT_LOG
};

/** A model fitted to bins. */
struct fit {
    const struct model *model;
    double value[MODEL_PARAMETERS_MAX];
    double
        sigma[MODEL_PARAMETERS_MAX];  // noise, and what all bins share of the calibration's errors
    double covariance[MODEL_PARAMETERS_MAX * MODEL_PARAMETERS_MAX];  // [size][size]
    double log_rms;          // held-out bins: root mean square of ln((f m + e)/(f' m + e))
    double relative_median;  // held-out bins: median of |f'/f - 1|
    double chi;              // held-out bins: median of |residual| in units of its sigma, / 0.6745:
                             // 1 where the model errs by no more than the measurement
    int bins;                // fitted
    // Of a sphere's picture beside that of the complete table, lit by a lamp, and by a window and
    // a sky; method: fit_pictures.c. Decibels, and the mean CIEDE2000. 0: not known.
    double psnr[2], delta_e[2];
};
/** Best first. Owns fit; {0} is empty; release with rec_fits_free(). */
struct fits {
    struct fit *fit;
    int count;
};

/** Fit models ([count], NULL: all of rec_models, the few that a reconstruction tries, and where
 * the best of them is far from the bins all of rec_models_more) to the measured bins, at their
 * centroids, and rank them by their error on bins that the fit did not see (method: fit.c), by the
 * statistical cost. On success the caller owns *fits. STATUS_DATA: too few bins; STATUS_SOLVER,
 * STATUS_MEMORY. */
enum status rec_fit(struct fits *fits, const struct bins *bins, const struct model *const *models,
                    int count, struct run *run, struct error *err);
/** The same, with a cost of one's choice. */
enum status rec_fit_by(struct fits *fits, const struct bins *bins, enum fit_cost cost,
                       const struct model *const *models, int count, struct run *run,
                       struct error *err);
/** Complete psnr and delta_e of all fits, from the table that they stand for, prepared. */
enum status rec_fit_pictures(struct fits *fits, const struct brdf *table, struct run *run,
                             struct error *err);
void rec_fits_free(struct fits *fits);
/** fits.yaml: {models: [{name, parameters: {NAME: {value, sigma}}, errors, source}]}, best first.
 *  Written complete or not at all: STATUS_IO. Reading: STATUS_IO, or STATUS_FORMAT with file and
 *  line: not YAML, no models, a model or parameter that is unknown, missing or out of its range. */
enum status rec_fits_write(const struct fits *fits, const char *path, struct error *err);
enum status rec_fits_read(struct fits *fits, const char *path, struct error *err);

/** Fit the same models again, from where they are, to bins that changed a little. Their errors on
 *  held-out bins stay. */
enum status rec_fit_again(struct fits *fits, const struct bins *bins, struct run *run,
                          struct error *err);

/** Move each channel's mean from its own centroid to the shared one, by the ratio of a fit there.
 *  What the fit does not tell, a channel that it has at 0, stays. Again does nothing more. */
void rec_bins_align(struct bins *bins, const struct fit *fit);
/** A photosite averages f over the normals it spans, which blunts a highlight: multiply the means
 *  by f / (f so averaged) of a fit (method: resolution.c), in place of what an earlier call
 *  multiplied them by. Returns the largest change of a mean, in units of its noise. */
double rec_bins_sharpen(struct bins *bins, const struct fit *fit);
/** What it did, once sigma is complete: bins in which it changed a channel by more than 1 %, those
 *  of them whose sigma it makes more than all else does, and the largest change. */
struct sharpening {
    int bins, uncertain;
    double largest;
};
struct sharpening rec_bins_sharpening(const struct bins *bins);
/** Complete bin.sigma with what a fit tells: errors of theta_h times the slope of f, the bend of f
 *  across the bin, and a fifth of what rec_bins_sharpen changes. */
void rec_bins_widen(struct bins *bins, const struct fit *fit);

/** A measured table of bins, e.g. of another program, as bins to fit: those above the horizon and
 *  not negative, at their centers. Their errors are not known: 1 % is assumed. STATUS_MEMORY. */
enum status rec_bins_of_table(struct bins *bins, const struct merl *merl, struct error *err);

/* ---- the complete table -----------------------------------------------------------------------
 */

/** Where the value of a bin comes from, as in bins.h5. */
enum bin_status { BIN_IMPOSSIBLE, BIN_MEASURED, BIN_INTERPOLATED, BIN_EXTRAPOLATED };

/** Fill a table: a value, never negative, in every bin whose center is above the horizon, -1 in
 *  the others (also where samples fell into the upper part of such a bin). A measured bin holds
 *  its mean times fit(center)/fit(centroid); an unmeasured one takes its mirror bin's measurement,
 *  or the fit times a correction that its measured neighbours agree on (method: fill.c).
 *  On success the caller owns *merl. status [MERL_BINS] may be NULL. STATUS_MEMORY. */
enum status rec_fill(struct merl *merl, uint8_t *status, const struct bins *bins,
                     const struct fit *fit, struct run *run, struct error *err);

/** Directional-hemispherical reflectance of a table, [3], each bin holding one value: what part of
 *  the light from theta_i leaves the surface. */
void rec_table_albedo(double albedo[3], const struct merl *merl, double theta_i);

/* ---- the whole job ----------------------------------------------------------------------------
 */

/** What reconstruct tells at its end. Lengths in mm. */
struct summary {
    int shots, left_out, bins, warnings;
    double rms_px;                       // of the tags' corners, the median over shots
    double sigma_center, sigma_lamp;     // of the sample's centre; of the least certain lamp, or 0
    double used, seen;                   // photosites, and all that see the sample
    double within_60, within_80, whole;  // part of the bins with both angles up to 60, 80, 90 deg
    double median_sigma;                 // of the bins' relative sigma
    double albedo, sigma_albedo;         // for light from 0 degrees, green
    double glare, sigma_glare;           // share of light that the lens spreads; 0: none found
    struct fit best;
};
/** What reconstruct is asked for: folders CAPTURE and OUT; a calibration.yaml to start from, or
 *  NULL; whether every sample is to be kept in OUT/samples.h5; a grid for
 *  OUT/bins_HxDxP.h5 besides that of bins.h5, or {0}. */
struct request {
    const char *capture, *out, *calibration;
    bool samples;
    struct grid grid;
};
/** CAPTURE -> OUT: radiance/, calibration.yaml, bins.h5, fits.yaml, brdf.binary, preview.png,
 *  run.json. */
enum status rec_reconstruct(struct summary *summary, const struct request *request, struct run *run,
                            struct error *err);

extern const struct command rec_commands[];

#ifdef __cplusplus
}
#endif
#endif
