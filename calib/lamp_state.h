/* lamp_state.h -- the unknowns of lamp_fit.c: where they start, and what they mean in the end.
 * Internal to calib/. */
#ifndef GONIOCAM_LAMP_STATE_H
#define GONIOCAM_LAMP_STATE_H

#include "lamp_model.h"

enum { LAMP_KINDS = KIND_SAMPLE + 1 };
/** The unknowns. Owns its arrays; lamp_state_free(). */
struct lamp_state {
    struct lamp_chart *chart;         // [lamps]
    double (*place)[3], (*log_e)[3];  // [lamps]
    double *sigma_inverse;            // [lamps] of place[2], when solved
    bool *far;                        // [lamps]: held at infinity
    double (*beam)[3];                // [lamps], beam_model.h; exponent 0: there is none
    bool beams_free;                  // those that are there are unknowns
    double *log_power;                // [views]
    double (*strength)[3];            // [lamps] by what ln intensity is more than the reference has
    double log_paper[3], lobe[LOBE_SIZE];
    double still[SHIFTS];  // 0: what does not move
    double shift[SHIFTS];  // of a sphere: centre, radius, from what its outline says
    // By what share the sample's light on the board, and the board's on the sample, is more than
    // predicted.
    double echo[ECHOES], lit[ECHOES];
    double (*vignetting)[2];   // [cameras]
    double scale[LAMP_KINDS];  // of the facets' sigmas
    double doubt;              // by what the sigmas of the sample's facets are larger than that
    double misfit;             // of ln radiance: how far the sample's facets are off the model
};
/** All scales alike; the rest as lamp_state_start says. Both: false, out of memory. */
bool lamp_state_make(struct lamp_state *s, const struct calibration *c, double scale);
void lamp_state_free(struct lamp_state *s);
/** Starting values: places from the lamps, irradiances from the patch (without one, from the
 *  lamps), paper and sample from them. */
bool lamp_state_start(struct lamp_state *s, const struct calibration *c,
                      const struct capture *capture, const struct lamp_evidence *evidence);

/** The mean of exp(log_power) over a lamp's views. */
double lamp_mean_power(const struct lamp_state *s, const struct calibration *c, int lamp);

/** A covariance of all unknowns: places [lamps][3], ln E [lamps][3], ln power [views], ..., and
 *  last the sample's shift [SHIFTS]. */
struct lamp_spread {
    double *covariance;  // [numbers][numbers]
    int numbers;
};
double lamp_covariance(const struct lamp_spread *spread, int a, int b);
/** Lamps, powers, vignetting, paper and lobe into the calibration, with sigmas. */
void lamp_keep(struct calibration *c, const struct lamp_state *s, bool with_sample,
               const struct lamp_spread *spread);
void lamp_keep_shift(struct sample_shift *shift, const struct lamp_state *s,
                     const struct lamp_spread *spread);
#endif
