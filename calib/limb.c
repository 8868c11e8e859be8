/* limb.c -- where a surface's image ends, to a hundredth of a pixel.
 *
 * Method.   Across an edge at e, with d the distance outwards from the predicted outline and
 *           x = e - d the depth inside it, radiance is
 *
 *               b0 + b1 sqrt(x) + b2 x   inside (x > 0),      o0 + o1 x   outside,
 *
 *           averaged over the photosite. The square root is the limb: near the outline the normal
 *           turns as sqrt(x), and with it all reflectance. For each e of a fine scan the five
 *           coefficients are solved linearly; the parabola through the least chi^2 gives e and,
 *           by its curvature, sigma. Either side may be the brighter one.
 * Accuracy. Unbiased for any smooth reflectance; the 50 % level is off by 0.05 mm and the steepest
 *           gradient by 0.017 mm where this model is off by 0.009 mm (../shared/facts.md).
 */
#include "limb.h"
#include "dense.h"
#include "view_map.h"

#include <float.h>
#include <string.h>

enum { TERMS = 5 };  // coefficients of the limb model
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

/** The terms of the limb model at depth x, averaged over a box (photosite and blur): the mean of
 *  x_+^p over it is ((x + w/2)_+^(p+1) - (x - w/2)_+^(p+1)) / ((p+1) w). */
static void limb_terms(double x, double width, double t[TERMS])
{
    double a = x / width + 0.5, b = x / width - 0.5;  // in box widths
    a = a > 0 ? a : 0;
    b = b > 0 ? b : 0;
    double inside = a - b;
    t[0] = inside;
    t[1] = (a * sqrt(a) - b * sqrt(b)) * (2.0 / 3) * sqrt(width);
    t[2] = (a * a - b * b) * 0.5 * width;
    t[3] = 1 - inside;
    t[4] = x - t[2];
}

/** chi^2 of the limb model with its edge at e; DBL_MAX where it cannot be fitted. */
static double limb_chi2(const struct sector *s, double e, double width)
{
    double a[TERMS * TERMS] = {0}, y[TERMS] = {0}, yy = 0;
    for (int n = 0; n < s->count; n++) {
        double t[TERMS], w = 1 / s->site[n].variance, value = s->site[n].value;
        limb_terms(e - s->site[n].d, width, t);
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
static double texture_curvature(const struct sector *s, double at, double width)
{
    struct sector bare = {.count = s->count};
    for (int n = 0; n < s->count; n++) {
        double texture = fmax(TEXTURE * fabs(s->site[n].value), 0.1 * sqrt(s->site[n].variance));
        bare.site[n] = (struct site){s->site[n].d, s->site[n].value, texture * texture};
    }
    double below = limb_chi2(&bare, at - STEP_PX, width), here = limb_chi2(&bare, at, width),
           above = limb_chi2(&bare, at + STEP_PX, width);
    return below < DBL_MAX && above < DBL_MAX ? fmax(below - 2 * here + above, 0) : 0;
}

bool limb_edge(const struct sector *s, double width, double *e, double *sigma)
{
    enum { STEPS = 41 };
    double chi2[STEPS];
    int best = 0;
    for (int i = 0; i < STEPS; i++) {
        chi2[i] = limb_chi2(s, -SCAN_PX + i * STEP_PX, width);
        if (chi2[i] < chi2[best])
            best = i;
    }
    if (best == 0 || best == STEPS - 1 || chi2[best - 1] == DBL_MAX || chi2[best + 1] == DBL_MAX)
        return false;
    double curvature = chi2[best - 1] - 2 * chi2[best] + chi2[best + 1];
    if (curvature <= 0)
        return false;
    double shift = 0.5 * (chi2[best - 1] - chi2[best + 1]) / curvature;
    double misfit = chi2[best] / (s->count - TERMS - 1);
    double bare = texture_curvature(s, -SCAN_PX + best * STEP_PX, width);
    // chi^2 rises by 1 (by the misfit, where the model is not perfect) at one sigma.
    double variance = 2 * (misfit > 1 ? misfit : 1) / curvature;
    if (bare > 0)
        variance += MODEL * MODEL * 2 / bare;
    double unexplained = chi2[best] / about_mean(s);
    *e = -SCAN_PX + (best + shift) * STEP_PX;
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

double limb_best_width(const struct sector *sector, int count)
{
    static const double widths[] = {1, 1.35, 1.8, 2.4, 3.2};
    double best = widths[0], least = DBL_MAX;
    for (size_t w = 0; w < sizeof widths / sizeof *widths; w++) {
        double sum = 0;
        for (int k = 0; k < count; k += 3) {  // a third of them tell
            double least_k = DBL_MAX;
            if (sector[k].count > 4 * TERMS)
                for (double e = -SCAN_PX; e <= SCAN_PX; e += 0.25)
                    least_k = fmin(least_k, limb_chi2(&sector[k], e, widths[w]));
            if (least_k < DBL_MAX)
                sum += fmin(least_k / sector[k].count, 20);  // a wild sector decides nothing
        }
        if (sum < least) {
            least = sum;
            best = widths[w];
        }
    }
    return best;
}
