/* lamp_scale.c -- what gives lamps their scale where no patch does.
 *
 * Method.   A second capture, in which a patch (or a sample of known albedo) shows, tells a lamp's
 *           ln I_c with a covariance: what its channels share (distance, power) and what each has.
 *           That error is an unknown of the fit, one for all lamps here that are the same there:
 *
 *               ln E_c - 2 ln w + ln(mean power) = ln I_c + error_c,    w the inverse distance
 *
 *           (of a lamp at infinity: ln E_c = ln E'_c + error_c), to within what its power wavers.
 *           W = (1 - g 11^T)/s whitens an error of covariance s^2 1 + t^2 11^T.
 */
#include "lamp_scale.h"

#include <string.h>

static const double INVERSE_MIN = 1e-3;    // of x2: a kilometre
static const double STEADY = 1e-4;         // no lamp's mean power is the same to better than that
static const double ALBEDO_SIGMA = 0.002;  // the albedo's own error is not in any sigma

bool cal_lamp_evaluate_strength(const void *context, double const *const *block, double *residual,
                                double **jacobian)
{
    const struct observation *o = context;
    const double sigma = fmax(o->known->sigma_power, STEADY), x2 = fmax(block[0][2], INVERSE_MIN);
    const double far2 = o->known->at_infinity ? 0 : -2 * log(cal_chart_inverse_mm(x2));
    const bool moves = !o->known->at_infinity && block[0][2] > INVERSE_MIN;
    for (int c = 0; c < 3; c++) {
        residual[c] =
            (block[1][c] + far2 + o->log_power - o->known->log_intensity[c] - block[2][c]) / sigma;
        for (int a = 0; jacobian && a < 3; a++) {
            if (jacobian[0])
                jacobian[0][3 * c + a] = a == 2 && moves ? -2 / x2 / sigma : 0;
            if (jacobian[1])
                jacobian[1][3 * c + a] = a == c ? 1 / sigma : 0;
            if (jacobian[2])
                jacobian[2][3 * c + a] = a == c ? -1 / sigma : 0;
        }
    }
    return true;
}

bool cal_lamp_evaluate_strength_prior(const void *context, double const *const *block,
                                      double *residual, double **jacobian)
{
    const struct observation *o = context;
    const double each = fmax(o->known->sigma_each, STEADY), ratio = o->known->sigma_all / each;
    const double g = (1 - 1 / sqrt(1 + 3 * ratio * ratio)) / 3;
    double mean3 = block[0][0] + block[0][1] + block[0][2];
    for (int c = 0; c < 3; c++) {
        residual[c] = (block[0][c] - g * mean3) / each;
        for (int a = 0; jacobian && jacobian[0] && a < 3; a++)
            jacobian[0][3 * c + a] = ((a == c) - g) / each;
    }
    return true;
}

bool cal_lamp_evaluate_albedo_prior(const void *context, double const *const *block,
                                    double *residual, double **jacobian)
{
    const struct observation *o = context;
    const double half = cos(CAP_PI / 8);  // h is midway between normal and 45 degrees
    double log_f[3], *by = jacobian ? jacobian[0] : NULL;
    cal_lobe_log(block[0], 1, cos(CAP_PI / 4), half, half, log_f, by);
    for (int c = 0; c < 3; c++)
        residual[c] = (log_f[c] - o->log_f) / ALBEDO_SIGMA;
    for (int i = 0; by && i < 3 * LOBE_SIZE; i++)
        by[i] /= ALBEDO_SIGMA;
    return true;
}
