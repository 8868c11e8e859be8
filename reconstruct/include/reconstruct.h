/* reconstruct.h -- the face of reconstruct/: reflectance samples, MERL bins, models, fits.
 *
 * Directions are unit vectors in the local frame of the surface, whose normal is +z, and point
 * away from it: wi to the light, wo to the camera. Angles are in radians. f is in 1/sr and holds
 * no foreshortening: L = f I cos(theta_i) / r^2.
 */
#ifndef GONIOCAM_RECONSTRUCT_H
#define GONIOCAM_RECONSTRUCT_H

#include "calib.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- half/difference angles ---------------------------------------------------------------- */

/** The angles of h and d (see rec_half_diff) that an isotropic BRDF depends on. */
typedef struct {
    double theta_h;  // h from the normal, [0, pi/2]
    double theta_d;  // wi from h,         [0, pi/2]
    double phi_d;    // wi around h,       [-pi, pi]
} half_diff;

/** Half/difference angles of a pair of directions:
 *
 *      h = (wi + wo) / |wi + wo|       d = Ry(-theta_h) Rz(-phi_h) wi
 *
 *  Requires wi.z > 0 and wo.z > 0. Swapping wi and wo turns phi_d by pi and changes
 *  nothing else. Where theta_h = 0 or theta_d = 0, phi_d is finite but arbitrary.
 *
 *  S. Rusinkiewicz, "A New Change of Variables for Efficient BRDF Representation",
 *  Eurographics Workshop on Rendering, 1998. */
half_diff rec_half_diff(vec3 wi, vec3 wo);
/** The inverse, with the azimuth of h at 0. wi or wo may lie below the horizon. */
void rec_directions(half_diff angles, vec3 *wi, vec3 *wo);

/* ---- MERL tables ---------------------------------------------------------------------------- */

enum {
    MERL_THETA_H = 90,
    MERL_THETA_D = 90,
    MERL_PHI_D = 180,
    MERL_BINS = MERL_THETA_H * MERL_THETA_D * MERL_PHI_D
};

/** The bin of a pair of angles: phi_d + 180 (theta_d + 90 theta_h), each a whole number;
 *  theta_h is divided by its square root, and phi_d is folded to [0, pi) (reciprocity).
 *
 *  W. Matusik, H. Pfister, M. Brand, L. McMillan, "A Data-Driven Reflectance Model",
 *  SIGGRAPH 2003, and the code published with the data. */
int rec_merl_index(half_diff angles);
/** The middle of a bin: rec_merl_index(rec_merl_center(bin)) is bin. */
half_diff rec_merl_center(int bin);
/** Both directions of the bin's middle are above the horizon: true of 1,096,216 bins. */
bool rec_merl_above(int bin);
/** The bin on the other side of the plane of incidence, phi_d -> pi - phi_d: an isotropic
 *  surface without grain has the same f there. */
int rec_merl_mirror(int bin);

/** Another division of the same angles: theta_h by its square root, theta_d, and phi_d over pi. */
struct grid {
    int theta_h, theta_d, phi_d;
};
extern const struct grid rec_merl_grid;
/** How many bins it has. */
static inline int rec_grid_bins(struct grid grid)
{
    return grid.theta_h * grid.theta_d * grid.phi_d;
}
/** As rec_merl_index. */
int rec_grid_index(struct grid grid, half_diff angles);
/** The ranges of a bin: its angles from low (included) to high. */
void rec_grid_ranges(struct grid grid, int bin, half_diff *low, half_diff *high);

/** An isotropic BRDF as a table. Owns value; {0} is empty; release with rec_merl_free(). */
struct merl {
    double *value;  // [3][MERL_BINS]: red, green, blue; 1/sr; < 0 where there is none
};

/** Read a MERL file. On success the caller owns *merl; on failure it is untouched.
 *  STATUS_IO, STATUS_FORMAT (other dimensions or length, not a number) or STATUS_MEMORY. */
enum status rec_merl_read(struct merl *merl, const char *path, struct error *err);
/** Write a MERL file, complete or not at all. STATUS_IO. */
enum status rec_merl_write(const struct merl *merl, const char *path, struct error *err);
void rec_merl_free(struct merl *merl);

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
};

/** The measured bins of a grid, by index. Owns bin; {0} is empty; release with rec_bins_free(). */
struct bins {
    struct bin *bin;
    int count;
    struct grid grid;  // {0} is MERL's
};
static inline struct grid rec_grid_of(const struct bins *bins)
{
    return bins->grid.theta_h ? bins->grid : rec_merl_grid;
}
void rec_bins_free(struct bins *bins);

/* ---- models -------------------------------------------------------------------------------- */

enum { MODEL_PARAMETERS_MAX = 32 };

/** A parameter of a model: a number, or a colour of three. Physical values lie in [low, high]. */
struct parameter {
    const char *name;
    int size;  // 1 or 3
    double low, high;
};
/** A reflectance model. Its parameters stand one after another in an array of doubles, in the
 *  order of the table, colours as three. */
struct model {
    const char *name;                   // as in fits.yaml and in scenes
    const char *source;                 // the paper
    const struct parameter *parameter;  // ends with {0}
    /** f[3] for unit wi, wo with wi.z > 0 and wo.z > 0. */
    void (*eval)(const double *parameters, vec3 wi, vec3 wo, double f[3]);
};
/** All models; ends with NULL. */
extern const struct model *const rec_models[];
/** By name; NULL: there is none. */
const struct model *rec_model_find(const char *name);
/** How many doubles its parameters are. */
int rec_model_size(const struct model *model);

/* ---- fits ------------------------------------------------------------------------------------ */

/** A model fitted to bins. */
struct fit {
    const struct model *model;
    double value[MODEL_PARAMETERS_MAX];
    double
        sigma[MODEL_PARAMETERS_MAX];  // noise, and what all bins share of the calibration's errors
    double log_rms;                   // held-out bins: root mean square of ln((f m + e)/(f' m + e))
    double relative_median;           // held-out bins: median of |f'/f - 1|
    double chi;  // held-out bins: median of |residual| in units of its sigma, / 0.6745:
                 // 1 where the model errs by no more than the measurement
    int bins;    // fitted
};
/** Best first. Owns fit; {0} is empty; release with rec_fits_free(). */
struct fits {
    struct fit *fit;
    int count;
};

/** Fit models ([count], NULL: all of rec_models) to the measured bins, at their centroids, and
 *  rank them by their error on bins that the fit did not see (method: fit.c). On success the
 *  caller owns *fits. STATUS_DATA: too few bins; STATUS_SOLVER, STATUS_MEMORY. */
enum status rec_fit(struct fits *fits, const struct bins *bins, const struct model *const *models,
                    int count, struct run *run, struct error *err);
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
 *  by f / (f so averaged) of a fit (method: resolution.c). Once for any bins. */
void rec_bins_sharpen(struct bins *bins, const struct fit *fit);
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

/** Directional-hemispherical reflectance of a table, [3], by the midpoint rule in steps of half a
 *  degree: what part of the light from theta_i leaves the surface. */
void rec_table_albedo(double albedo[3], const struct merl *merl, double theta_i);

/* ---- any BRDF ---------------------------------------------------------------------------------
 */

/** A BRDF from a file: a table, or a model with its parameters. {0} is empty; rec_brdf_free(). */
struct brdf {
    struct merl table;  // empty where model is set
    const struct model *model;
    double value[MODEL_PARAMETERS_MAX];
};
/** From a MERL table, a fits.yaml (its best fit), or a folder OUT (its brdf.binary). On success
 *  the caller owns *brdf. STATUS_IO, STATUS_FORMAT, STATUS_MEMORY. */
enum status rec_brdf_read(struct brdf *brdf, const char *path, struct error *err);
void rec_brdf_free(struct brdf *brdf);
/** f[3], 1/sr; 0 below the horizon. A table answers with the bin that the directions fall into. */
void rec_brdf_eval(const struct brdf *brdf, vec3 wi, vec3 wo, double f[3]);

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
