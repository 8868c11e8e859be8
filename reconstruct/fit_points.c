/* fit_points.c -- the bins that models are fitted to and judged by.
 *
 * Method.   MERL bins crowd into the highlight and along phi_d, and a capture fills some regions
 *           densely and others thinly. Strata of one theta_h bin and six theta_d bins each give the
 *           same number of bins, or all they have: the number that brings the wanted total. Within
 *           a stratum every k-th bin is taken, in order of the index: no chance is involved.
 *           One block in five of (theta_h, theta_d, phi_d) is held out: neighbours share errors,
 *           so single bins would be predicted by their neighbours.
 */
#include "fit_points.h"

#include <stdlib.h>

enum { D_STEP = 6, STRATA = MERL_THETA_H * (MERL_THETA_D / D_STEP), FEWEST = 100 };

// Beyond this angle footprints are wide and sigmas rest on the calibration alone.
static const double grazing = 0.0872;  // cos 85 degrees

double rec_fit_log(double f, double m)
{
    double x = f * m;
    return log((x > -0.5 * FIT_DARK ? x : -0.5 * FIT_DARK) + FIT_DARK);
}

static int stratum_of(int index)
{
    return index / (MERL_PHI_D * MERL_THETA_D) * (MERL_THETA_D / D_STEP)
           + index / MERL_PHI_D % MERL_THETA_D / D_STEP;
}

// Blocks of 5 theta_h, 6 theta_d and 20 phi_d bins; every fifth along each of the axes.
static bool held_out(int index)
{
    int p = index % MERL_PHI_D, d = index / MERL_PHI_D % MERL_THETA_D;
    int h = index / (MERL_PHI_D * MERL_THETA_D);
    return (h / 5 + 2 * (d / 6) + p / 20) % 5 == 0;
}

static bool serves(const struct bin *b)
{
    vec3 wi, wo;
    rec_directions(b->centroid, &wi, &wo);
    return wi.z > grazing && wo.z > grazing;
}

// The most that each stratum may give so that all together give at most `wanted`.
static int quota_of(const int *have, int wanted)
{
    int low = 0, high = wanted + 1;  // low fits
    while (high - low > 1) {
        int quota = (low + high) / 2;
        int64_t total = 0;
        for (int s = 0; s < STRATA; s++)
            total += have[s] < quota ? have[s] : quota;
        if (total <= wanted)
            low = quota;
        else
            high = quota;
    }
    return low;
}

// Of all pictures of a sphere under one lamp, the bin's share of their pixels: per solid angle of h
// and of d, and as the pixel is foreshortened. Lamps stand before the sphere, and as seen from
// there in proportion to their cosine; few stand beside or behind it. By reciprocity a bin is seen
// in two ways. Where nothing is clipped both together weigh this much times the brighter one
// squared.
static double shown(const struct bin *b, const struct fit_point *p)
{
    const double aside = 0.05;
    half_diff at = b->centroid;
    double width = sqrt(at.theta_h);  // as bins are
    double lamps = fmax(aside, cos(2 * at.theta_d));
    double bright = fmax(p->wi.z, p->wo.z), dim = fmin(p->wi.z, p->wo.z);
    return width * sin(at.theta_h) * sin(at.theta_d) * cos(at.theta_d) * lamps * dim
           * (1 + dim / bright);
}

// stands_for: so many bins of its stratum.
static struct fit_point point_of(const struct bin *b, double stands_for)
{
    struct fit_point p = {.tilt = b->tilt, .held = held_out(b->index)};
    rec_directions(b->centroid, &p.wi, &p.wo);
    p.m = p.wi.z * p.wo.z;
    p.shown = stands_for * shown(b, &p);
    for (int c = 0; c < 3; c++) {
        p.f[c] = b->mean[c];
        p.error[c] = b->sigma[c];
        p.log_f[c] = rec_fit_log(b->mean[c], p.m);
        double by_f = p.m / exp(p.log_f[c]);  // d ln(f m + e) / df
        p.sigma[c] = hypot(by_f * b->sigma[c], FIT_MODEL_ERROR);
        p.systematic[c] = by_f * fabs(b->mean[c]) * b->systematic;
    }
    return p;
}

// From shares to roots of shares, in units of the mean share.
static void level_shown(struct fit_point *p, int count)
{
    double sum = 0;
    for (int i = 0; i < count; i++)
        sum += p[i].shown;
    for (int i = 0; i < count; i++)
        p[i].shown = sum > 0 ? sqrt(p[i].shown * count / sum) : 1;
}

enum status rec_fit_points(struct fit_point **points, int *count, const struct bins *bins,
                           int wanted, struct error *err)
{
    static const char *const few =
        "only %d bins below 85 degrees were measured: no model is fitted";
    int have[STRATA] = {0}, met[STRATA] = {0}, n = 0, serving = 0;
    for (int i = 0; i < bins->count; i++)
        if (serves(&bins->bin[i])) {
            have[stratum_of(bins->bin[i].index)]++;
            serving++;
        }
    if (serving < FEWEST)
        return cap_fail(err, STATUS_DATA, few, serving);
    struct fit_point *p = malloc((size_t)(serving < wanted ? serving : wanted) * sizeof *p);
    if (!p)
        return cap_fail(err, STATUS_MEMORY, "no memory for a fit");
    int quota = quota_of(have, wanted);
    for (int i = 0; i < bins->count; i++) {
        if (!serves(&bins->bin[i]))
            continue;
        int s = stratum_of(bins->bin[i].index), k = met[s]++;
        int give = have[s] < quota ? have[s] : quota;
        // The k-th of `have` is taken where k give / have steps to the next whole number.
        if ((int64_t)(k + 1) * give / have[s] > (int64_t)k * give / have[s])
            p[n++] = point_of(&bins->bin[i], (double)have[s] / give);
    }
    level_shown(p, n);
    *points = p;
    *count = n;
    return STATUS_OK;
}
