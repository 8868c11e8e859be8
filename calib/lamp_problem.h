/* lamp_problem.h -- the least-squares problem of lamp_fit.c. Internal to calib/. */
#ifndef GONIOCAM_LAMP_PROBLEM_H
#define GONIOCAM_LAMP_PROBLEM_H

#include "ceres_shim.h"
#include "lamp_state.h"

/** How far any sample, with its lobe, strays from the model to begin with, relative. */
extern const double lamp_floor_sample;

/** A least-squares problem over a state, which its parameters point into. */
struct lamp_problem {
    struct observation *observation;
    struct ceres_term *term;
    struct ceres_parameter *parameter;
    bool *held;  // all true, room for the largest block
    int terms, parameters;
    int at_intensity, at_power, at_vignetting, at_paper, at_lobe, at_echo, at_lit, at_strength,
        at_still, at_beam, at_shift;  // first; beams and shift are the last (lamp_state.c)
};

/** From all evidence that the present lamps light. Owned by the caller: lamp_problem_free().
 *  STATUS_MEMORY. */
enum status lamp_problem_make(struct lamp_problem *p, struct lamp_state *s,
                              const struct calibration *c, const struct capture *capture,
                              const struct lamp_evidence *e, struct error *err);
void lamp_problem_free(struct lamp_problem *p);

#endif
