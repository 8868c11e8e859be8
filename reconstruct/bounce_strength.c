/* bounce_strength.c -- how much of the board's predicted light is there, by the samples' agreement.
 *
 * Method.   Photosites of a bin see the sample under the same angles, but from different sides of
 *           the board: some get more of its light than others. Had too little or too much of it
 *           been taken out, f would fall or grow with it: y = d x, y the photosite's f over its
 *           bin's less 1, x what the board's light (at strength 1) is of that f, less the bin's,
 *           and d the missing strength, by least squares over all bins; its sigma from the scatter
 * of the shots' own sums about it, for what is wrong with a shot its photosites share. No model of
 * f is asked. Limits.   Shots that all see the board's light under the same angles alike tell
 * nothing.
 */
#include "bounce_strength.h"

#include <math.h>

enum { SHOTS_MIN = 4 };
static const double MODEL = 0.05;  // what cells leave of the light's pattern: calib/board_light.c
static const double HALF = 0.5, SURE = 4;  // a strength; sigmas that all of it is off
const double rec_bounce_least = 1e-3;

void rec_trend_add(struct shot_trend *shot, const reflectance_sample *s)
{
    if (isnan(s->residual))
        return;
    shot->xy += s->weight * s->excess * s->residual;
    shot->xx += s->weight * s->excess * s->excess;
}

void rec_trend_end_shot(struct bounce_trend *to, const struct shot_trend *shot)
{
    if (!(shot->xx > 0))
        return;
    to->shots++;
    to->xy += rec_fix(shot->xy);
    to->xx += rec_fix(shot->xx);
    to->xy_xy += rec_fix(shot->xy * shot->xy);
    to->xy_xx += rec_fix(shot->xy * shot->xx);
    to->xx_xx += rec_fix(shot->xx * shot->xx);
}

void rec_trend_merge(struct bounce_trend *to, const struct bounce_trend *from)
{
    to->shots += from->shots;
    to->xy += from->xy;
    to->xx += from->xx;
    to->xy_xy += from->xy_xy;
    to->xy_xx += from->xy_xx;
    to->xx_xx += from->xx_xx;
}

// The slope d and its sigma; false: too few shots tell.
static bool slope(const struct bounce_trend *t, double *d, double *sigma)
{
    double xx = rec_unfix(t->xx), n = (double)t->shots;
    if (t->shots < SHOTS_MIN || !(xx > 0))
        return false;
    *d = rec_unfix(t->xy) / xx;
    double scatter =
        rec_unfix(t->xy_xy) - 2 * *d * rec_unfix(t->xy_xx) + *d * *d * rec_unfix(t->xx_xx);
    *sigma = sqrt(fmax(scatter, 0) * n / (n - 1)) / xx;
    return *sigma > 0;
}

bool rec_trend_strength(const struct bounce_trend *trend, double used, bounce_strength *seen)
{
    double d, sigma;
    if (!slope(trend, &d, &sigma))
        return false;
    *seen = (bounce_strength){fmax(used + d, rec_bounce_least), sigma};
    return true;
}

bool rec_trend_none(const struct bounce_trend *trend, double used)
{
    bounce_strength seen;
    return rec_trend_strength(trend, used, &seen) && seen.strength < HALF
           && 1 - seen.strength > SURE * seen.sigma;
}

double rec_trend_sigma(const struct bounce_trend *trend, double used)
{
    double d, sigma;
    if (!slope(trend, &d, &sigma))
        return INFINITY;
    return sqrt(d * d + sigma * sigma + MODEL * MODEL * used * used);
}
