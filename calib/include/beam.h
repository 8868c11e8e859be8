/* beam.h -- lamps that shine less to the side than along their axis. */
#ifndef GONIOCAM_BEAM_H
#define GONIOCAM_BEAM_H

#include "program.h"

/** A lamp's light times (cos a / cosine)^exponent, a the angle from the axis: its intensity is that
 *  towards the sample, at the angle of which cos a is `cosine`. exponent 0: alike on all sides. */
struct beam {
    vec3 axis;  // unit, away from the lamp, in its frame
    double exponent, cosine;
    double sigma_axis, sigma_exponent;  // sigma_axis: rad, each way
};

/** The share in a unit direction away from the lamp, in the axis's frame; small and above 0 behind
 *  the lamp. */
double cal_beam_share(const struct beam *beam, vec3 away);

#endif
