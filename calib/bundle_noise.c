/* bundle_noise.c -- residuals of tags about a fit, the scale of their noise, and which are outside.
 *
 * Method.   The scale of the noise is not known beforehand (print, paper, and a common error of the
 *           four corners are in it): it is taken from the median of the tags' chi^2, and tags far
 *           beyond are rejected. Most of it is what the model of a tag's image leaves, and that
 *           goes by view (edges that run along the rows of a sharp image, motion, focus), so each
 *           view has a variance of its own, drawn towards the common one the more the fewer tags
 *           it shows.
 */
#include "bundle_noise.h"

#include "dense.h"

#include <stdlib.h>
#include <string.h>

bool bundle_placed(const struct tag_place *tag)
{
    return isfinite(tag->center.x);
}

void bundle_corner(const struct camera *camera, const struct sighting *s, double corner[4][2])
{
    double lens[LENS_PARAMETERS];
    lens_to_array(lens, camera);
    for (int i = 0; i < TAG_NUMBERS; i++) {
        double at = s->corner[i / 2][i % 2];
        for (int p = 0; p < LENS_PARAMETERS; p++)
            at += s->by_lens[i][p] * (lens[p] - s->lens[p]);
        corner[i / 2][i % 2] = at;
    }
}

bool bundle_residual(const struct bundle *b, const struct sighting *s, double r[4][2])
{
    const struct view *view = b->calibration->view + s->view;
    const struct camera *camera = b->calibration->camera + view->camera;
    if (!bundle_placed(b->capture->tag + s->place))
        return false;
    double corner[4][2];
    bundle_corner(camera, s, corner);
    mat3 turn = cal_rotation(view->view_from_world.rotation);
    for (int k = 0; k < 4; k++) {
        vec3 world = cap_tag_corner(b->capture->tag + s->place, k);
        vec3 p = vec3_add(mat3_mul(&turn, world), view->view_from_world.translation);
        double pixel[2];
        if (!(p.z > 0))
            return false;
        cal_project(camera, p, pixel);
        for (int i = 0; i < 2; i++)
            r[k][i] = corner[k][i] - pixel[i];
    }
    return true;
}

double bundle_rms(const struct bundle *b, int view, int camera)
{
    double squares = 0, r[4][2];
    int corners = 0;
    for (int i = 0; i < b->sightings; i++) {
        const struct sighting *s = b->sighting + i;
        bool wanted = view >= 0 ? s->view == view : b->calibration->view[s->view].camera == camera;
        if (s->rejected || !wanted || !bundle_residual(b, s, r))
            continue;
        for (int k = 0; k < 4; k++)
            squares += r[k][0] * r[k][0] + r[k][1] * r[k][1];
        corners += 4;
    }
    return corners ? sqrt(squares / corners) : 0;
}

// chi^2 of a sighting by its own covariance; infinite where it cannot be.
static double chi2_of(const struct bundle *b, const struct sighting *s)
{
    double l[TAG_NUMBERS][TAG_NUMBERS], r[4][2], x[TAG_NUMBERS], sum = 0;
    memcpy(l, s->covariance, sizeof l);
    if (!bundle_residual(b, s, r) || !dense_cholesky(TAG_NUMBERS, l[0]))
        return INFINITY;
    memcpy(x, r, sizeof x);
    dense_solve(TAG_NUMBERS, l[0], x);
    for (int i = 0; i < TAG_NUMBERS; i++)
        sum += x[i] * r[i / 2][i % 2];
    return sum / exp(s->log_noise);
}

// ---- noise and outliers

static const double CHI2_MEDIAN = 7.344;  // with 8 degrees of freedom

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// What the unknowns leave of the freedom of so many sightings.
static double freedom_left(const struct bundle *b, int sightings)
{
    double unknowns = 6.0 * b->calibration->views;
    for (int i = 0; i < b->calibration->cameras; i++)
        for (int k = 0; k < LENS_PARAMETERS; k++)
            unknowns += !b->prior || b->prior[i].sigma[k] > 0;
    for (int i = 0; b->given && i < b->capture->tags; i++)
        unknowns += b->place_sigma > 0 || b->given[i].unplaced ? 6 : 0;
    return fmax(1 - unknowns / (TAG_NUMBERS * (sightings + 1.0)), 0.1);
}

double bundle_noise_scale(const struct bundle *b)
{
    double *chi2 = malloc((size_t)(b->sightings + 1) * sizeof *chi2);
    if (!chi2)
        return NAN;
    int n = 0;
    for (int i = 0; i < b->sightings; i++)
        if (!b->sighting[i].rejected)
            chi2[n++] = chi2_of(b, b->sighting + i);
    qsort(chi2, (size_t)n, sizeof *chi2, compare_doubles);
    double freedom = freedom_left(b, n);
    double median = n ? chi2[n / 2] / CHI2_MEDIAN : 1;
    free(chi2);
    return fmax(median / freedom, 1e-12);
}

// Logarithms of views' variances are taken to scatter by 1. That of a median of n values of chi^2
// with 8 degrees of freedom by sqrt(0.5 / n): the common variance weighs like half a tag. Within
// this factor of that.
static const double common_tags = 0.5, most_noise = 100;

enum status bundle_weigh_views(struct bundle *b, struct error *err)
{
    double *chi2 = malloc((size_t)(b->sightings + 1) * sizeof *chi2);
    if (!chi2)
        return cap_fail(err, STATUS_MEMORY, "bundle of %d tags", b->sightings);
    for (int i = 0; i < b->sightings; i++)
        b->sighting[i].log_noise = 0;
    double scale = bundle_noise_scale(b);
    enum status status =
        isnan(scale) ? cap_fail(err, STATUS_MEMORY, "bundle of %d tags", b->sightings) : STATUS_OK;
    for (int v = 0; v < b->calibration->views && !status; v++) {
        int n = 0;
        for (int i = 0; i < b->sightings; i++)
            if (b->sighting[i].view == v && !b->sighting[i].rejected)
                chi2[n++] = chi2_of(b, b->sighting + i) / scale;
        if (n < 3)
            continue;
        qsort(chi2, (size_t)n, sizeof *chi2, compare_doubles);
        double own = 0.5 * (chi2[(n - 1) / 2] + chi2[n / 2]) / CHI2_MEDIAN / (1 - 6.0 / (8 * n));
        own = log(fmin(fmax(own, 1 / most_noise), most_noise)) * n / (n + common_tags);
        for (int i = 0; i < b->sightings; i++)
            if (b->sighting[i].view == v)
                b->sighting[i].log_noise = own;
    }
    free(chi2);
    return status;
}

double bundle_tamed_scale(const struct bundle *b, double scale)
{
    double sum = 0, weights = 0;
    for (int i = 0; i < b->sightings; i++) {
        const struct sighting *s = b->sighting + i;
        double chi2 = s->rejected ? INFINITY : chi2_of(b, s) / scale;
        double w = 1 / (1 + chi2 / BUNDLE_CAUCHY2);  // 0 of infinity
        sum += w > 0 ? w * chi2 : 0;
        weights += w;
    }
    double freedom = freedom_left(b, b->sightings);
    return weights > 0 ? 1.048 * scale * sum / weights / TAG_NUMBERS / freedom : scale;
}

double bundle_shared_scale(const struct bundle *b, double scale)
{
    double squares = 0, r[4][2];
    int numbers = 0;
    for (int i = 0; b->shared_px > 0 && i < b->sightings; i++) {
        if (b->sighting[i].rejected || !bundle_residual(b, b->sighting + i, r))
            continue;
        for (int k = 0; k < TAG_NUMBERS; k++)
            squares += r[k / 2][k % 2] * r[k / 2][k % 2];
        numbers += TAG_NUMBERS;
    }
    double mean = squares > 0 ? squares / numbers / numbers : INFINITY;  // variance of their mean
    return scale * (1 + b->shared_px * b->shared_px / mean);
}

// Five deviations in each of the eight numbers: the loss deals with what is less. A tag that is
// partly covered can have a wide covariance of its own and pass; it is far off all the same.
static const double outlier_chi2 = 25 * TAG_NUMBERS, outlier_rms = 10;

// Root mean square distance of a sighting's corners from their projections.
static double rms_of(const struct bundle *b, const struct sighting *s)
{
    double r[4][2], squares = 0;
    if (!bundle_residual(b, s, r))
        return INFINITY;
    for (int k = 0; k < 4; k++)
        squares += r[k][0] * r[k][0] + r[k][1] * r[k][1];
    return sqrt(squares / 4);
}

enum status bundle_reject(struct bundle *b, double scale, int *changed, struct error *err)
{
    double *rms = malloc((size_t)(b->sightings + 1) * sizeof *rms);
    if (!rms)
        return cap_fail(err, STATUS_MEMORY, "bundle of %d tags", b->sightings);
    for (int i = 0; i < b->sightings; i++)
        rms[i] = rms_of(b, b->sighting + i);
    qsort(rms, (size_t)b->sightings, sizeof *rms, compare_doubles);
    double median = b->sightings ? rms[b->sightings / 2] : 0;
    free(rms);
    *changed = 0;
    for (int i = 0; i < b->sightings; i++) {
        struct sighting *s = b->sighting + i;
        bool rejected = chi2_of(b, s) > outlier_chi2 * scale || rms_of(b, s) > outlier_rms * median;
        *changed += rejected != s->rejected;
        s->rejected = rejected;
    }
    return STATUS_OK;
}
