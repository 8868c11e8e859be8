/* compare.c -- two BRDFs at the middles of MERL's bins.
 *
 * Method.   Bins are far from equal in solid angle. A mean over directions weighs a bin by what it
 *           covers of both hemispheres, dw_i dw_o = 4 cos(theta_d) dw_h dw_d; a mean over even
 * angles (theta_i, theta_o, phi), as in the papers, by that over sin(theta_i) sin(theta_o). So the
 *           grid resolves highlights, and the integrals are those of the papers.
 * Source.   A. Ngan, F. Durand, W. Matusik, "Experimental Analysis of BRDF Models", EGSR 2005;
 *           J. Low, J. Kronander, A. Ynnerman, J. Unger, "BRDF Models for Accurate and Efficient
 *           Rendering of Glossy Surfaces", ACM TOG 2012.
 */
#include "compare.h"

#include "quantile.h"

#include <stdlib.h>

const double rec_compare_band[COMPARE_BANDS] = {30, 60, 75, 85, 90};

// Both BRDFs at the middle of a bin.
struct pair {
    double a[3], b[3];
    double cos_i, cos_o, sin_i, sin_o;
    double solid;  // dw_i dw_o but for a factor
    int band;      // -1: left out
};

// False where a table has nothing to say.
static bool value_at(double f[3], const struct brdf *brdf, int bin, vec3 wi, vec3 wo)
{
    const double *table = brdf->table.value;
    for (int c = 0; table && c < 3; c++)
        if (table[(size_t)c * MERL_BINS + (size_t)bin] < 0)
            return false;
    rec_brdf_eval(brdf, wi, wo, f);
    return true;
}

static struct pair pair_at(const struct brdf *a, const struct brdf *b, int bin)
{
    struct pair p = {.band = -1};
    half_diff middle = rec_merl_center(bin), low, high;
    vec3 wi, wo;
    rec_directions(middle, &wi, &wo);
    if (wi.z <= 0 || wo.z <= 0 || !value_at(p.a, a, bin, wi, wo) || !value_at(p.b, b, bin, wi, wo))
        return p;
    rec_grid_ranges(rec_merl_grid, bin, &low, &high);
    p.cos_i = wi.z;
    p.cos_o = wo.z;
    p.sin_i = hypot(wi.x, wi.y);
    p.sin_o = hypot(wo.x, wo.y);
    p.solid = 4 * cos(middle.theta_d) * (cos(low.theta_h) - cos(high.theta_h))
              * (cos(low.theta_d) - cos(high.theta_d));
    double steepest = acos(fmin(wi.z, wo.z)) * 180 / CAP_PI;
    for (p.band = 0; p.band < COMPARE_BANDS - 1 && steepest >= rec_compare_band[p.band];)
        p.band++;
    return p;
}

/* ---- measures ---------------------------------------------------------------------------------
 */

// Sums over pairs and channels.
struct sums {
    double ngan, low, log2, cube_root;
    double even, directions;  // weights
};

static struct sums sums_added(struct sums a, struct sums b)
{
    return (struct sums){a.ngan + b.ngan,           a.low + b.low,   a.log2 + b.log2,
                         a.cube_root + b.cube_root, a.even + b.even, a.directions + b.directions};
}

static void add(struct sums *s, const struct pair *p, double f, double g)
{
    const double e = 1e-3;
    double m = fmax(p->cos_i * p->cos_o, 1e-3);
    double even = p->solid / fmax(p->sin_i * p->sin_o, 1e-9);
    double linear = (f - g) * p->cos_i, low = log((1 + f * p->cos_i) / (1 + g * p->cos_i));
    double ratio = log((f * m + e) / (g * m + e));
    s->ngan += even * linear * linear * p->sin_i * p->sin_o;
    s->low += even * low * low * p->sin_i;
    s->log2 += p->solid * ratio * ratio;
    s->cube_root += p->solid * pow(fabs((f - g) * m), 2.0 / 3);
    s->even += even;
    s->directions += p->solid;
}

// Sums and counts of each channel and band, over all pairs once.
struct parts {
    struct sums sums[3][COMPARE_BANDS];
    int bins[COMPARE_BANDS];
};

static void sum_up(struct parts *parts, const struct pair *pair, int count)
{
    *parts = (struct parts){.bins = {0}};
    for (int i = 0; i < count; i++) {
        const struct pair *p = &pair[i];
        if (p->band < 0)
            continue;
        parts->bins[p->band]++;
        for (int c = 0; c < 3; c++)
            add(&parts->sums[c][p->band], p, p->a[c], p->b[c]);
    }
}

// Is this one of those asked for? COMPARE_ALL and -1: all.
static bool within(int channel, int c, int band, int b)
{
    return (channel == COMPARE_ALL || channel == c) && (band < 0 || band == b);
}

// The relative errors asked for, [at most 3 count]; returns how many.
static int collect(double *room, const struct pair *pair, int count, int channel, int band)
{
    int n = 0;
    for (int i = 0; i < count; i++)
        for (int c = 0; pair[i].band >= 0 && c < 3; c++)
            if (within(channel, c, band, pair[i].band) && pair[i].a[c] > 0)
                room[n++] = pair[i].b[c] / pair[i].a[c] - 1;
    return n;
}

static struct brdf_errors measure(const struct pair *pair, int count, const struct parts *parts,
                                  int channel, int band, double *room)
{
    struct sums s = {0};
    struct brdf_errors e = {0};
    for (int b = 0; b < COMPARE_BANDS; b++) {
        e.bins += within(channel, channel, band, b) ? parts->bins[b] : 0;
        for (int c = 0; c < 3; c++)
            if (within(channel, c, band, b))
                s = sums_added(s, parts->sums[c][b]);
    }
    e.ngan = sqrt(s.ngan / s.even);
    e.low = sqrt(s.low / s.even);
    e.log_rms = sqrt(s.log2 / s.directions);
    e.cube_root = s.cube_root / s.directions;
    int n = collect(room, pair, count, channel, band);
    e.signed_median = rec_quantile(room, n, 0.5);
    for (int i = 0; i < n; i++)
        room[i] = fabs(room[i]);
    e.relative_median = rec_quantile(room, n, 0.5);
    e.relative_95 = rec_quantile(room, n, 0.95);
    return e;
}

static enum status compare_pictures(struct picture_errors *errors, const struct brdf *a,
                                    const struct brdf *b, int threads, struct error *err)
{
    const size_t size = 3 * (size_t)SPHERE_SIZE * SPHERE_SIZE;
    float *picture = malloc(2 * size * sizeof *picture);
    if (!picture)
        return cap_fail(err, STATUS_MEMORY, "no memory for two pictures");
    rec_lit_sphere(picture, a, threads);
    rec_lit_sphere(picture + size, b, threads);
    enum status status = rec_sphere_compare(errors, picture, picture + size, err);
    free(picture);
    return status;
}

enum status rec_compare(struct comparison *comparison, const struct brdf *a, const struct brdf *b,
                        const uint8_t *mask, struct run *run, struct error *err)
{
    struct pair *pair = malloc(MERL_BINS * sizeof *pair);
    double *room = malloc(3 * MERL_BINS * sizeof *room);
    enum status status = STATUS_OK;
    if (!pair || !room)
        status = cap_fail(err, STATUS_MEMORY, "no memory to compare tables");
    int last = status ? 0 : MERL_BINS;
#pragma omp parallel for schedule(dynamic, 4096) num_threads(run->threads)
    for (int bin = 0; bin < last; bin++)
        pair[bin] =
            mask && mask[bin] != BIN_MEASURED ? (struct pair){.band = -1} : pair_at(a, b, bin);
    struct comparison made;
    struct parts parts;
    if (!status)
        sum_up(&parts, pair, MERL_BINS);
    for (int c = 0; !status && c <= COMPARE_ALL; c++) {
        made.channel[c] = measure(pair, MERL_BINS, &parts, c, -1, room);
        for (int band = 0; band < COMPARE_BANDS; band++)
            made.by_angle[c][band] = measure(pair, MERL_BINS, &parts, c, band, room);
    }
    if (!status && made.channel[COMPARE_ALL].bins == 0)
        status = cap_fail(err, STATUS_DATA, "there is no bin that both have a value in");
    if (!status)
        status = compare_pictures(&made.sphere, a, b, run->threads, err);
    if (!status)
        *comparison = made;
    free(pair);
    free(room);
    return status;
}
