/* lamp_model.h -- how a lamp lights a facet, as residuals with derivatives. Internal to calib/. */
#ifndef GONIOCAM_LAMP_MODEL_H
#define GONIOCAM_LAMP_MODEL_H

#include "lamp.h"
#include "lobe.h"

#ifdef __cplusplus
extern "C" {
#endif

/** A lamp's place as three numbers x that stay well-posed however far the lamp is: seen from an
 *  origin amid the scene, its direction and its inverse distance.
 *
 *      d = normalize(axis + x0 u + x1 v),   w = x2 / 1000 mm,   place = origin + d / w
 *
 *  With E the irradiance at the origin on a surface that faces the lamp, and q = d + w (origin -
 * p), a facet at p with normal n has L = f E (q.n) / |q|^3: of a point lamp exactly, and at w = 0
 * of one at infinity. */
struct lamp_chart {
    vec3 origin, axis, u, v;  // axis, u, v: unit, at right angles
};
/** The chart about a lamp's present place, and its numbers there (x0 = x1 = 0). */
struct lamp_chart cal_lamp_chart(const struct lamp *lamp, vec3 origin, double x[3]);
vec3 cal_chart_direction(const struct lamp_chart *chart, const double x[3]);
/** |x2| to mm of distance and back. */
double cal_chart_inverse_mm(double x2);

/** One facet under its lamp, ready for the solver. */
struct observation {
    const struct facet *facet;  // NULL: a highlight or a prior
    const struct lamp_chart *chart;
    vec3 point, normal, to_eye;         // in the lamp's frame
    double radius;                      // of the sample, a sphere about point - radius normal
    vec3 axis[3];                       // the world's axes in the lamp's frame
    double log_f;                       // of a patch, or a sample of known albedo
    double log_bend;                    // of the mean over the facet, over what is in its middle
    const struct lamp_strength *known;  // of a lamp: KIND_STRENGTH and its prior
    double log_power;                   // ln of the mean power of its views
    double q;                           // of vignetting
    vec3 wi;                            // of a highlight: towards what the sample mirrors
    double sigma[ECHOES];               // of the channels; of a highlight's direction; of a prior
    int view, kind;
};
enum { SHIFTS = SAMPLE_SHIFTS };  // of a sphere: x, y, z, radius
enum {
    KIND_PATCH,
    KIND_PAPER,
    KIND_SAMPLE,
    KIND_HIGHLIGHT,
    KIND_LOBE_PRIOR,
    KIND_VIGNETTING_PRIOR,
    KIND_POWER_PRIOR,
    KIND_SHAPE_PRIOR,
    KIND_PLACE_PRIOR,
    KIND_ECHO_PRIOR,
    KIND_BEAM_PRIOR,
    KIND_STRENGTH,  // lamp_strength.h
    KIND_STRENGTH_PRIOR,
    KIND_ALBEDO_PRIOR
};

/** ceres_evaluate of an observation of a facet: residuals of ln L [3]. Blocks: place, ln E [3],
 *  ln power, vignetting [2]; of a patch, shares [ECHOES] that the sample's light is larger by than
 *  predicted; of paper ln f [3] and those shares; of the sample its lobe, how far its centre is
 *  from where the outline has it [3], mm, and shares of the board's light; last, of all, the
 *  lamp's beam (beam_model.h). */
bool cal_lamp_evaluate(const void *context, double const *const *block, double *residual,
                       double **jacobian);
/** ceres_evaluate of a highlight: two residuals, how far what is mirrored is from the lamp. Blocks:
 *  place, and how far the sample's centre is from where the outline has it. */
bool cal_lamp_evaluate_highlight(const void *context, double const *const *block, double *residual,
                                 double **jacobian);
/** ceres_evaluate of the lobe's priors, and of the numbers of one block near 0 to their sigma. */
bool cal_lamp_evaluate_lobe_prior(const void *context, double const *const *block, double *residual,
                                  double **jacobian);
bool cal_lamp_evaluate_zero_prior(const void *context, double const *const *block, double *residual,
                                  double **jacobian);

#ifdef __cplusplus
}
#endif
#endif
