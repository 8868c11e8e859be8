/* fill.c -- the complete table from the measured bins and a fit.
 *
 * Method.   ratio = mean / fit at a measured bin's centroid carries it to the bin's center, and to
 *           its mirror bin. For the others, l = ln((mean + e)/(fit + e)) is smoothed over the
 *           measured and mirrored bins by normalised convolution, first widely, then what that
 *           leaves narrowly; far from any measurement it fades to 0, the fit itself.
 */
#include "conserve.h"
#include "smooth.h"

#include <stdlib.h>

// e: 0.1 % reflectance; below it a ratio says nothing.
static const double dark = 1e-3 / CAP_PI;

// Lengths of the kernels in bins of theta_h, theta_d, phi_d, wide and narrow: some 6 and 1.5
// degrees of theta_d, twice that of phi_d, whose degrees are shorter.
static const double lengths[2][3] = {{6, 6, 24}, {1.5, 1.5, 6}};
// The weight of "no correction": that of one bin, known to 2 %, four lengths away.
static const double fading = 0.0183;

// Everything about a fill. Fields are [MERL_BINS], colours [3][MERL_BINS].
struct filling {
    const struct bins *bins;
    const struct fit *fit;
    int threads;
    double *value;              // the table under construction
    uint8_t *state;             // enum bin_status
    float *weight, *log_ratio;  // at bins with data; 0 elsewhere
    float *sum, *correction;    // [4][MERL_BINS] smoothed fields; [3][MERL_BINS]
};

static size_t at(int c, int bin)
{
    return (size_t)c * MERL_BINS + (size_t)bin;
}

static void fill_with_fit(struct filling *g)
{
#pragma omp parallel for schedule(static) num_threads(g->threads)
    for (int bin = 0; bin < MERL_BINS; bin++) {
        vec3 wi, wo;
        double f[3] = {-1, -1, -1};
        rec_directions(rec_merl_center(bin), &wi, &wo);
        g->state[bin] = BIN_IMPOSSIBLE;
        if (wi.z > 0 && wo.z > 0) {
            g->fit->model->eval(g->fit->value, wi, wo, f);
            g->state[bin] = BIN_EXTRAPOLATED;
        }
        for (int c = 0; c < 3; c++)
            g->value[at(c, bin)] = f[c];
    }
}

// A measurement (mean, at a centroid where the fit is `fitted`) takes a bin.
static void take(struct filling *g, const struct bin *b, const double fitted[3], int bin,
                 enum bin_status state)
{
    bool above = g->state[bin] != BIN_IMPOSSIBLE;
    g->state[bin] = (uint8_t)state;
    double error = 0;
    for (int c = 0; c < 3; c++) {
        double mean = fmax(0, b->mean[c]);
        double *value = &g->value[at(c, bin)];
        g->log_ratio[at(c, bin)] = (float)log((mean + dark) / (fitted[c] + dark));
        error += b->sigma[c] / (mean + dark) / 3;
        if (above)
            *value = fitted[c] > dark ? *value * (mean / fitted[c]) : mean;
    }
    g->weight[bin] = (float)(1 / (1 + error * error / (0.02 * 0.02)));
}

static void take_measurements(struct filling *g)
{
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < g->bins->count; i++) {
            const struct bin *b = &g->bins->bin[i];
            int bin = pass ? rec_merl_mirror(b->index) : b->index;
            double fitted[3];
            vec3 wi, wo;
            rec_directions(b->centroid, &wi, &wo);
            if (wi.z <= 0 || wo.z <= 0)
                continue;
            g->fit->model->eval(g->fit->value, wi, wo, fitted);
            if (!pass)
                take(g, b, fitted, bin, BIN_MEASURED);
            else if (g->state[bin] == BIN_EXTRAPOLATED)
                take(g, b, fitted, bin, BIN_INTERPOLATED);
        }
}

// correction += what the data say beyond it, smoothed over one set of lengths.
static void correct(struct filling *g, const double length[3])
{
#pragma omp parallel for schedule(dynamic) num_threads(g->threads)
    for (int k = 0; k < 4; k++) {
        float *field = g->sum + at(k, 0);
        for (int i = 0; i < MERL_BINS; i++)
            field[i] = k == 3 ? g->weight[i]
                              : g->weight[i] * (g->log_ratio[at(k, i)] - g->correction[at(k, i)]);
        rec_smooth(field, length);
    }
    const float *weight = g->sum + at(3, 0);
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < MERL_BINS; i++)
            g->correction[at(c, i)] += g->sum[at(c, i)] / (weight[i] + (float)fading);
}

static void apply_correction(struct filling *g)
{
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < MERL_BINS; i++)
            if (g->state[i] == BIN_EXTRAPOLATED) {
                double *value = &g->value[at(c, i)];
                *value = fmax(0, (*value + dark) * exp((double)g->correction[at(c, i)]) - dark);
            }
}

enum status rec_fill(struct merl *merl, uint8_t *status, const struct bins *bins,
                     const struct fit *fit, struct run *run, struct error *err)
{
    const size_t n = MERL_BINS;
    struct filling g = {
        .bins = bins,
        .fit = fit,
        .threads = run->threads,
        .value = malloc(3 * n * sizeof *g.value),
        .state = malloc(n),
        .weight = calloc(n, sizeof *g.weight),
        .log_ratio = calloc(3 * n, sizeof *g.log_ratio),
        .sum = malloc(4 * n * sizeof *g.sum),
        .correction = calloc(3 * n, sizeof *g.correction),
    };
    bool ok = g.value && g.state && g.weight && g.log_ratio && g.sum && g.correction;
    if (ok) {
        fill_with_fit(&g);
        take_measurements(&g);
        correct(&g, lengths[0]);
        correct(&g, lengths[1]);
        apply_correction(&g);
        rec_conserve(g.value, g.state, g.threads);
        for (size_t i = 0; status && i < n; i++)
            status[i] = g.state[i];
        merl->value = g.value;
        g.value = NULL;  // the caller's now
    }
    free(g.value);
    free(g.state);
    free(g.weight);
    free(g.log_ratio);
    free(g.sum);
    free(g.correction);
    return ok ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "no memory for the complete table");
}
