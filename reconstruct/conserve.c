/* conserve.c -- no more light out than in.
 *
 * Method.   The directional albedo is M + F, what measured and what filled bins return. Where it is
 *           above 1, F may be scaled by s = (1 - M)/F. A bin between theta_i and theta_o serves
 *           both directions, and takes the smaller s of the two: f stays reciprocal, and F falls
 *           by s at least. Albedos are summed at every second degree.
 */
#include "conserve.h"

#include "hemisphere.h"

enum { ANGLES = 46 };

struct share {
    const double *value;
    const uint8_t *state;
    double measured[3], filled[3];
};

static void add(void *user, vec3 wi, vec3 wo, double weight)
{
    struct share *s = user;
    int bin = rec_merl_index(rec_half_diff(wi, wo));
    double *to = s->state[bin] == BIN_EXTRAPOLATED ? s->filled : s->measured;
    for (size_t c = 0; c < 3; c++)
        to[c] += weight * fmax(0, s->value[c * MERL_BINS + (size_t)bin]);
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
        struct share s = {.value = value, .state = state};
        rec_hemisphere(theta, add, &s);
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
