/* plan.h -- which further shots would measure most of what is not measured yet. */
#ifndef GONIOCAM_SAMPLES_PLAN_H
#define GONIOCAM_SAMPLES_PLAN_H

#include "coverage.h"
#include "rig.h"

/** A shot that is proposed. Azimuth runs from the board's x to its y, both angles are seen from the
 *  sample; rad. */
struct proposal {
    vec3 eye, target;  // mm; the target is in the middle of the picture
    double azimuth, elevation, distance;
    char lamp[64];
    bool moved;          // the lamp is to be moved, to lamp_position
    vec3 lamp_position;  // in the world; of a lamp at infinity, the unit direction to it
    double lamp_azimuth, lamp_elevation;
    int fresh;                 // bins that it adds to all before
    struct coverage coverage;  // with it
};

/** What a plan is asked for. */
struct plan_request {
    int shots;       // how many to propose
    bool move_lamp;  // may the lamp be moved?
};

/** Propose shots one after another, each the best with those before it (method: plan.c), and add
 *  their bins to seen [MERL_BINS]. proposal is [request.shots]; *found is how many there are: fewer
 *  where nothing more can be won. STATUS_DATA: no place is left for a camera. STATUS_MEMORY. */
enum status sam_plan(struct proposal *proposal, int *found, uint8_t *seen, const struct rig *rig,
                     struct plan_request request, struct run *run, struct error *err);

#endif
