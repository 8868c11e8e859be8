/* beam_model.h -- the fall-off of a lamp to the side, as numbers of the fit. Internal to calib/. */
#ifndef GONIOCAM_BEAM_MODEL_H
#define GONIOCAM_BEAM_MODEL_H

#include "lamp_model.h"

enum { BEAM_NUMBERS = 3 };
/** A beam's numbers: axis = normalize(-chart.axis + b0 u + b1 v), away from the lamp, and the
 *  exponent b2. ln of its share at q (lamp_model.h), 0 at the chart's origin, with derivatives;
 *  q_by_x is that of q, d_by_x that of the lamp's direction by the first two of x. */
double beam_log(const struct lamp_chart *chart, const double x[3], const double b[BEAM_NUMBERS],
                vec3 q, const vec3 q_by_x[3], double by_x[3], double by_b[BEAM_NUMBERS]);
/** Numbers from a lamp, and back with the sigmas of their covariance. */
void beam_to_numbers(double b[BEAM_NUMBERS], const struct lamp *lamp,
                     const struct lamp_chart *chart);
void beam_from_numbers(struct lamp *lamp, const double b[BEAM_NUMBERS], const double x[3],
                       const struct lamp_chart *chart,
                       double covariance[BEAM_NUMBERS][BEAM_NUMBERS]);

/** Is a lamp's fall-off what board and sample disagree about? They see it in other directions. */
bool beam_suspected(const struct lamp *lamp);
/** Begin with a little fall-off about the way to the sample. */
void beam_begin(struct lamp *lamp);
/** Was there really any, by its sigma? */
bool beam_found(const struct lamp *lamp);

#endif
