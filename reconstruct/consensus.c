/* consensus.c -- what a bin's neighbours say of it.
 *
 * Method.   q = (f + e)/(fit + e) - 1 is smooth over the table whatever the fit misses, so a bin's
 *           neighbours tell where it should be: the median of their q, over a few bins each way.
 *           The bin's own q less that, in units of its sigma, is a z-score that has seen no truth.
 *           Its mean size over a neighbourhood, over that of a normal deviate, sqrt(2/pi), is how
 *           much more f scatters from shot to shot and photosite to photosite than sigma predicts:
 *           what a wrong calibration, dust or flare do to images each in its own way.
 *           Where single photosites scatter the more the more of their light the board brought,
 *           that part is told apart, as a noise in proportion to that light.
 * Limits.   An error that all neighbours share is not seen here: `systematic` is there for it.
 */
#include "consensus.h"

#include "quantile.h"
#include "smooth.h"

#include <stdlib.h>

enum { FEW = 8, NEIGHBOURS_MAX = 3 * 9 * 17, H_REACH = 1 };
// e: 0.1 % reflectance; below it a ratio says nothing.
static const double dark = 1e-3 / CAP_PI;
// How far neighbours may be in theta_d and phi_d, in bins: the second where the first has too few.
static const int reach[2][2] = {{2, 4}, {4, 8}};
static const double lengths[3] = {2, 4, 8};  // over which the scale is taken, in bins
static const double far_out = 4;  // z-scores count as this at most: outliers are not scale
static const double too_far = 6;  // z-score of a photosite that is left out
static const double median_of_normal = 0.6744897501960817;

/** A measured bin relative to the fit. */
struct ratio {
    float q[3], sigma[3], z[3];  // z NAN: too few neighbours
};

static double square(double x)
{
    return x * x;
}

static bool fit_at(const struct fit *fit, half_diff angles, double f[3])
{
    vec3 wi, wo;
    rec_directions(angles, &wi, &wo);
    if (wi.z <= 0 || wo.z <= 0)
        return false;
    fit->model->eval(fit->value, wi, wo, f);
    return true;
}

static void take_ratio(struct ratio *r, const struct bin *b, const struct fit *fit)
{
    double f[3];
    bool above = fit_at(fit, b->centroid, f);
    for (int c = 0; c < 3; c++) {
        r->q[c] = above ? (float)((b->mean[c] + dark) / (f[c] + dark) - 1) : NAN;
        r->sigma[c] = above ? (float)(b->sigma[c] / (f[c] + dark)) : NAN;
    }
}

// The measured neighbours of a bin, as places in the list; their number. slot [MERL_BINS] is 1 +
// the place of a bin, or 0. phi_d closes upon itself.
static int find_neighbours(int *list, const int *slot, int bin, const int span[2])
{
    int p = bin % MERL_PHI_D, d = bin / MERL_PHI_D % MERL_THETA_D;
    int h = bin / (MERL_PHI_D * MERL_THETA_D), n = 0;
    for (int i = -H_REACH; i <= H_REACH; i++)
        for (int j = -span[0]; j <= span[0]; j++)
            for (int k = -span[1]; k <= span[1]; k++) {
                bool itself = i == 0 && j == 0 && k == 0;
                if (itself || h + i < 0 || h + i >= MERL_THETA_H || d + j < 0
                    || d + j >= MERL_THETA_D)
                    continue;
                int around = (p + k + MERL_PHI_D) % MERL_PHI_D;
                int at = slot[around + MERL_PHI_D * (d + j + MERL_THETA_D * (h + i))];
                if (at)
                    list[n++] = at - 1;
            }
    return n;
}

// The median of the neighbours' q, and the z-score of the bin's own; false: too few neighbours.
static bool hear_neighbours(struct ratio *own, float middle[3], const struct ratio *ratio,
                            const int *slot, int bin)
{
    int list[NEIGHBOURS_MAX], n = 0;
    for (int wider = 0; wider < 2 && n < FEW; wider++)
        n = find_neighbours(list, slot, bin, reach[wider]);
    for (int c = 0; c < 3; c++) {
        double q[NEIGHBOURS_MAX];
        int m = 0;
        for (int i = 0; i < n; i++)
            if (!isnan(ratio[list[i]].q[c]))
                q[m++] = ratio[list[i]].q[c];
        if (m < FEW || isnan(own->q[c]))
            return false;
        middle[c] = (float)rec_quantile(q, m, 0.5);
        // The variance of a median of m normal deviates is pi/2 / m of one's.
        double sigma = own->sigma[c] * sqrt(1 + CAP_PI / 2 / m);
        own->z[c] = sigma > 0 ? (float)((own->q[c] - middle[c]) / sigma) : NAN;
    }
    return true;
}

/** Scratch of the making: one entry a measured bin, and fields over the table. */
struct hearing {
    const struct bins *bins;
    struct ratio *ratio;  // [bins]
    int *slot;            // [MERL_BINS] 1 + place in bins, or 0
    float *field;         // [6][MERL_BINS]: sums of |z| for each channel, and of 1
};

static void hear_all(struct consensus *to, struct hearing *w, int threads)
{
    for (int i = 0; i < w->bins->count; i++)
        w->slot[w->bins->bin[i].index] = i + 1;
#pragma omp parallel for schedule(static) num_threads(threads)
    for (int i = 0; i < w->bins->count; i++)
        take_ratio(&w->ratio[i], &w->bins->bin[i], to->fit);
    for (int b = 0; b < MERL_BINS; b++)
        for (int c = 0; c < 3; c++) {
            to->middle[b][c] = NAN;
            to->scale[b][c] = 1;
        }
#pragma omp parallel for schedule(dynamic, 256) num_threads(threads)
    for (int i = 0; i < w->bins->count; i++) {
        float middle[3];
        struct ratio *own = &w->ratio[i];
        int bin = w->bins->bin[i].index;
        bool heard = hear_neighbours(own, middle, w->ratio, w->slot, bin);
        for (int c = 0; c < 3; c++) {
            const struct bin *b = &w->bins->bin[i];
            to->middle[bin][c] = heard ? middle[c] : NAN;
            own->z[c] = heard ? own->z[c] : NAN;
            to->rest[bin][c] = (float)sqrt(fmax(0, square(b->sigma[c]) - square(b->noise[c])));
        }
    }
}

static void find_scale(struct consensus *to, struct hearing *w, int threads)
{
#pragma omp parallel for schedule(dynamic) num_threads(threads)
    for (int k = 0; k < 6; k++) {
        float *field = w->field + (size_t)k * MERL_BINS;
        for (int i = 0; i < w->bins->count; i++) {
            double z = w->ratio[i].z[k % 3];
            if (!isnan(z))
                field[w->bins->bin[i].index] = k < 3 ? (float)fmin(fabs(z), far_out) : 1;
        }
        rec_smooth(field, lengths);
    }
    const double mean_of_normal = sqrt(2 / CAP_PI);
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < w->bins->count; i++) {
            size_t bin = (size_t)w->bins->bin[i].index;
            double sum = w->field[(size_t)c * MERL_BINS + bin];
            double weight = w->field[((size_t)c + 3) * MERL_BINS + bin];
            if (weight > 0)
                to->scale[bin][c] = (float)fmax(1, sum / weight / mean_of_normal);
        }
}

// The median over bins of |q - middle| in units of sigma, with `scatter` times the bounced light in
// it. `work` holds 3 values a bin.
static double typical_z(const struct consensus *to, const struct hearing *w, double scatter,
                        double *work)
{
    const double some = 0.02;  // bounced light below this tells nothing of its scatter
    int n = 0;
    for (int i = 0; i < w->bins->count; i++)
        for (int c = 0; c < 3; c++) {
            const struct bin *b = &w->bins->bin[i];
            const struct ratio *r = &w->ratio[i];
            if (isnan(r->z[c]) || !(b->bounced[c] > some))
                continue;
            double extra = scatter * b->bounced[c] / sqrt(b->count);
            work[n++] =
                fabs(r->q[c] - to->middle[b->index][c]) / hypot(r->sigma[c], extra * (1 + r->q[c]));
        }
    return n > 100 * FEW ? rec_quantile(work, n, 0.5) : 0;
}

// The scatter that makes residuals as large as their sigmas say: the root of a falling function.
static double find_bounce_scatter(const struct consensus *to, const struct hearing *w, double *work)
{
    double low = 0, high = 1;
    if (!(typical_z(to, w, 0, work) > median_of_normal))
        return 0;
    for (int k = 0; k < 12; k++) {
        double middle = (low + high) / 2;
        if (typical_z(to, w, middle, work) > median_of_normal)
            low = middle;
        else
            high = middle;
    }
    return (low + high) / 2;
}

enum status rec_consensus_make(struct consensus *consensus, const struct bins *bins,
                               const struct fit *fit, struct run *run, struct error *err)
{
    const size_t n = (size_t)bins->count + 1;
    struct consensus c = {.fit = fit,
                          .middle = malloc(MERL_BINS * sizeof *c.middle),
                          .scale = malloc(MERL_BINS * sizeof *c.scale),
                          .rest = calloc(MERL_BINS, sizeof *c.rest)};
    struct hearing w = {.bins = bins,
                        .ratio = malloc(n * sizeof *w.ratio),
                        .slot = calloc(MERL_BINS, sizeof *w.slot),
                        .field = calloc(6 * (size_t)MERL_BINS, sizeof *w.field)};
    double *work = malloc(3 * n * sizeof *work);
    bool ok = c.middle && c.scale && c.rest && w.ratio && w.slot && w.field && work;
    if (ok) {
        hear_all(&c, &w, run->threads);
        find_scale(&c, &w, run->threads);
        c.bounce_scatter = find_bounce_scatter(&c, &w, work);
        *consensus = c;
        c = (struct consensus){0};  // the caller's now
    }
    rec_consensus_free(&c);
    free(w.ratio);
    free(w.slot);
    free(w.field);
    free(work);
    return ok ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "no memory for the bins' neighbours");
}

void rec_consensus_free(struct consensus *consensus)
{
    free(consensus->middle);
    free(consensus->scale);
    free(consensus->rest);
    *consensus = (struct consensus){0};
}

bool rec_consensus_allows(const struct consensus *consensus, const reflectance_sample *sample,
                          vec3 wi, vec3 wo, double *residual)
{
    const int bin = rec_merl_index(sample->angles), channels = sample->channel < 0 ? 3 : 1;
    double fitted[3];
    bool allowed = true;
    *residual = NAN;
    if (isnan(consensus->middle[bin][0]))
        return true;
    consensus->fit->model->eval(consensus->fit->value, wi, wo, fitted);
    *residual = 0;
    for (int k = 0; k < channels; k++) {
        int c = sample->channel < 0 ? k : sample->channel;
        double due = (fitted[c] + dark) * (1 + (double)consensus->middle[bin][c]) - dark;
        double rest = (double)consensus->rest[bin][c], scale = (double)consensus->scale[bin][c];
        double far = square(too_far * scale) * (sample->noise[c] + square(rest));
        allowed = allowed && square(sample->f[c] - due) <= far;
        *residual += (sample->f[c] - due) / (due + dark) / channels;
    }
    return allowed;
}

void rec_consensus_widen(struct bins *bins, const struct consensus *consensus)
{
    for (int i = 0; i < bins->count; i++)
        for (int c = 0; c < 3; c++)
            bins->bin[i].sigma[c] *= (double)consensus->scale[bins->bin[i].index][c];
}
