/* resolution.c -- what turns and spreads of direction do to a bin's mean, given a model of f.
 *
 * Sharpen.  A photosite's normals spread about their mean with variances v (towards h, and
 *           across). Averaged so, f is sum of weights times f at n, and n tilted by +-sqrt(k v)
 *           both ways, k the kurtosis of the spread, so that the rule is right to the fourth order:
 *           1.8 of an even one, 3 of a normal one, and between them for a photosite that a lens's
 *           blur widens. The model's f over its average so corrects the mean. It knows the lobe's
 *           width only as well as the fit does: a fifth of the correction is taken for its sigma.
 * Disc.     A lamp's disc spreads wi by s^2 each way. As dh = (dwi - h (h.dwi)) / |wi + wo| and
 *           |wi + wo| = 2 cos(theta_d), h spreads by s^2/4 in the plane of incidence and by
 *           s^2/(4 cos^2 theta_d) across it. That plane stands at phi_d to the one of n and h;
 *           h's spread there is taken as the normal's, for f is a function of theta_h first of
 *           all. A disc's kurtosis along an axis is 2. Fourth cumulants of independent spreads add.
 * Widen.    A tilt of the normal by t moves f by t df/dtheta_h. Spread over the bin, f's mean is
 *           not f at the centroid: the difference is half the second derivative times the spread
 *           squared, in each of the angles. A bin's samples lie evenly over its widths at most:
 *           (width)^2 / 12; a single sample spreads by nothing, two by half of that.
 */
#include "reconstruct.h"

#include <stdlib.h>
#include <string.h>

// Of a correction, 1 sigma: what the fit does not know of the lobe's width.
static const double DOUBT = 0.2;

// The widths of a bin in theta_h, theta_d, phi_d.
static void widths(double width[3], struct grid grid, int index)
{
    half_diff low, high;
    rec_grid_ranges(grid, index, &low, &high);
    width[0] = high.theta_h - low.theta_h;
    width[1] = high.theta_d - low.theta_d;
    width[2] = high.phi_d - low.phi_d;
}

// The model at the centroid moved by `step` in angle k; the centroid itself where that would be
// below the horizon.
static void eval_moved(double f[3], const struct fit *fit, half_diff at, int k, double step)
{
    half_diff moved = at;
    double *angle[3] = {&moved.theta_h, &moved.theta_d, &moved.phi_d};
    vec3 wi, wo;
    *angle[k] += step;
    if (k < 2)
        *angle[k] = fabs(*angle[k]);
    rec_directions(moved, &wi, &wo);
    if (wi.z <= 0 || wo.z <= 0)
        rec_directions(at, &wi, &wo);
    if (wi.z > 0 && wo.z > 0)
        fit->model->eval(fit->value, wi, wo, f);
}

// The model where the normal is tilted by `tilt` towards h (axis 0) or across (axis 1); the level
// one where that takes a direction below the horizon.
static void eval_tilted(double f[3], const struct fit *fit, half_diff at, int axis, double tilt)
{
    vec3 w[2];
    half_diff turned = at;
    if (axis == 0)
        turned.theta_h -= tilt;
    rec_directions(turned, &w[0], &w[1]);
    for (int k = 0; axis == 1 && k < 2; k++)
        w[k] = (vec3){w[k].x, w[k].y * cos(tilt) - w[k].z * sin(tilt),
                      w[k].y * sin(tilt) + w[k].z * cos(tilt)};
    if (w[0].z <= 0 || w[1].z <= 0)
        rec_directions(at, &w[0], &w[1]);
    if (w[0].z > 0 && w[1].z > 0)
        fit->model->eval(fit->value, w[0], w[1], f);
}

/** How normals spread along an axis. */
typedef struct {
    double variance, kurtosis;
} spreading;

static double square(double x)
{
    return x * x;
}

// Along axis 0 or 1, of a photosite's normals, `wider` times as much as they do, and the lamp's
// disc.
static spreading spread_along(const struct bin *b, int axis, double wider, double blur2)
{
    const double square_px = 1.0 / 12, excess_square = -1.2, excess_disc = -1;
    const half_diff at = b->centroid;
    double along = square(axis == 0 ? cos(at.phi_d) : sin(at.phi_d));
    double across = fmax(square(cos(at.theta_d)), 0.01);  // at grazing angles f is no longer a peak
    double disc = b->disc / 4 * (along + (1 - along) / across), normals = wider * b->spread[axis];
    double even = b->spread[axis] * square_px / (square_px + blur2);
    spreading all = {normals + disc, 3};
    if (all.variance > 0)
        all.kurtosis +=
            (excess_square * square(even) + excess_disc * square(disc)) / square(all.variance);
    return all;
}

// f [3] averaged over normals that spread by `wider` times what a photosite's do, and the disc.
static void blunt(double f[3], const struct bin *b, const struct fit *fit, const double level[3],
                  double wider, double blur2)
{
    memcpy(f, level, sizeof(double[3]));
    for (int axis = 0; axis < 2; axis++)
        for (int sign = -1; sign <= 1; sign += 2) {
            spreading along = spread_along(b, axis, wider, blur2);
            double tilted[3] = {0}, tilt = sqrt(along.kurtosis * along.variance);
            eval_tilted(tilted, fit, b->centroid, axis, sign * tilt);
            for (int c = 0; c < 3; c++)
                f[c] += (tilted[c] - level[c]) / (2 * along.kurtosis);
        }
}

static double sharpen(struct bin *b, const struct fit *fit, double blur2)
{
    const double most = 0.5;  // beyond, the lobe is not resolved
    // A square's second moment is 1/12. A channel between neighbours is their mean, from one
    // photosite away each way (variance 1/2) or diagonally (1): 0.6 on average, each way.
    const double between = 0.6, all = 1.0 / 12 + blur2;
    double level[3] = {0}, own[3], lent[3], change = 0;
    eval_tilted(level, fit, b->centroid, 0, 0);
    blunt(own, b, fit, level, 1, blur2);
    if (b->lent[0] || b->lent[1] || b->lent[2])
        blunt(lent, b, fit, level, (between + all) / all, blur2);
    for (int c = 0; c < 3; c++) {
        double averaged = b->lent[c] ? lent[c] : own[c], before = b->sharpened[c];
        double ratio = averaged > 0 ? level[c] / averaged : 1;
        b->sharpened[c] = fmin(1 + most, fmax(1 - most, ratio)) - 1;
        double by = (1 + b->sharpened[c]) / (1 + before);
        b->mean[c] *= by;
        b->noise[c] *= by;
        if (b->noise[c] > 0)
            change = fmax(change, fabs(b->mean[c] * (1 - 1 / by)) / b->noise[c]);
    }
    return change;
}

double rec_bins_sharpen(struct bins *bins, const struct fit *fit)
{
    double change = 0;
#pragma omp parallel for schedule(static) reduction(max : change)
    for (int i = 0; i < bins->count; i++)
        change = fmax(change, sharpen(&bins->bin[i], fit, bins->blur2));
    return change;
}

struct sharpening rec_bins_sharpening(const struct bins *bins)
{
    const double some = 0.01;
    struct sharpening s = {0};
    for (int i = 0; i < bins->count; i++) {
        const struct bin *b = &bins->bin[i];
        bool changed = false, uncertain = false;
        for (int c = 0; c < 3; c++) {
            double change = fabs(b->sharpened[c]), doubt = DOUBT * change * fabs(b->mean[c]);
            changed = changed || change > some;
            uncertain = uncertain || (change > some && 2 * square(doubt) > square(b->sigma[c]));
            s.largest = fmax(s.largest, change);
        }
        s.bins += changed;
        s.uncertain += uncertain;
    }
    return s;
}

static void align(struct bin *b, const struct fit *fit)
{
    double shared[3] = {0};
    eval_moved(shared, fit, b->centroid, 0, 0);
    for (int c = 0; c < 3; c++) {
        double own[3] = {0};
        eval_moved(own, fit, b->own[c], 0, 0);
        double ratio = own[c] > 0 && shared[c] > 0 ? shared[c] / own[c] : 1;
        b->mean[c] *= ratio;
        b->sigma[c] *= ratio;
        b->noise[c] *= ratio;
        b->own[c] = b->centroid;
    }
}

static bool aligned(const struct bin *b)
{
    return memcmp(&b->own[0], &b->centroid, sizeof b->centroid) == 0
           && memcmp(&b->own[1], &b->centroid, sizeof b->centroid) == 0
           && memcmp(&b->own[2], &b->centroid, sizeof b->centroid) == 0;
}

void rec_bins_align(struct bins *bins, const struct fit *fit)
{
#pragma omp parallel for schedule(static)
    for (int i = 0; i < bins->count; i++)
        if (!aligned(&bins->bin[i]))
            align(&bins->bin[i], fit);
}

static void widen(struct bin *b, struct grid grid, const struct fit *fit)
{
    double width[3], center[3] = {0};
    double variance[3], bend[3] = {0};
    widths(width, grid, b->index);
    eval_moved(center, fit, b->centroid, 0, 0);
    for (int c = 0; c < 3; c++)
        variance[c] = square(b->noise[c]) + square(b->mean[c] * b->systematic)
                      + square(DOUBT * b->sharpened[c] * b->mean[c]);
    for (int k = 0; k < 3; k++) {
        double step = width[k] / 2, up[3] = {0}, down[3] = {0};
        double spread2 = width[k] * width[k] / 12 * (1 - 1.0 / b->count);
        eval_moved(up, fit, b->centroid, k, step);
        eval_moved(down, fit, b->centroid, k, -step);
        for (int c = 0; c < 3; c++) {
            double slope = (up[c] - down[c]) / (2 * step);
            bend[c] += 0.5 * (up[c] + down[c] - 2 * center[c]) / (step * step) * spread2;
            if (k == 0)
                variance[c] += square(slope * b->tilt);
        }
    }
    for (int c = 0; c < 3; c++)
        b->sigma[c] = sqrt(variance[c] + bend[c] * bend[c]);
}

void rec_bins_widen(struct bins *bins, const struct fit *fit)
{
#pragma omp parallel for schedule(static)
    for (int i = 0; i < bins->count; i++)
        widen(&bins->bin[i], rec_grid_of(bins), fit);
}

enum status rec_bins_of_table(struct bins *bins, const struct merl *merl, struct error *err)
{
    struct bin *bin = malloc((size_t)MERL_BINS * sizeof *bin);
    if (!bin)
        return cap_fail(err, STATUS_MEMORY, "no memory for bins");
    int count = 0;
    for (int i = 0; i < MERL_BINS; i++) {
        struct bin b = {.index = i, .count = 1, .centroid = rec_merl_center(i)};
        bool there = rec_merl_above(i);
        for (int c = 0; c < 3; c++) {
            b.mean[c] = merl->value[(size_t)c * MERL_BINS + (size_t)i];
            b.sigma[c] = b.noise[c] = 0.01 * b.mean[c];
            there = there && b.mean[c] >= 0;
        }
        if (there)
            bin[count++] = b;
    }
    *bins = (struct bins){.bin = bin, .count = count, .grid = rec_merl_grid};
    return STATUS_OK;
}
