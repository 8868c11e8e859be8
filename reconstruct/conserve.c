/* conserve.c -- no more light out than in.
 *
 * Method.   The directional albedo is M + F, what measured and what filled bins return. Where it is
 *           above 1, F may be scaled by s = (1 - M)/F. A bin between theta_i and theta_o serves
 * both directions, and takes the smaller s of the two: f stays reciprocal, and F falls by s at
 *           least. Albedos are midpoint sums in steps of 1 degree, at every second degree.
 */
#include "conserve.h"

enum { STEPS = 90, ANGLES = 46 };

struct share {
    double measured[3], filled[3];
};

static struct share share_at(const double *value, const uint8_t *state, double theta_i)
{
    const double step = CAP_PI / 2 / STEPS;
    struct share sum = {{0}, {0}};
    vec3 wi = {sin(theta_i), 0, cos(theta_i)};
    for (int t = 0; t < STEPS; t++)
        for (int p = -2 * STEPS; p < 2 * STEPS; p++) {
            double theta = (t + 0.5) * step, phi = (p + 0.5) * step;
            vec3 wo = {sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
            int bin = rec_merl_index(rec_half_diff(wi, wo));
            double w = sin(theta) * cos(theta) * step * step;
            double *to = state[bin] == BIN_EXTRAPOLATED ? sum.filled : sum.measured;
            for (size_t c = 0; c < 3; c++)
                to[c] += w * fmax(0, value[c * MERL_BINS + (size_t)bin]);
        }
    return sum;
}

// The scale at an angle: the smaller of the two beside it.
static double scale_at(const double *scale, double cosine)
{
    double at = acos(fmin(1, cosine)) / (CAP_PI / 2) * (ANGLES - 1);
    int i = (int)at < ANGLES - 2 ? (int)at : ANGLES - 2;
    return fmin(scale[i], scale[i + 1]);
}

void rec_conserve(double *value, const uint8_t *state, int threads)
{
    double scale[3][ANGLES];
    bool all_below = true;
#pragma omp parallel for schedule(dynamic) num_threads(threads) reduction(&& : all_below)
    for (int k = 0; k < ANGLES; k++) {
        // Not quite 90 degrees: there, nothing is above the horizon on the far side.
        double theta = fmin(89.5, 90.0 * k / (ANGLES - 1)) * CAP_PI / 180;
        struct share s = share_at(value, state, theta);
        for (int c = 0; c < 3; c++) {
            bool above = s.measured[c] + s.filled[c] > 1 && s.filled[c] > 0;
            scale[c][k] = above ? fmax(0, 1 - s.measured[c]) / s.filled[c] : 1;
            all_below = all_below && !above;
        }
    }
    if (all_below)
        return;
#pragma omp parallel for schedule(static) num_threads(threads)
    for (int bin = 0; bin < MERL_BINS; bin++) {
        vec3 wi, wo;
        if (state[bin] != BIN_EXTRAPOLATED)
            continue;
        rec_directions(rec_merl_center(bin), &wi, &wo);
        for (size_t c = 0; c < 3; c++)
            value[c * MERL_BINS + (size_t)bin] *=
                fmin(scale_at(scale[c], wi.z), scale_at(scale[c], wo.z));
    }
}
