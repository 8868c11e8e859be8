/* bounce_strength.h -- how much of the board's predicted light is there, by the samples' agreement.
 */
#ifndef GONIOCAM_BOUNCE_STRENGTH_H
#define GONIOCAM_BOUNCE_STRENGTH_H

#include "bins.h"
#include "samples.h"

/** Sums of one shot, under way. */
struct shot_trend {
    double xy, xx;
};
/** Sums over shots, exact, so that no order changes them. {0} is empty. */
struct bounce_trend {
    fixed128 xy, xx, xy_xy, xy_xx, xx_xx;
    int64_t shots;
};

/** A photosite that its bin can be compared with; others (residual NAN) are passed over. */
void rec_trend_add(struct shot_trend *shot, const reflectance_sample *s);
/** The shot is over. */
void rec_trend_end_shot(struct bounce_trend *to, const struct shot_trend *shot);
void rec_trend_merge(struct bounce_trend *to, const struct bounce_trend *from);

/** A strength of the board's light and its standard deviation. */
typedef struct {
    double strength, sigma;
} bounce_strength;

/** A strength as good as none: with none at all there would be nothing to tell it by. */
extern const double rec_bounce_least;

/** The strength that the samples show, which were taken with the strength `used`; never less than
 *  the least. false: too few shots tell. Requires used > 0. */
bool rec_trend_strength(const struct bounce_trend *trend, double used, bounce_strength *seen);

/** Is there none of that light? It is there as geometry has it, or not at all, as in renderings of
 *  direct light: a strength between the two is told by what else is wrong with the samples (light
 *  near a terminator above all), and the nearer of the two is true, if all of it is out of
 *  question. false too: few shots tell. Requires used > 0. */
bool rec_trend_none(const struct bounce_trend *trend, double used);

/** The standard deviation of a strength `used`, by how well the samples agree: what they say is
 *  missing, the sigma of that, and what is wrong with the light that grows with nothing they tell
 *  of. INFINITY: too few shots tell. */
double rec_trend_sigma(const struct bounce_trend *trend, double used);

#endif
