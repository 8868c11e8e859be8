/* checks.c -- reciprocity, isotropy, homogeneity, darkness, energy, coverage: numbers with their
 * errors. */
#include "checks.h"

#include "quantile.h"

#include <stdlib.h>

static double square(double x)
{
    return x * x;
}

static void check_reciprocity(struct checks *k, const struct bins *bins)
{
    double *size = malloc((3 * (size_t)bins->count + 1) * sizeof *size);
    double sum = 0, weights = 0;
    int n = 0;
    for (int i = 0; size && i < bins->count; i++)
        for (int c = 0; c < 3; c++) {
            const struct bin *b = &bins->bin[i];
            if (isnan(b->swapped[c]) || !(b->mean[c] > 0) || !(b->swapped_noise[c] > 0))
                continue;
            double relative = b->swapped[c] / b->mean[c], noise = b->swapped_noise[c] / b->mean[c];
            double w = 1 / (square(noise) + 1e-6);  // none is trusted beyond 0.1 %
            sum += w * relative;
            weights += w;
            k->reciprocity.chi2 += fmin(16, square(relative / noise));
            size[n++] = fabs(relative);
        }
    if (n > 0) {
        k->reciprocity.bins = n / 3;
        k->reciprocity.chi2 /= n;
        k->reciprocity.mean = sum / weights;
        // What scatters more than its noise is less certain by that much (Birge 1932).
        k->reciprocity.sigma = sqrt(fmax(1, k->reciprocity.chi2) / weights);
        k->reciprocity.typical = rec_quantile(size, n, 0.5);
    }
    free(size);
}

static int band_of(int bin)
{
    vec3 wi, wo;
    rec_directions(rec_merl_center(bin), &wi, &wo);
    int band = (int)(acos(fmax(0, fmin(wi.z, wo.z))) / (CAP_PI / 2) * COVERAGE_BANDS);
    return band < COVERAGE_BANDS ? band : COVERAGE_BANDS - 1;
}

static void check_coverage(struct checks *k, const struct bins *bins)
{
    int all[COVERAGE_BANDS] = {0};
#pragma omp parallel for schedule(static) reduction(+ : all[:COVERAGE_BANDS])
    for (int bin = 0; bin < MERL_BINS; bin++)
        if (rec_merl_above(bin))
            all[band_of(bin)]++;
    for (int i = 0; i < COVERAGE_BANDS; i++)
        k->coverage[i].bins = all[i];
    for (int i = 0; i < bins->count; i++)
        if (rec_merl_above(bins->bin[i].index))
            k->coverage[band_of(bins->bin[i].index)].measured++;
}

// What the dark side sends, over what the sample would of all of the lamp's light. Where calib took
// the board's light to be as strong as the dark side shows, its strength tells what is too much.
static void check_darkness(struct checks *k, const struct night *night,
                           const struct surroundings *around, double scatter)
{
    const double albedo = k->albedo[0].value[1], strength = around->strength;
    const double shared = strength > 0 ? around->sigma_strength / strength : 0;
    k->excess = around->told && strength > 0 ? strength - 1 : 0;
    k->sigma_excess = around->sigma_strength;
    for (int z = 0; z < NIGHT_ZONES; z++) {
        darkness d = rec_darkness(night, (enum night_zone)z, hypot(shared, scatter));
        k->dark[z] = (darkness){d.mean / albedo, d.sigma / albedo, d.shots};
    }
}

enum status rec_checks(struct checks *k, const struct bins *bins, const struct census *census,
                       const struct merl *table, const uint8_t *state, double fit_error,
                       const struct surroundings *around, struct error *err)
{
    static const double theta_deg[ALBEDO_ANGLES] = {0, 15, 30, 45, 60, 75, 85};
    *k = (struct checks){
        .isotropy = rec_unevenness(census->residuals.grain, GRAIN_CELLS),
        .homogeneity = rec_unevenness(census->residuals.place, PLACE_CELLS),
    };
    double seen = (double)(census->photosites[FATE_USED] + census->photosites[FATE_STRAY]);
    k->stray = seen > 0 ? (double)census->photosites[FATE_STRAY] / seen : 0;
    check_reciprocity(k, bins);
    check_coverage(k, bins);
    for (int i = 0; i < ALBEDO_ANGLES; i++)
        k->albedo[i].theta_i_deg = theta_deg[i];
    enum status status = rec_albedos(k->albedo, ALBEDO_ANGLES, table, state, bins, fit_error, err);
    if (!status)
        check_darkness(k, &census->night, around, bins->bounce_scatter);
    return status;
}

// Larger than 2 % and than what chance makes of nothing: rms^2 / sigma^2 is a normal deviate's z.
static bool uneven(const unevenness *u)
{
    return u->cells > 0 && u->rms > 0.02 && square(u->rms) > 4 * square(u->sigma);
}

// Light that falls on the sample from everywhere is as strong near the lit side as far from it.
static void warn_of_light(const struct checks *k, struct run *run)
{
    static const char *const remedy = ": make the room dark, cover what is bright around the "
                                      "sample, or take photographs with the "
                                      "lamp off for `ambient`";
    const darkness *dusk = &k->dark[ZONE_DUSK], *night = &k->dark[ZONE_NIGHT];
    const darkness *most = dusk->mean > night->mean ? dusk : night;
    if (k->excess > 3 * k->sigma_excess)
        cap_warn(
            run,
            "the side of the sample that the lamp does not reach is %.2f +- %.2f times as bright "
            "as the board's light makes it%s",
            1 + k->excess, k->sigma_excess, remedy);
    if (!(most->mean > 0.005 + 3 * most->sigma))
        return;
    bool fades = dusk->mean > 2 * night->mean
                 && dusk->mean - night->mean > 3 * hypot(dusk->sigma, night->sigma);
    cap_warn(run,
             "the side of the sample that the lamp does not reach shines, as if %.1f %% +- %.1f %% "
             "of the lamp's light fell there%s",
             100 * most->mean, 100 * most->sigma,
             fades ? ", and less so farther from the lit side: light comes through the sample, and "
                     "no BRDF describes that"
                   : remedy);
}

void rec_checks_warn(const struct checks *k, struct run *run)
{
    if (k->stray > 0.01)
        cap_warn(run,
                 "%.1f %% of the photosites disagree with their neighbours and were left out: look "
                 "for dust, scratches, flare, or something that stands before the sample",
                 100 * k->stray);
    if (fabs(k->reciprocity.mean) > 0.01 + 3 * k->reciprocity.sigma)
        cap_warn(run,
                 "light and camera are not interchangeable: %.1f %% +- %.1f %% on average; is the "
                 "lamp where it was found, and has it moved?",
                 100 * k->reciprocity.mean, 100 * k->reciprocity.sigma);
    if (uneven(&k->isotropy))
        cap_warn(run,
                 "reflectance changes by %.1f %% with the azimuth on the sample: it has a grain, "
                 "which an isotropic table averages over",
                 100 * k->isotropy.rms);
    if (uneven(&k->homogeneity))
        cap_warn(run,
                 "reflectance changes by %.1f %% from place to place on the sample: is it clean, "
                 "even and opaque, and the room dark?",
                 100 * k->homogeneity.rms);
    warn_of_light(k, run);
    for (int i = 0; i < ALBEDO_ANGLES; i++)
        for (int c = 0; c < 3; c++) {
            const struct albedo *a = &k->albedo[i];
            if (a->value[c] - 2 * a->sigma[c] <= 1 || a->theta_i_deg >= 80)
                continue;
            cap_warn(run,
                     "the sample returns %.1f +- %.1f %% of the light from %g degrees: is the "
                     "reference's albedo right?",
                     100 * a->value[c], 100 * a->sigma[c], a->theta_i_deg);
            return;
        }
}
