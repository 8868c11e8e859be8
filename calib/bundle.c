/* bundle.c -- bundle adjustment of cameras, poses and tag places.
 *
 * Method.   Residuals and unknowns are those of bundle_problem.c, the noise that of bundle_noise.c.
 *           Solved by Ceres, poses eliminated (Triggs et al., "Bundle Adjustment -- A Modern
 *           Synthesis", 2000).
 *           Distortion terms that are zero within two deviations are held at zero, the highest
 *           order first: they would add their noise to every ray near the corners of the image.
 * Accuracy. That of the tags; derivatives are exact.
 */
#include "bundle_problem.h"

#include "arrow.h"
#include "dense.h"

#include <string.h>

static enum status solve(struct bundle *b, struct workspace *w, double scale, struct error *err)
{
    workspace_parameters(w, b);
    enum status status = workspace_terms(w, b, scale, sqrt(BUNDLE_CAUCHY2), err);
    if (!status)
        status = ceres_solve(&w->problem, err);
    if (!status)
        workspace_take(b, w);
    return status;
}

// ---- stages

// Unknowns in the order of lens.h: fx fy cx cy k1 k2 p1 p2 k3. What a prior says exactly is held.
static void hold_for_stage(bool held[LENS_PARAMETERS], enum bundle_stage stage,
                           const struct lens_prior *prior)
{
    static const bool stages[][LENS_PARAMETERS] = {
        [BUNDLE_LENS] = {0, 0, 0, 0, 0, 0, 0, 0, 1},
        [BUNDLE_CHOOSE] = {0},
    };
    for (int k = 0; k < LENS_PARAMETERS; k++)
        held[k] = stages[stage][k] || (prior && prior->sigma[k] == 0);
}

// Find the highest distortion term of a camera that is 0 within two deviations (p1 and p2 go
// together), set it to 0 and hold it there. false: all that are free are needed.
static bool hold_a_term(struct camera *camera, bool held[LENS_PARAMETERS],
                        const struct lens_prior *prior,
                        const double covariance[LENS_PARAMETERS * LENS_PARAMETERS])
{
    static const int candidates[][2] = {{8, 8}, {6, 7}, {5, 5}, {4, 4}};  // k3, p1 p2, k2, k1
    double value[LENS_PARAMETERS];
    lens_to_array(value, camera);
    for (int c = 0; c < 4; c++) {
        bool small = true, free_one = false;
        for (int e = 0; e < 2; e++) {
            int k = candidates[c][e];
            bool told = prior && isfinite(prior->sigma[k]);  // somebody knows better than zero
            small = small && !told && value[k] * value[k] < 4 * covariance[k * LENS_PARAMETERS + k];
            free_one = free_one || !held[k];
        }
        if (!free_one)
            continue;
        if (small) {
            for (int e = 0; e < 2; e++) {
                held[candidates[c][e]] = true;
                value[candidates[c][e]] = 0;
            }
            lens_from_array(camera, value);
            return true;
        }
        if (c != 1)
            return false;  // a needed radial term needs the lower ones too
    }
    return false;
}

static void fill_sigmas(const struct bundle *b, const struct workspace *w)
{
    struct calibration *c = b->calibration;
    for (int i = 0; i < c->cameras; i++) {
        double sigma[LENS_PARAMETERS];
        for (int k = 0; k < LENS_PARAMETERS; k++)
            sigma[k] = sqrt(w->camera_covariance[i][k * LENS_PARAMETERS + k]);
        memcpy(c->camera[i].sigma_focal, sigma, sizeof c->camera[i].sigma_focal);
        memcpy(c->camera[i].sigma_center, sigma + 2, sizeof c->camera[i].sigma_center);
        memcpy(c->camera[i].sigma_distortion, sigma + 4, sizeof c->camera[i].sigma_distortion);
        c->camera[i].rms_px = bundle_rms(b, -1, i);
    }
    for (int i = 0; i < c->views; i++) {
        for (int k = 0; k < 3; k++) {
            c->view[i].sigma_rotation[k] = sqrt(w->pose_covariance[i][k * POSE + k]);
            c->view[i].sigma_translation[k] = sqrt(w->pose_covariance[i][(k + 3) * POSE + k + 3]);
        }
        c->view[i].rms_px = bundle_rms(b, i, 0);
    }
    for (int i = 0; b->sigma_place && i < b->capture->tags; i++)
        for (int k = 0; k < PLACE; k++)
            b->sigma_place[i][k] =
                w->place_held[i][k] ? 0 : sqrt(w->place_covariance[i][k * PLACE + k]);
}

// Solve and take the scale of the noise, until no sighting changes sides.
static enum status settle(struct bundle *b, struct workspace *w, bool reject, double *scale,
                          struct error *err)
{
    enum status status = STATUS_OK;
    for (int round = 0; !status && round < 4; round++) {
        if (reject)
            status = bundle_weigh_views(b, err);
        if (!status)
            status = solve(b, w, bundle_shared_scale(b, *scale), err);
        double new_scale = status ? *scale : bundle_noise_scale(b);
        if (!status && isnan(new_scale))
            status = cap_fail(err, STATUS_MEMORY, "bundle of %d tags", b->sightings);
        bool steady = fabs(log(new_scale / *scale)) < 0.05;
        *scale = new_scale;
        int changed = 0;
        if (!status && reject)
            status = bundle_reject(b, *scale, &changed, err);
        if (steady && changed == 0)
            break;
    }
    return status;
}

// Covariances of all unknowns, from the Jacobian without the loss, and the tamed noise; `shared`:
// with what all corners share.
static enum status find_covariance(struct bundle *b, struct workspace *w, double scale, bool shared,
                                   struct error *err)
{
    double tamed = bundle_tamed_scale(b, scale);
    if (shared)
        tamed = bundle_shared_scale(b, tamed);
    enum status status = workspace_terms(w, b, tamed, 0, err);
    return status ? status : arrow_covariance(&w->problem, err);
}

// Drop terms one by one; each time all is solved again, since the others answer for it.
static enum status choose_terms(struct bundle *b, struct workspace *w, double *scale,
                                struct error *err)
{
    for (;;) {
        bool dropped = false;
        enum status status = find_covariance(b, w, *scale, false, err);
        if (status)
            return status;
        for (int i = 0; i < b->calibration->cameras; i++)
            dropped = hold_a_term(b->calibration->camera + i, w->held[i],
                                  b->prior ? b->prior + i : NULL, w->camera_covariance[i])
                      || dropped;
        if (!dropped)
            return STATUS_OK;
        status = settle(b, w, true, scale, err);
        if (status)
            return status;
    }
}

enum status bundle_adjust(struct bundle *b, enum bundle_stage stage, struct error *err)
{
    struct workspace w;
    double scale = bundle_noise_scale(b);
    if (isnan(scale))
        return cap_fail(err, STATUS_MEMORY, "bundle of %d tags", b->sightings);
    enum status status = workspace_make(&w, b, err);
    if (status)
        return status;
    for (int i = 0; i < b->calibration->cameras; i++)
        hold_for_stage(w.held[i], stage, b->prior ? b->prior + i : NULL);
    status = settle(b, &w, stage == BUNDLE_CHOOSE, &scale, err);
    if (!status && stage == BUNDLE_CHOOSE)
        status = choose_terms(b, &w, &scale, err);
    if (!status && stage == BUNDLE_CHOOSE && b->shared_px > 0)
        status = find_covariance(b, &w, scale, true, err);
    if (!status && stage == BUNDLE_CHOOSE)
        fill_sigmas(b, &w);
    workspace_free(&w);
    return status;
}

// ---- are the tags where they are said to be?

// Normal equations of one tag's place, all else being as it is.
struct place_normal {
    double a[PLACE][PLACE], b[PLACE], chi2;
    int sightings;
};

static void place_normal(struct place_normal *n, const struct workspace *w, const struct bundle *b,
                         int place)
{
    int index = b->calibration->cameras + b->calibration->views + place;
    *n = (struct place_normal){0};
    for (int i = 0; i < w->problem.terms; i++) {
        const struct ceres_term *term = w->problem.term + i;
        double r[TAG_NUMBERS], by[TAG_NUMBERS][PLACE], *all[3] = {NULL, NULL, by[0]};
        if (term->parameters != 3 || term->parameter[2] != index)
            continue;
        const double *values[3];
        for (int k = 0; k < 3; k++)
            values[k] = w->parameter[term->parameter[k]].value;
        if (!term->evaluate(term->context, values, r, all))
            continue;
        n->sightings++;
        for (int k = 0; k < TAG_NUMBERS; k++) {
            n->chi2 += r[k] * r[k];
            for (int p = 0; p < PLACE; p++) {
                n->b[p] -= by[k][p] * r[k];
                for (int q = 0; q < PLACE; q++)
                    n->a[p][q] += by[k][p] * by[k][q];
            }
        }
    }
}

enum status bundle_places_share(struct bundle *b, double *share, struct error *err)
{
    struct workspace w;
    enum status status = workspace_make(&w, b, err);
    if (status)
        return status;
    workspace_parameters(&w, b);
    status = workspace_terms(&w, b, 1, 0, err);
    double before = 0, gain = 0;
    int sightings = 0, tags = 0;
    for (int i = 0; !status && i < b->capture->tags; i++) {
        struct place_normal n;
        place_normal(&n, &w, b, i);
        before += n.chi2;
        sightings += n.sightings;
        if (n.sightings < 2 || !dense_cholesky(PLACE, n.a[0]))
            continue;
        double step[PLACE];
        memcpy(step, n.b, sizeof step);
        dense_solve(PLACE, n.a[0], step);
        for (int k = 0; k < PLACE; k++)
            gain += step[k] * n.b[k];
        tags++;
    }
    double freedom = TAG_NUMBERS * (double)sightings - POSE * b->calibration->views;
    double left = freedom - PLACE * tags;
    *share = before > 0 && left > 0 ? 1 - (before - gain) / left / (before / freedom) : 0;
    workspace_free(&w);
    return status;
}
