/* limb.c -- where a surface's image ends, to a hundredth of a pixel.
 *
 * Method.   Across an edge at e, with d the distance outwards from the predicted outline and
 *           x = e - d the depth inside it, radiance is
 *
 *               b0 + b1 c(x) + b2 x   inside (x > 0),      o0 + o1 x   outside,
 *               c = sqrt(x - x^2 / 2R) = sqrt(x) (1 - x / 4R - x^2 / 32R^2 - x^3 / 128R^3 - ...),
 *
 *           averaged over the photosite, a box, and the lens's blur, a Gaussian of the width that
 *           fits a photograph's edges best. (One box for both puts edges off by half a pixel where
 *           the limb is steep.) The root is the limb: where the surface curves with a radius of R
 *           pixels, its normal's part towards the camera is c times sqrt(2 / R), and outwards
 *           1 - x / R: the model is exact of what is matt, and with sqrt(x) for c, or R unknown,
 *           off by 0.05 px where R = 22 and the lamp stands beside the camera.
 *           For each e of a fine scan the five coefficients are solved linearly; the parabola
 *           through the least chi^2 gives e and, by its curvature, sigma. Either side may be the
 *           brighter one.
 * Accuracy. Unbiased for any smooth reflectance; the 50 % level is off by 0.05 mm and the steepest
 *           gradient by 0.017 mm where this model is off by 0.009 mm (../shared/facts.md).
 */
#include "limb.h"
#include "dense.h"
#include "view_map.h"

#include <assert.h>
#include <float.h>
#include <string.h>

enum { TERMS = LIMB_TERMS };
static const double CELL_PX = 1.0 / 64, LEAST_DEPTH = -8;  // of a lens's table
static const double PHOTOSITE = 0.2886751346;  // 1 sigma of a box a pixel wide: sqrt(1/12)
static const double SCAN_PX = 2.5, STEP_PX = 0.125;
static const double TEXTURE = 0.004;  // what a surface's own structure adds to noise, relative
static const double MODEL = 4;        // by how much more than TEXTURE the model itself may be off:
                                      // 0.012 px where the edge is half as high as it is bright
// What is left beside an edge (print, a shadow, a stand) is no noise that averages out: a profile
// that is off by a part of its height moves an edge a photosite wide by that part of a half.
static const double BESIDE_PX = 0.5;
static const double SIGMA_MAX_PX = 0.3;  // an edge less sure than this says nothing
static const double EXPLAINED = 0.95;    // of the variance across an edge, by the model

int limb_stride(double across_px)
{
    int stride = 1;
    while (across_px * (EDGE_PX + 2) > LIMB_SITES_MAX * stride * stride)
        stride++;
    return stride;
}

void limb_add(struct sector *s, const struct radiance *map, int x, int y, double d)
{
    double value, variance;
    if (s->count == LIMB_SITES_MAX || !cal_gray(map, x, y, &value, &variance))
        return;
    if (*map->cfa) {  // what was not measured here comes from neighbours, also across the edge
        float v[3], var[3];
        cap_radiance_at(map, x, y, v, var);
        value = v[1];
        variance = var[1];
        if (!isfinite(variance))
            return;
    }
    s->site[s->count++] = (struct site){d, value, variance + TEXTURE * TEXTURE * value * value};
}

/** Powers 0, 1/2, 1, 3/2, 5/2 and 7/2 of the depth x, averaged over a photosite: the mean of x_+^p
 * over it is ((x + 1/2)_+^(p+1) - (x - 1/2)_+^(p+1)) / (p+1). */
static void photosite_powers(double x, double t[LIMB_POWERS])
{
    double a = fmax(x + 0.5, 0), b = fmax(x - 0.5, 0), a32 = a * sqrt(a), b32 = b * sqrt(b);
    t[0] = a - b;
    t[1] = (a32 - b32) * (2.0 / 3);
    t[2] = (a * a - b * b) * 0.5;
    t[3] = (a * a32 - b * b32) * (2.0 / 5);
    t[4] = (a * a * a32 - b * b * b32) * (2.0 / 7);
    t[5] = (a * a * a * a32 - b * b * b * b32) * (2.0 / 9);
}

void limb_lens_make(struct limb_lens *lens, double blur)
{
    enum { SIDE = 8 };  // of a Gaussian, in steps of half a sigma
    lens->blur = blur;
    for (int i = 0; i <= LIMB_CELLS; i++) {
        double sum[LIMB_POWERS] = {0}, weights = 0;
        for (int k = -SIDE; k <= SIDE; k++) {
            double t[LIMB_POWERS], w = exp(-0.125 * k * k);
            photosite_powers(LEAST_DEPTH + i * CELL_PX + 0.5 * k * blur, t);
            for (int j = 0; j < LIMB_POWERS; j++)
                sum[j] += w * t[j];
            weights += w;
        }
        for (int j = 0; j < LIMB_POWERS; j++)
            lens->power[i][j] = sum[j] / weights;
    }
}

/** All terms of the limb model at depth x of a surface of that bend; within the table linearly
 *  between its cells, deeper than that no lens shows. */
static void limb_terms(double x, double bend, const struct limb_lens *lens, double t[TERMS])
{
    double place = (x - LEAST_DEPTH) / CELL_PX, p[LIMB_POWERS];
    if (place >= LIMB_CELLS) {
        photosite_powers(x, p);
    } else {
        int cell = place > 0 ? (int)place : 0;
        double part = place > 0 ? place - cell : 0;
        for (int j = 0; j < LIMB_POWERS; j++)
            p[j] = lens->power[cell][j] + part * (lens->power[cell + 1][j] - lens->power[cell][j]);
    }
    t[0] = p[0];
    t[1] = p[1] - bend / 4 * (p[3] + bend / 8 * (p[4] + bend / 4 * p[5]));
    t[2] = p[2];
    t[3] = 1 - t[0];
    t[4] = x - t[2];
}

/** chi^2 of the limb model with its edge at e; DBL_MAX where it cannot be fitted. */
static double limb_chi2(const struct sector *s, double e, const struct limb_lens *lens)
{
    double a[TERMS * TERMS] = {0}, y[TERMS] = {0}, yy = 0;
    for (int n = 0; n < s->count; n++) {
        double t[TERMS], w = 1 / s->site[n].variance, value = s->site[n].value;
        limb_terms(e - s->site[n].d, s->bend, lens, t);
        for (int i = 0; i < TERMS; i++) {
            for (int j = 0; j <= i; j++)
                a[i * TERMS + j] += w * t[i] * t[j];
            y[i] += w * t[i] * value;
        }
        yy += w * value * value;
    }
    double c[TERMS];
    memcpy(c, y, sizeof c);
    if (!dense_cholesky(TERMS, a))
        return DBL_MAX;
    dense_solve(TERMS, a, c);
    for (int i = 0; i < TERMS; i++)
        yy -= c[i] * y[i];
    return yy > 0 ? yy : 0;
}

/** chi^2 of a sector about its weighted mean. */
static double about_mean(const struct sector *s)
{
    double w = 0, wv = 0, wvv = 0;
    for (int n = 0; n < s->count; n++) {
        double weight = 1 / s->site[n].variance, value = s->site[n].value;
        w += weight;
        wv += weight * value;
        wvv += weight * value * value;
    }
    return wvv - wv * wv / w;
}

/** Curvature of chi^2 over a step about `at`, if nothing but structure of the surface blurred it;
 *  0: that is not known. */
static double texture_curvature(const struct sector *s, double at, const struct limb_lens *lens)
{
    struct sector bare = {.count = s->count, .bend = s->bend};
    for (int n = 0; n < s->count; n++) {
        double texture = fmax(TEXTURE * fabs(s->site[n].value), 0.1 * sqrt(s->site[n].variance));
        bare.site[n] = (struct site){s->site[n].d, s->site[n].value, texture * texture};
    }
    double below = limb_chi2(&bare, at - STEP_PX, lens), here = limb_chi2(&bare, at, lens),
           above = limb_chi2(&bare, at + STEP_PX, lens);
    return below < DBL_MAX && above < DBL_MAX ? fmax(below - 2 * here + above, 0) : 0;
}

// The least chi^2 within a step: where the limb begins without a step of its own, a parabola fits
// it over a fraction of that only.
static double least_near(const struct sector *s, double about, const struct limb_lens *lens)
{
    enum { SIDE = 4, PLACES = 2 * SIDE + 1 };
    const double step = STEP_PX / SIDE;
    double chi2[PLACES];
    int best = SIDE;
    for (int k = 0; k < PLACES; k++)
        chi2[k] = limb_chi2(s, about + (k - SIDE) * step, lens);
    for (int k = 1; k < PLACES - 1; k++)
        best = chi2[k] < chi2[best] ? k : best;
    double bend = chi2[best - 1] - 2 * chi2[best] + chi2[best + 1];
    double shift = bend > 0 ? 0.5 * (chi2[best - 1] - chi2[best + 1]) / bend : 0;
    return about + (best - SIDE + fmax(-1, fmin(1, shift))) * step;
}

bool limb_edge(const struct sector *s, const struct limb_lens *lens, double *e, double *sigma)
{
    enum { STEPS = 41 };
    double chi2[STEPS];
    int best = 0;
    for (int i = 0; i < STEPS; i++) {
        chi2[i] = limb_chi2(s, -SCAN_PX + i * STEP_PX, lens);
        if (chi2[i] < chi2[best])
            best = i;
    }
    if (best == 0 || best == STEPS - 1 || chi2[best - 1] == DBL_MAX || chi2[best + 1] == DBL_MAX)
        return false;
    double curvature = chi2[best - 1] - 2 * chi2[best] + chi2[best + 1];
    if (curvature <= 0)
        return false;
    double misfit = chi2[best] / (s->count - TERMS - 1);
    double bare = texture_curvature(s, -SCAN_PX + best * STEP_PX, lens);
    // chi^2 rises by 1 (by the misfit, where the model is not perfect) at one sigma.
    double variance = 2 * (misfit > 1 ? misfit : 1) / curvature;
    if (bare > 0)
        variance += MODEL * MODEL * 2 / bare;
    double unexplained = chi2[best] / about_mean(s);
    *e = least_near(s, -SCAN_PX + best * STEP_PX, lens);
    *sigma = hypot(STEP_PX * sqrt(variance), BESIDE_PX * sqrt(unexplained));
    return *sigma < SIGMA_MAX_PX && unexplained < 1 - EXPLAINED;
}

bool limb_step(const struct sector *s, double search, double *e, double *sigma)
{
    const double side = 3;
    double best = 0;
    for (double at = -search; at <= search; at += 0.5) {
        double sum[2] = {0}, var[2] = {0};
        int n[2] = {0};
        for (int i = 0; i < s->count; i++) {
            double x = s->site[i].d - at;
            if (fabs(x) > side)
                continue;
            sum[x > 0] += s->site[i].value;
            var[x > 0] += s->site[i].variance;
            n[x > 0]++;
        }
        if (n[0] < 4 || n[1] < 4)
            continue;
        double a = sum[0] / n[0], b = sum[1] / n[1];
        double noise = var[0] / ((double)n[0] * n[0]) + var[1] / ((double)n[1] * n[1]);
        double step = fabs(a - b) / (fabs(a) + fabs(b) + 6 * sqrt(noise));
        if (step > best) {
            best = step;
            *e = at;
        }
    }
    *sigma = 1;
    return best > 0.3;
}

/** How badly a lens fits a third of the sectors, of many at most some 64: ln of chi^2 for each, for
 *  the model is off by much more than noise in one and not in the next; a wild sector is as wild
 *  with any lens. */
static double misfit_of(const struct limb_lens *lens, const struct sector *sector, int count)
{
    enum { ENOUGH = 64 };
    const int stride = count > 3 * ENOUGH ? count / ENOUGH : 3;
    double sum = 0;
    for (int k = 0; k < count; k += stride) {
        double least = DBL_MAX;
        if (sector[k].count > 4 * TERMS)
            for (double e = -SCAN_PX; e <= SCAN_PX; e += 0.25)
                least = fmin(least, limb_chi2(&sector[k], e, lens));
        if (least < DBL_MAX)
            sum += log(least + sector[k].count);
    }
    return sum;
}

// The blur of the least misfit among some that are `step` apart, and by the parabola through it and
// its neighbours.
static double best_blur(struct limb_lens *lens, double first, double step, int blurs,
                        const struct sector *sector, int count)
{
    double misfit[9], shift = 0;
    int best = 0;
    assert(blurs <= 9);
    for (int k = 0; k < blurs; k++) {
        limb_lens_make(lens, first + k * step);
        misfit[k] = misfit_of(lens, sector, count);
        best = misfit[k] < misfit[best] ? k : best;
    }
    if (best > 0 && best < blurs - 1) {
        double before = misfit[best - 1], after = misfit[best + 1];
        double bend = before - 2 * misfit[best] + after;
        shift = bend > 0 ? 0.5 * (before - after) / bend : 0;
    }
    return first + (best + shift) * step;
}

// The limb is not quite what its model says, which the blur makes up for: what it and the photosite
// spread together is only told to 0.1, and tags tell it better, at their own distance.
void limb_lens_find(struct limb_lens *lens, const struct sector *sector, int count, double by_tags)
{
    const double step = 0.15, fine = 0.05, agree = 0.1;
    double about = best_blur(lens, 0, step, 9, sector, count);
    double blur = best_blur(lens, fmax(about - 2 * fine, 0), fine, 5, sector, count);
    bool same = fabs(hypot(blur, PHOTOSITE) - hypot(by_tags, PHOTOSITE)) < agree;
    limb_lens_make(lens, same ? by_tags : blur);
}
