/* albedo.c -- how much of the light from a direction leaves a surface, and how sure that is.
 *
 * Method.   Midpoint sums of f cos(theta_o) over the hemisphere, in steps of half a degree.
 * Sigma.    Noise of measured bins adds in squares. What they share of the calibration's errors
 *           adds as it is. Bins that nobody measured err as the fit that filled them does on
 *           bins it did not see, all in one direction.
 */
#include "albedo.h"

#include <stdlib.h>

enum { THETA = 180, PHI = 180 };

typedef void visitor(void *user, int bin, double weight);

static void walk(double theta_i, visitor *visit, void *user)
{
    const double step_theta = CAP_PI / 2 / THETA, step_phi = CAP_PI / PHI;
    vec3 wi = {sin(theta_i), 0, cos(theta_i)};
    for (int t = 0; t < THETA; t++)
        for (int p = -PHI; p < PHI; p++) {
            double theta = (t + 0.5) * step_theta, phi = (p + 0.5) * step_phi;
            vec3 wo = {sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
            visit(user, rec_merl_index(rec_half_diff(wi, wo)),
                  sin(theta) * cos(theta) * step_theta * step_phi);
        }
}

struct summing {
    const struct merl *merl;
    double *albedo;
};

static void add_value(void *user, int bin, double weight)
{
    struct summing *s = user;
    for (int c = 0; c < 3; c++)
        s->albedo[c] += weight * fmax(0, s->merl->value[(size_t)c * MERL_BINS + (size_t)bin]);
}

void rec_table_albedo(double albedo[3], const struct merl *merl, double theta_i)
{
    struct summing sum = {merl, albedo};
    albedo[0] = albedo[1] = albedo[2] = 0;
    walk(theta_i, add_value, &sum);
}

static void add_weight(void *user, int bin, double weight)
{
    double *of_bin = user;
    of_bin[bin] += weight;
}

enum status rec_albedos(struct albedo *albedo, int count, const struct merl *table,
                        const uint8_t *state, const struct bins *bins, double fit_error,
                        struct error *err)
{
    double *weight = malloc(MERL_BINS * sizeof *weight);
    if (!weight)
        return cap_fail(err, STATUS_MEMORY, "no memory for an albedo");
    for (int i = 0; i < count; i++) {
        struct albedo *a = &albedo[i];
        double noise2[3] = {0}, shared[3] = {0};
        *a = (struct albedo){.theta_i_deg = a->theta_i_deg};
        for (int bin = 0; bin < MERL_BINS; bin++)
            weight[bin] = 0;
        walk(a->theta_i_deg * CAP_PI / 180, add_weight, weight);
        for (int bin = 0; bin < MERL_BINS; bin++)
            for (int c = 0; weight[bin] > 0 && c < 3; c++) {
                double part =
                    weight[bin] * fmax(0, table->value[(size_t)c * MERL_BINS + (size_t)bin]);
                a->value[c] += part;
                a->filled[c] += state[bin] == BIN_MEASURED ? 0 : part;
            }
        for (int k = 0; k < bins->count; k++) {
            const struct bin *b = &bins->bin[k];
            for (int c = 0; c < 3 && state[b->index] == BIN_MEASURED; c++) {
                noise2[c] += pow(weight[b->index] * b->noise[c], 2);
                shared[c] += weight[b->index] * fmax(0, b->mean[c]) * b->systematic;
            }
        }
        for (int c = 0; c < 3; c++)
            a->sigma[c] =
                sqrt(noise2[c] + shared[c] * shared[c] + pow(a->filled[c] * fit_error, 2));
    }
    free(weight);
    return STATUS_OK;
}
