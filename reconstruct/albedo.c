/* albedo.c -- how much of the light from a direction leaves a surface, and how sure that is.
 *
 * Method.   Sums over the directions of hemisphere.c, of a table between the middles of its bins.
 * Sigma.    Noise of measured bins adds in squares. What they share of the calibration's errors
 *           adds as it is. Bins that nobody measured err as the fit that filled them does on
 *           bins it did not see, all in one direction.
 */
#include "albedo.h"

#include "hemisphere.h"
#include "lookup.h"

#include <stdlib.h>

struct summing {
    const struct brdf *brdf;
    double *albedo;
};

static void add_value(void *user, vec3 wi, vec3 wo, double weight)
{
    struct summing *s = user;
    double f[3];
    rec_brdf_eval(s->brdf, wi, wo, f);
    for (int c = 0; c < 3; c++)
        s->albedo[c] += weight * f[c];
}

void rec_brdf_albedo(double albedo[3], const struct brdf *brdf, double theta_i)
{
    struct summing sum = {brdf, albedo};
    albedo[0] = albedo[1] = albedo[2] = 0;
    rec_hemisphere(theta_i, add_value, &sum);
}

void rec_table_albedo(double albedo[3], const struct merl *merl, double theta_i)
{
    const struct brdf brdf = {.table = *merl};
    rec_brdf_albedo(albedo, &brdf, theta_i);
}

static void add_weight(void *user, vec3 wi, vec3 wo, double weight)
{
    double *of_bin = user;
    of_bin[rec_merl_index(rec_half_diff(wi, wo))] += weight;
}

// What measured bins know of an albedo, by the weights of bins.
static void add_errors(struct albedo *a, const double *weight, const uint8_t *state,
                       const struct bins *bins, double fit_error)
{
    double noise2[3] = {0}, shared[3] = {0};
    for (int k = 0; k < bins->count; k++) {
        const struct bin *b = &bins->bin[k];
        for (int c = 0; c < 3 && state[b->index] == BIN_MEASURED; c++) {
            double part = weight[b->index] * fmax(0, b->mean[c]);
            noise2[c] += pow(weight[b->index] * b->noise[c], 2);
            shared[c] += part * b->systematic;
            a->filled[c] -= part;
        }
    }
    for (int c = 0; c < 3; c++) {
        a->filled[c] = fmax(0, a->filled[c]);
        a->sigma[c] = sqrt(noise2[c] + shared[c] * shared[c] + pow(a->filled[c] * fit_error, 2));
    }
}

enum status rec_albedos(struct albedo *albedo, int count, const struct merl *table,
                        const uint8_t *state, const struct bins *bins, double fit_error,
                        struct error *err)
{
    struct brdf brdf = {.table = *table};
    double *weight = malloc(MERL_BINS * sizeof *weight);
    if (!weight)
        return cap_fail(err, STATUS_MEMORY, "no memory for an albedo");
    enum status status = rec_lookup_make(&brdf.lookup, table, err);
    for (int i = 0; !status && i < count; i++) {
        struct albedo *a = &albedo[i];
        double theta_i = a->theta_i_deg * CAP_PI / 180;
        *a = (struct albedo){.theta_i_deg = a->theta_i_deg};
        rec_brdf_albedo(a->value, &brdf, theta_i);
        for (int bin = 0; bin < MERL_BINS; bin++)
            weight[bin] = 0;
        rec_hemisphere(theta_i, add_weight, weight);
        for (int c = 0; c < 3; c++)
            a->filled[c] = a->value[c];
        add_errors(a, weight, state, bins, fit_error);
    }
    rec_lookup_free(brdf.lookup);
    free(weight);
    return status;
}
