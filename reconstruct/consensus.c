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

#include "lookup.h"
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
static int find_neighbours(int *list, const int32_t *slot, int bin, const int span[2])
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
                            const int32_t *slot, int bin)
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
    float *field;         // [6][MERL_BINS]: sums of |z| for each channel, and of 1
};

// The fit about a bin's centroid, by differences over half a bin each way; where that leaves the
// upper hemisphere it is taken as level.
static void expand(struct say *to, const struct bin *b, const struct fit *fit)
{
    const double h = sqrt(b->centroid.theta_h / (CAP_PI / 2)) * MERL_THETA_H;
    const double step[3] = {CAP_PI / 4 * (2 * h + 1) / (MERL_THETA_H * MERL_THETA_H),
                            CAP_PI / 4 / MERL_THETA_D, CAP_PI / 2 / MERL_PHI_D};
    const double place[3] = {b->centroid.theta_h, b->centroid.theta_d, b->centroid.phi_d};
    double f[3];
    if (!fit_at(fit, b->centroid, f))
        return;
    for (int k = 0; k < 3; k++) {
        double low[3] = {place[0], place[1], place[2]}, high[3] = {place[0], place[1], place[2]};
        double down[3], up[3];
        low[k] = k < 2 ? fmax(0, place[k] - step[k]) : place[k] - step[k];
        high[k] += step[k];
        bool both = fit_at(fit, (half_diff){low[0], low[1], low[2]}, down)
                    && fit_at(fit, (half_diff){high[0], high[1], high[2]}, up);
        double below = place[k] - low[k], above = high[k] - place[k];
        to->at[k] = (float)place[k];
        for (int c = 0; c < 3; c++) {
            double s0 = both && below > 0 ? (f[c] - down[c]) / below : 0;
            double s1 = both ? (up[c] - f[c]) / above : 0;
            to->fitted[c] = (float)f[c];
            to->slope[c][k] = (float)((s0 * above + s1 * below) / (above + below));
            if (k == 0)
                to->bend[c] = (float)((s1 - s0) / (above + below));
        }
    }
}

static void hear_all(struct consensus *to, struct hearing *w, int threads)
{
    const int many = 8;  // samples in a bin: from there an expansion costs less than evaluations
    for (int i = 0; i < w->bins->count; i++)
        to->slot[w->bins->bin[i].index] = i + 1;
#pragma omp parallel for schedule(static) num_threads(threads)
    for (int i = 0; i < w->bins->count; i++)
        take_ratio(&w->ratio[i], &w->bins->bin[i], to->fit);
#pragma omp parallel for schedule(dynamic, 256) num_threads(threads)
    for (int i = 0; i < w->bins->count; i++) {
        float middle[3];
        struct ratio *own = &w->ratio[i];
        const struct bin *b = &w->bins->bin[i];
        bool heard = hear_neighbours(own, middle, w->ratio, to->slot, b->index);
        for (int c = 0; c < 3; c++) {
            own->z[c] = heard ? own->z[c] : NAN;
            to->say[i].middle[c] = heard ? middle[c] : NAN;
            to->say[i].scale[c] = 1;
            to->say[i].own[c] = own->q[c];
            to->say[i].fitted[c] = NAN;
            to->say[i].rest[c] = (float)sqrt(fmax(0, square(b->sigma[c]) - square(b->noise[c])));
        }
        to->say[i].others = (float)(1 - b->alone);
        to->say[i].bounced =
            (float)((b->bounced[0] + b->bounced[1] + b->bounced[2]) / 3 / to->strength);
        if (heard && b->count >= many)
            expand(&to->say[i], b, to->fit);
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
                to->say[i].scale[c] = (float)fmax(1, sum / weight / mean_of_normal);
        }
}

// The median over bins of |q - middle| in units of sigma, with `scatter` times the bounced light in
// it, in place of what it has of that already. `work` holds 3 values a bin.
static double typical_z(const struct consensus *to, const struct hearing *w, double scatter,
                        double *work)
{
    const double some = 0.02;    // bounced light below this tells nothing of its scatter
    const double little = 0.01;  // of a variance: what is left after what it has was taken out
    int n = 0;
    for (int i = 0; i < w->bins->count; i++)
        for (int c = 0; c < 3; c++) {
            const struct bin *b = &w->bins->bin[i];
            const struct ratio *r = &w->ratio[i];
            if (isnan(r->z[c]) || !(b->bounced[c] > some))
                continue;
            double part = square(b->bounced[c] * (1 + (double)r->q[c])) / b->count;
            double rest = square((double)r->sigma[c]) - square(w->bins->bounce_scatter) * part;
            double least = little * square((double)r->sigma[c]);
            work[n++] = fabs(r->q[c] - to->say[i].middle[c])
                        / sqrt(fmax(rest, least) + square(scatter) * part);
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
                               const struct fit *fit, const double strength[2], struct run *run,
                               struct error *err)
{
    const size_t n = (size_t)bins->count + 1;
    struct consensus c = {.fit = fit,
                          .strength = strength[0] > 0 ? strength[0] : 1,
                          .new_strength = strength[1] > 0 ? strength[1] : 1,
                          .slot = calloc(MERL_BINS, sizeof *c.slot),
                          .say = calloc(n, sizeof *c.say),
                          .bins = bins->count};
    struct hearing w = {.bins = bins,
                        .ratio = malloc(n * sizeof *w.ratio),
                        .field = calloc(6 * (size_t)MERL_BINS, sizeof *w.field)};
    double *work = malloc(3 * n * sizeof *work);
    bool ok = c.slot && c.say && w.ratio && w.field && work;
    if (ok) {
        hear_all(&c, &w, run->threads);
        find_scale(&c, &w, run->threads);
        c.bounce_scatter = find_bounce_scatter(&c, &w, work);
        *consensus = c;
        c = (struct consensus){0};  // the caller's now
    }
    rec_consensus_free(&c);
    free(w.ratio);
    free(w.field);
    free(work);
    return ok ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "no memory for the bins' neighbours");
}

void rec_consensus_free(struct consensus *consensus)
{
    free(consensus->slot);
    free(consensus->say);
    rec_lookup_free(consensus->table);
    *consensus = (struct consensus){0};
}

// The fit where a photosite measured: by the bin's expansion, or itself. false: the fit has no
// value there.
static bool fitted_at(const struct consensus *consensus, const struct say *say, const candidate *m,
                      double f[3])
{
    if (isnan(say->fitted[0]))
        return fit_at(consensus->fit, m->angles, f);
    double phi_d = m->angles.phi_d < 0 ? m->angles.phi_d + CAP_PI : m->angles.phi_d;
    double dh = m->angles.theta_h - (double)say->at[0], dd = m->angles.theta_d - (double)say->at[1];
    double dp = phi_d - (double)say->at[2];
    for (int c = 0; c < 3; c++)
        f[c] = (double)say->fitted[c] + dh * ((double)say->slope[c][0] + dh * (double)say->bend[c])
               + dd * (double)say->slope[c][1] + dp * (double)say->slope[c][2];
    return true;
}

bool rec_consensus_allows(const struct consensus *consensus, int bin, const candidate *m,
                          comparison *to)
{
    const int channels = m->channel < 0 ? 3 : 1;
    const struct say *say = consensus->slot[bin] ? &consensus->say[consensus->slot[bin] - 1] : NULL;
    double fitted[3];
    bool allowed = true;
    *to = (comparison){.residual = NAN};
    if (!say || isnan(say->middle[0]) || !fitted_at(consensus, say, m, fitted))
        return true;
    const double part = (double)say->bounced;
    *to = (comparison){.residual = (consensus->new_strength - consensus->strength) * part,
                       .others = (double)say->others,
                       .excess = -part};
    for (int k = 0; k < channels; k++) {
        int c = m->channel < 0 ? k : m->channel;
        double due = (fitted[c] + dark) * (1 + (double)say->middle[c]) - dark;
        double rest = (double)say->rest[c], scale = (double)say->scale[c];
        double far = square(too_far * scale) * (m->noise[c] + square(rest));
        allowed = allowed && square(m->f[c] - due) <= far;
        double mean = (fitted[c] + dark) * (1 + (double)say->own[c]);
        to->residual += ((m->f[c] + dark) / mean - 1) / channels;
        to->excess += m->bounced[c] * m->f[c] / mean / consensus->new_strength / channels;
    }
    return allowed;
}

void rec_consensus_widen(struct bins *bins, const struct consensus *consensus)
{
    for (int i = 0; i < bins->count; i++) {
        int slot = consensus->slot[rec_merl_index(bins->bin[i].centroid)];
        for (int c = 0; c < 3 && slot; c++)
            bins->bin[i].sigma[c] *= (double)consensus->say[slot - 1].scale[c];
    }
}
