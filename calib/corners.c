/* corners.c -- photometric fit of a tag's pattern.
 *
 * Method.   All photosites of a tag are explained at once: the known pattern, moved by its four
 *           corners (a homography in coordinates freed of lens distortion), blurred by a Gaussian
 *           that holds optics and photosite, between a black and a white level that each are a
 *           plane over the image (uneven light). 8 + 1 + 6 unknowns by Gauss-Newton with Tukey's
 *           weights, whose threshold shrinks: first the pattern slides into place, then what
 *           disagrees (the sample before it, the rim of a shadow) loses its say.
 *           Photosites near the rim of the pattern are not used. The look of it: tag_image.c.
 *           The lens bends a tag's edges, so corners depend on the lens that was thought of: the
 *           derivative (of the implicit function that the normal equations are) goes with them, and
 *           the bundle need not come back for another fit when it knows the lens better.
 * Accuracy. 0.013 px rms (distance) for tags of 50 to 70 pixels a side on the shared captures,
 *           against projections of the truth.
 */
#include "corners.h"

#include "dense.h"
#include "tag_sites.h"

#include <stdlib.h>
#include <string.h>

enum { WARP = 8, BLUR = 8, BLACK = 9, WHITE = 12, UNKNOWNS = 15 };

// What a photosite says of the unknowns; variance 0: nothing.
struct look {
    double residual, variance, by[UNKNOWNS];
};

struct fit {
    struct tag_image image;
    double level[6];  // black and white: at the middle, slopes by x and y per half tag
    double middle[2], half;
    struct tag_sites sites;
    struct look *look;  // [sites.count] at the end of the fit, which looks often; else NULL
};

// ---- one step of Gauss-Newton

// A homography of the square near 1, as eight numbers: d(s, t) at a point (a, b) from its middle
// is (w0 + w1 a + w2 b + w6 a a + w7 a b, w3 + w4 a + w5 b + w6 a b + w7 b b).
static void warp_basis(const double st[2], double ds[WARP], double dt[WARP])
{
    double a = st[0] - 0.5, b = st[1] - 0.5;
    const double s[WARP] = {1, a, b, 0, 0, 0, a * a, a * b};
    const double t[WARP] = {0, 0, 0, 1, a, b, a * b, b * b};
    memcpy(ds, s, sizeof s);
    memcpy(dt, t, sizeof t);
}

// What paper, print and this model of blur leave unexplained: a share of the contrast everywhere,
// and at edges what a displacement of so many pixels would do.
static const double paper_floor = 0.01, edge_floor_px = 0.05;

// Residual of a photosite, its variance, and its derivatives by the unknowns. `coarse` is a share
// of the contrast that the residual may be off by while the pattern is not yet in place.
static bool look_at(const struct fit *f, const struct photosite *site, double coarse,
                    double *residual, double *variance, double by[UNKNOWNS])
{
    double st[2], ds[WARP], dt[WARP];
    struct whiteness g;
    if (!tag_image_whiteness(&f->image, site->q, st, &g))
        return false;
    double e[3] = {1, (site->q[0] - f->middle[0]) / f->half, (site->q[1] - f->middle[1]) / f->half};
    double black = 0, white = 0;
    for (int i = 0; i < 3; i++) {
        black += f->level[i] * e[i];
        white += f->level[3 + i] * e[i];
        by[BLACK + i] = (1 - g.value) * e[i];
        by[WHITE + i] = g.value * e[i];
    }
    warp_basis(st, ds, dt);
    for (int i = 0; i < WARP; i++)
        by[i] = (white - black) * (g.by_s * ds[i] + g.by_t * dt[i]);
    by[BLUR] = (white - black) * g.by_blur;
    *residual = site->value - black - g.value * (white - black);
    double share2 =
        coarse * coarse + paper_floor * paper_floor + edge_floor_px * edge_floor_px * g.slope2;
    *variance = site->variance + share2 * (white - black) * (white - black);
    return true;
}

// The k-th photosite's.
static bool residual_at(const struct fit *f, int k, double coarse, double *residual,
                        double *variance, double by[UNKNOWNS])
{
    if (!f->look)
        return look_at(f, &f->sites.site[k], coarse, residual, variance, by);
    const struct look *look = &f->look[k];
    *residual = look->residual;
    *variance = look->variance;
    memcpy(by, look->by, sizeof look->by);
    return look->variance > 0;
}

// The pattern stays where it is from here on: each photosite is looked at once more. false: no
// memory.
static bool look_at_all(struct fit *f)
{
    struct look *look = malloc((size_t)f->sites.count * sizeof *look);
    for (int k = 0; look && k < f->sites.count; k++)
        if (!look_at(f, &f->sites.site[k], 0, &look[k].residual, &look[k].variance, look[k].by))
            look[k].variance = 0;
    f->look = look;
    return look;
}

// Residuals smaller than this many deviations keep a say (95 % efficient for Gaussian noise).
static const double tukey = 4.685;

static double weight(double z2)
{
    double t = 1 - z2 / (tukey * tukey);
    return t > 0 ? t * t : 0;
}

struct normal {
    double a[UNKNOWNS][UNKNOWNS], b[UNKNOWNS];
    double inliers, sites;  // photosites within three deviations; all
};

// From every stride-th photosite.
static void accumulate(struct normal *n, const struct fit *f, double coarse, double scale,
                       int stride)
{
    memset(n, 0, sizeof *n);
    for (int k = 0; k < f->sites.count; k += stride) {
        double r, variance, by[UNKNOWNS];
        if (!residual_at(f, k, coarse, &r, &variance, by))
            continue;
        double z2 = r * r / (variance * scale * scale);
        double w = weight(z2) / variance;
        n->sites++;
        n->inliers += z2 < 9;
        if (w == 0)
            continue;
        int from = by[BLUR] == 0 && by[0] == 0 && by[3] == 0 ? BLACK : 0;  // inside a cell
        for (int i = from; i < UNKNOWNS; i++) {
            double wi = w * by[i];
            n->b[i] += wi * r;
            for (int j = from; j <= i; j++)
                n->a[i][j] += wi * by[j];
        }
    }
}

// The two levels by least squares, for a pattern that stays where it is.
static bool fit_levels(struct fit *f)
{
    struct normal n;
    double a[6][6], b[6];
    memset(f->level, 0, sizeof f->level);
    f->level[3] = 1e-30;  // no contrast yet: no site is an outlier of nothing
    memset(&n, 0, sizeof n);
    for (int k = 0; k < f->sites.count; k++) {
        double r, variance, by[UNKNOWNS];
        if (!residual_at(f, k, 0, &r, &variance, by))
            continue;
        for (int i = BLACK; i < UNKNOWNS; i++) {
            n.b[i] += by[i] * f->sites.site[k].value;
            for (int j = BLACK; j <= i; j++)
                n.a[i][j] += by[i] * by[j];
        }
    }
    for (int i = 0; i < 6; i++) {
        b[i] = n.b[BLACK + i];
        for (int j = 0; j <= i; j++)
            a[i][j] = n.a[BLACK + i][BLACK + j];
    }
    if (!dense_cholesky(6, a[0]))
        return false;
    dense_solve(6, a[0], b);
    memcpy(f->level, b, sizeof b);
    return f->level[3] > f->level[0];
}

// How the corners (without distortion) follow the warp: moving the pattern by d(s, t) in the
// square moves its corners the other way in the image.
static void corners_by_warp(const struct fit *f, double by[8][WARP])
{
    for (int k = 0; k < 4; k++) {
        double q[2], q_by_st[2][2], ds[WARP], dt[WARP];
        tag_image_apply(&f->image.q_from_square, tag_image_corner[k], q, q_by_st);
        warp_basis(tag_image_corner[k], ds, dt);
        for (int i = 0; i < 2; i++)
            for (int w = 0; w < WARP; w++)
                by[2 * k + i][w] = -(q_by_st[i][0] * ds[w] + q_by_st[i][1] * dt[w]);
    }
}

enum { COARSE_SITES = 600 };

// One step; *moved is the largest motion of a corner. false: the normal equations are singular.
static bool take_step(struct fit *f, double coarse, double scale, double *moved)
{
    struct normal n;
    double by[8][WARP];
    // While the pattern is not yet in place, few photosites tell where it goes.
    accumulate(&n, f, coarse, scale, coarse > 0 ? 1 + f->sites.count / COARSE_SITES : 1);
    if (!dense_cholesky(UNKNOWNS, n.a[0]))
        return false;
    dense_solve(UNKNOWNS, n.a[0], n.b);
    corners_by_warp(f, by);
    *moved = 0;
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < 2; i++) {
            double d = 0;
            for (int w = 0; w < WARP; w++)
                d += by[2 * k + i][w] * n.b[w];
            f->image.corner[k][i] += d;
            *moved = fmax(*moved, fabs(d));
        }
    // The photosite alone has a variance of 1/12 px^2; a step may halve or double the blur.
    f->image.blur =
        fmin(fmax(f->image.blur + n.b[BLUR], fmax(0.5 * f->image.blur, 0.05)), 2 * f->image.blur);
    for (int i = 0; i < 6; i++)
        f->level[i] += n.b[BLACK + i];
    tag_image_set(&f->image);
    return isfinite(*moved);
}

static bool gather(struct fit *f, const struct camera *camera, const struct radiance *map,
                   double margin_px)
{
    return tag_sites_gather(&f->sites, &f->image, camera, map, margin_px)
           && f->sites.count > 4 * UNKNOWNS;
}

static void set_middle(struct fit *f, const struct camera *camera)
{
    double d[2], j[2][2];
    f->half = 0;
    for (int i = 0; i < 2; i++) {
        f->middle[i] = 0.25
                       * (f->image.corner[0][i] + f->image.corner[1][i] + f->image.corner[2][i]
                          + f->image.corner[3][i]);
        f->half = fmax(f->half, fabs(f->image.corner[0][i] - f->middle[i]));
    }
    tag_image_distort(camera, f->middle, d, j);
    double det = j[0][0] * j[1][1] - j[0][1] * j[1][0];
    f->image.q_by_pixel[0][0] = j[1][1] / det;
    f->image.q_by_pixel[1][1] = j[0][0] / det;
    f->image.q_by_pixel[0][1] = -j[0][1] / det;
    f->image.q_by_pixel[1][0] = -j[1][0] / det;
}

// ---- the whole fit

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// Median of |residual| / deviation, as the deviation of Gaussian noise: 1 where the noise is as
// told. From about SCATTER_SITES photosites: 4 % of a deviation is close enough for a threshold.
enum { SCATTER_SITES = 500 };
static double scatter_of(const struct fit *f)
{
    double z[2 * SCATTER_SITES];
    int n = 0, stride = 1 + f->sites.count / (2 * SCATTER_SITES);
    for (int k = 0; k < f->sites.count; k += stride) {
        double r, variance, by[UNKNOWNS];
        if (residual_at(f, k, 0, &r, &variance, by))
            z[n++] = fabs(r) / sqrt(variance);
    }
    qsort(z, (size_t)n, sizeof *z, compare_doubles);
    return n ? z[n / 2] / 0.6745 : 0;
}

// Slide the pattern into place, with less and less patience for what disagrees.
static bool slide(struct fit *f)
{
    static const double floors[] = {0.2, 0.05};  // of the contrast: all of it, then a quarter
    double moved = 0;
    for (int i = 0; i < 2; i++)
        for (int n = 0; n < 8; n++) {
            if (!take_step(f, floors[i], 1, &moved))
                return false;
            if (moved < 0.05)
                break;
        }
    double scale = fmax(1, scatter_of(f));
    for (int n = 0; n < 8; n++) {
        if (!take_step(f, 0, scale, &moved))
            return false;
        if (moved < 1e-3)
            break;
    }
    return moved < 0.02;
}

// Covariance of the unknowns: A^-1 B A^-1 with A the normal matrix and B the sum of the squares of
// what each photosite says, which holds whatever the noise turns out to be (P. Huber, "The behavior
// of maximum likelihood estimates under nonstandard conditions", 1967).
static bool covariance_of(const struct fit *f, struct normal *n, double scale,
                          double covariance[UNKNOWNS][UNKNOWNS])
{
    accumulate(n, f, 0, scale, 1);
    if (!dense_cholesky(UNKNOWNS, n->a[0]))
        return false;
    double half[UNKNOWNS][UNKNOWNS], scores[UNKNOWNS][UNKNOWNS] = {0};
    for (int k = 0; k < f->sites.count; k++) {
        double r, variance, by[UNKNOWNS];
        if (!residual_at(f, k, 0, &r, &variance, by))
            continue;
        double score = r * weight(r * r / (variance * scale * scale)) / variance;
        for (int i = 0; i < UNKNOWNS; i++)
            for (int j = 0; j < UNKNOWNS; j++)
                scores[i][j] += score * by[i] * (score * by[j]);
    }
    for (int i = 0; i < UNKNOWNS; i++)  // rows: B A^-1, since both are symmetric
        dense_solve(UNKNOWNS, n->a[0], scores[i]);
    for (int i = 0; i < UNKNOWNS; i++)
        for (int j = 0; j < UNKNOWNS; j++)
            half[i][j] = scores[j][i];
    for (int i = 0; i < UNKNOWNS; i++)
        dense_solve(UNKNOWNS, n->a[0], half[i]);
    memcpy(covariance, half, sizeof half);
    return true;
}

// How a point of the image without distortion moves where its pixel stays and the lens changes:
// pixel(q, lens) is constant.
static void undistorted_by_lens(const struct camera *camera, const double q[2],
                                double by[2][LENS_PARAMETERS])
{
    double pixel[2], j[2][2], pixel_by_lens[2][LENS_PARAMETERS];
    tag_image_distort(camera, q, pixel, j);
    tag_image_by_lens(camera, q, pixel_by_lens);
    double det = j[0][0] * j[1][1] - j[0][1] * j[1][0];
    for (int p = 0; p < LENS_PARAMETERS; p++) {
        const double x = pixel_by_lens[0][p], y = pixel_by_lens[1][p];
        by[0][p] = -(j[1][1] * x - j[0][1] * y) / det;
        by[1][p] = -(j[0][0] * y - j[1][0] * x) / det;
    }
}

// How the unknowns follow the lens: each photosite then sees another place of the pattern.
static void unknowns_by_lens(const struct fit *f, const struct normal *n, double scale,
                             const struct camera *camera, double by_lens[LENS_PARAMETERS][UNKNOWNS])
{
    memset(by_lens, 0, LENS_PARAMETERS * sizeof *by_lens);
    for (int k = 0; k < f->sites.count; k++) {
        const double *q = f->sites.site[k].q;
        double r, variance, by[UNKNOWNS], st[2], by_q[2][2], q_by[2][LENS_PARAMETERS];
        if (!residual_at(f, k, 0, &r, &variance, by)
            || (by[0] == 0 && by[3] == 0))  // by the two shifts: sees no edge
            continue;
        double w = weight(r * r / (variance * scale * scale)) / variance;
        tag_image_apply(&f->image.square_from_q, q, st, by_q);
        undistorted_by_lens(camera, q, q_by);
        for (int p = 0; p < LENS_PARAMETERS; p++) {
            double s = by_q[0][0] * q_by[0][p] + by_q[0][1] * q_by[1][p];
            double t = by_q[1][0] * q_by[0][p] + by_q[1][1] * q_by[1][p];
            for (int i = 0; i < UNKNOWNS; i++)
                by_lens[p][i] -= w * by[i] * (by[0] * s + by[3] * t);
        }
    }
    for (int p = 0; p < LENS_PARAMETERS; p++)
        dense_solve(UNKNOWNS, n->a[0], by_lens[p]);
}

static void corners_by_lens(struct tag_fit *out, const struct fit *f, const struct camera *camera,
                            double pixel_by_warp[8][WARP],
                            double by_lens[LENS_PARAMETERS][UNKNOWNS])
{
    for (int k = 0; k < 4; k++) {
        double direct[2][LENS_PARAMETERS];
        tag_image_by_lens(camera, f->image.corner[k], direct);
        for (int i = 0; i < 2; i++)
            for (int p = 0; p < LENS_PARAMETERS; p++) {
                double sum = direct[i][p];
                for (int w = 0; w < WARP; w++)
                    sum += pixel_by_warp[2 * k + i][w] * by_lens[p][w];
                out->by_lens[2 * k + i][p] = sum;
            }
    }
}

// Corners as pixels, with their covariance.
static bool finish(struct tag_fit *out, struct fit *f, const struct camera *camera)
{
    struct normal n;
    if (!look_at_all(f))
        return false;
    double scale = fmax(1, scatter_of(f)), all[UNKNOWNS][UNKNOWNS];
    double by[8][WARP], pixel_by_warp[8][WARP];
    double by_lens[LENS_PARAMETERS][UNKNOWNS];
    if (!covariance_of(f, &n, scale, all))
        return false;
    unknowns_by_lens(f, &n, scale, camera, by_lens);
    corners_by_warp(f, by);
    for (int k = 0; k < 4; k++) {
        double j[2][2];
        tag_image_distort(camera, f->image.corner[k], out->corner[k], j);
        for (int w = 0; w < WARP; w++)
            for (int i = 0; i < 2; i++)
                pixel_by_warp[2 * k + i][w] = j[i][0] * by[2 * k][w] + j[i][1] * by[2 * k + 1][w];
    }
    for (int i = 0; i < 8; i++)
        for (int j = 0; j < 8; j++) {
            out->covariance[i][j] = 0;
            for (int v = 0; v < WARP; v++)
                for (int w = 0; w < WARP; w++)
                    out->covariance[i][j] += pixel_by_warp[i][v] * all[v][w] * pixel_by_warp[j][w];
        }
    corners_by_lens(out, f, camera, pixel_by_warp, by_lens);
    out->blur = f->image.blur;
    out->contrast = f->level[3] - f->level[0];
    out->scatter = scale * paper_floor;
    out->inliers = n.inliers / n.sites;
    return true;
}

// A tag that is covered, in half shadow, or another tag, does not look like its pattern: then many
// photosites disagree, or the levels are close to each other.
static bool trustworthy(const struct tag_fit *fit, const struct fit *f, double start[4][2])
{
    double cell = 2 * f->half / f->image.pattern->side, far = 0;
    for (int k = 0; k < 4; k++)
        far = fmax(far, hypot(fit->corner[k][0] - start[k][0], fit->corner[k][1] - start[k][1]));
    return fit->contrast > 0 && fit->contrast > 0.3 * f->level[3] && fit->inliers > 0.9
           && fit->scatter < 0.1 && far < fmin(3, fmax(cell, 0.5)) && fit->blur < cell * cell;
}

bool corners_fit(struct tag_fit *fit, const struct tag_pattern *pattern,
                 const struct camera *camera, const struct radiance *map, double start[4][2])
{
    struct fit f = {.image = {.pattern = pattern, .blur = 0.25}};
    for (int k = 0; k < 4; k++)
        tag_image_undistort(camera, start[k], f.image.corner[k]);
    tag_image_set(&f.image);
    set_middle(&f, camera);
    // A first margin for sharp images; where the blur turns out wider, once more with a wider one.
    bool good = gather(&f, camera, map, 1.5) && fit_levels(&f) && slide(&f);
    double wanted = 3 * sqrt(f.image.blur);
    if (good && wanted > 1.7)
        good = gather(&f, camera, map, wanted) && slide(&f);
    good = good && finish(fit, &f, camera) && trustworthy(fit, &f, start);
    tag_sites_free(&f.sites);
    free(f.look);
    return good;
}
