/* bundle.c -- bundle adjustment of cameras and poses.
 *
 * Method.   Residuals are the eight coordinates of a tag in a view, whitened by the covariance of
 *           its own fit; Cauchy's loss on the eight together, since what goes wrong goes wrong
 *           with a whole tag. Solved by Ceres, poses eliminated (Triggs et al., "Bundle
 *           Adjustment -- A Modern Synthesis", 2000). The scale of the noise is not known
 *           beforehand (print, paper, and a common error of the four corners are in it): it is
 *           taken from the median of the tags' chi^2, and tags far beyond are rejected.
 *           Distortion terms that are zero within two deviations are held at zero, the highest
 *           order first: they would add their noise to every ray near the corners of the image.
 * Accuracy. That of the tags; derivatives are exact.
 */
#include "bundle.h"

#include "ceres_shim.h"
#include "dense.h"
#include "lens.h"

#include <stdlib.h>
#include <string.h>

enum { CORNERS = 8, POSE = 6 };

// One sighting, ready for the solver.
struct term {
    vec3 corner[4];  // world
    double pixel[4][2];
    double whitener[CORNERS][CORNERS];  // lower triangular
    const struct sighting *sighting;
};

// A problem under construction; all arrays are owned.
struct workspace {
    struct term *term;
    struct ceres_term *ceres;
    struct ceres_parameter *parameter;  // cameras, then views
    double (*camera)[LENS_PARAMETERS], (*pose)[POSE];
    double (*camera_covariance)[LENS_PARAMETERS * LENS_PARAMETERS], (*pose_covariance)[POSE * POSE];
    bool (*held)[LENS_PARAMETERS];
    struct ceres_problem problem;
};

// ---- residuals

static vec3 vec3_of(const double v[3])
{
    return (vec3){v[0], v[1], v[2]};
}

// Residual of one corner with derivatives; false: the corner is behind the camera.
static bool corner_residual(const struct term *t, int k, double const *const *parameters,
                            double r[2], double by_camera[2][LENS_PARAMETERS],
                            double by_pose[2][POSE])
{
    double by_rotation[3][3], by_point[2][3], pixel[2];
    vec3 turned = lens_rotate(vec3_of(parameters[1]), t->corner[k], by_rotation);
    vec3 p = vec3_add(turned, vec3_of(parameters[1] + 3));
    if (!(p.z > 0))
        return false;
    lens_project(parameters[0], p, pixel, by_point, by_camera);
    for (int i = 0; i < 2; i++) {
        r[i] = t->pixel[k][i] - pixel[i];
        for (int c = 0; c < LENS_PARAMETERS; c++)
            by_camera[i][c] = -by_camera[i][c];
        for (int j = 0; j < 3; j++) {
            by_pose[i][j] = 0;
            for (int m = 0; m < 3; m++)
                by_pose[i][j] -= by_point[i][m] * by_rotation[m][j];
            by_pose[i][3 + j] = -by_point[i][j];
        }
    }
    return true;
}

// out = whitener * in, for [8][columns] matrices.
static void whiten(const struct term *t, int columns, const double *in, double *out)
{
    for (int i = 0; i < CORNERS; i++)
        for (int c = 0; c < columns; c++) {
            double sum = 0;
            for (int j = 0; j <= i; j++)
                sum += t->whitener[i][j] * in[j * columns + c];
            out[i * columns + c] = sum;
        }
}

static bool evaluate(const void *context, double const *const *parameters, double *residuals,
                     double **jacobians)
{
    const struct term *t = context;
    double r[CORNERS], by_camera[CORNERS][LENS_PARAMETERS], by_pose[CORNERS][POSE];
    for (int k = 0; k < 4; k++)
        if (!corner_residual(t, k, parameters, r + 2 * k, by_camera + 2 * k, by_pose + 2 * k))
            return false;
    whiten(t, 1, r, residuals);
    if (jacobians && jacobians[0])
        whiten(t, LENS_PARAMETERS, by_camera[0], jacobians[0]);
    if (jacobians && jacobians[1])
        whiten(t, POSE, by_pose[0], jacobians[1]);
    return true;
}

bool bundle_residual(const struct bundle *b, const struct sighting *s, double r[4][2])
{
    const struct view *view = b->calibration->view + s->view;
    const struct camera *camera = b->calibration->camera + view->camera;
    mat3 turn = cal_rotation(view->view_from_world.rotation);
    for (int k = 0; k < 4; k++) {
        vec3 world = cap_tag_corner(b->capture->tag + s->place, k);
        vec3 p = vec3_add(mat3_mul(&turn, world), view->view_from_world.translation);
        double pixel[2];
        if (!(p.z > 0))
            return false;
        cal_project(camera, p, pixel);
        for (int i = 0; i < 2; i++)
            r[k][i] = s->corner[k][i] - pixel[i];
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
    double l[CORNERS][CORNERS], r[4][2], x[CORNERS], sum = 0;
    memcpy(l, s->covariance, sizeof l);
    if (!bundle_residual(b, s, r) || !dense_cholesky(CORNERS, l[0]))
        return INFINITY;
    memcpy(x, r, sizeof x);
    dense_solve(CORNERS, l[0], x);
    for (int i = 0; i < CORNERS; i++)
        sum += x[i] * r[i / 2][i % 2];
    return sum;
}

// ---- noise and outliers

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// Variance of the tags' noise in units of their own covariance: median chi^2 over that of eight
// Gaussian numbers, corrected for the freedom that the fit has taken. NAN: out of memory.
static double noise_scale(const struct bundle *b)
{
    double *chi2 = malloc((size_t)(b->sightings + 1) * sizeof *chi2);
    if (!chi2)
        return NAN;
    int n = 0;
    for (int i = 0; i < b->sightings; i++)
        if (!b->sighting[i].rejected)
            chi2[n++] = chi2_of(b, b->sighting + i);
    qsort(chi2, (size_t)n, sizeof *chi2, compare_doubles);
    double unknowns = POSE * b->calibration->views + LENS_PARAMETERS * b->calibration->cameras;
    double freedom = fmax(1 - unknowns / (CORNERS * (n + 1.0)), 0.1);
    double median = n ? chi2[n / 2] / 7.344 : 1;  // the median of chi^2 with 8 degrees of freedom
    free(chi2);
    return fmax(median / freedom, 1e-12);
}

// Half of a tag's weight is gone where chi^2 is five times its mean.
static const double cauchy2 = 5 * CORNERS;

// Variance of the tags' noise as the weights of the loss see it, where `scale` is the median's:
// what a covariance needs, since long tails that the loss tames count by what it leaves of them.
static double tamed_scale(const struct bundle *b, double scale)
{
    double sum = 0, weights = 0;
    for (int i = 0; i < b->sightings; i++) {
        const struct sighting *s = b->sighting + i;
        double chi2 = s->rejected ? INFINITY : chi2_of(b, s) / scale;
        double w = 1 / (1 + chi2 / cauchy2);  // 0 of infinity
        sum += w > 0 ? w * chi2 : 0;
        weights += w;
    }
    double unknowns = POSE * b->calibration->views + LENS_PARAMETERS * b->calibration->cameras;
    double freedom = fmax(1 - unknowns / (CORNERS * (b->sightings + 1.0)), 0.1);
    return weights > 0 ? 1.048 * scale * sum / weights / CORNERS / freedom : scale;
}

// Five deviations in each of the eight numbers: the loss deals with what is less. A tag that is
// partly covered can have a wide covariance of its own and pass; it is far off all the same.
static const double outlier_chi2 = 25 * CORNERS, outlier_rms = 10;

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

// Mark the sightings that disagree; *changed is how many changed sides.
static enum status reject_outliers(struct bundle *b, double scale, int *changed, struct error *err)
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

// ---- the problem for Ceres

static void workspace_free(struct workspace *w)
{
    free(w->term);
    free(w->ceres);
    free(w->parameter);
    free(w->camera);
    free(w->pose);
    free(w->camera_covariance);
    free(w->pose_covariance);
    free(w->held);
}

static enum status workspace_make(struct workspace *w, const struct bundle *b, struct error *err)
{
    size_t n = (size_t)b->sightings + 1, cameras = (size_t)b->calibration->cameras,
           views = (size_t)b->calibration->views;
    *w = (struct workspace){
        .term = calloc(n, sizeof *w->term),
        .ceres = calloc(n, sizeof *w->ceres),
        .parameter = calloc(cameras + views, sizeof *w->parameter),
        .camera = calloc(cameras, sizeof *w->camera),
        .pose = calloc(views, sizeof *w->pose),
        .camera_covariance = calloc(cameras, sizeof *w->camera_covariance),
        .pose_covariance = calloc(views, sizeof *w->pose_covariance),
        .held = calloc(cameras, sizeof *w->held),
    };
    if (w->term && w->ceres && w->parameter && w->camera && w->pose && w->camera_covariance
        && w->pose_covariance && w->held)
        return STATUS_OK;
    workspace_free(w);
    *w = (struct workspace){0};
    return cap_fail(err, STATUS_MEMORY, "bundle of %d tags", b->sightings);
}

static void set_parameters(struct workspace *w, const struct bundle *b)
{
    const struct calibration *c = b->calibration;
    for (int i = 0; i < c->cameras; i++) {
        lens_to_array(w->camera[i], c->camera + i);
        w->parameter[i] = (struct ceres_parameter){.value = w->camera[i],
                                                   .size = LENS_PARAMETERS,
                                                   .held = w->held[i],
                                                   .covariance = w->camera_covariance[i]};
    }
    for (int i = 0; i < c->views; i++) {
        memcpy(w->pose[i], &c->view[i].view_from_world, sizeof w->pose[i]);
        w->parameter[c->cameras + i] =
            (struct ceres_parameter){.value = w->pose[i],
                                     .size = POSE,
                                     .eliminate = true,
                                     .covariance = w->pose_covariance[i]};
    }
    w->problem.parameter = w->parameter;
    w->problem.parameters = c->cameras + c->views;
}

// One term a sighting; `scale` is the common variance of the noise.
static enum status set_terms(struct workspace *w, const struct bundle *b, double scale,
                             double cauchy, struct error *err)
{
    int n = 0;
    for (int i = 0; i < b->sightings; i++) {
        const struct sighting *s = b->sighting + i;
        if (s->rejected)
            continue;
        struct term *t = w->term + n;
        double l[CORNERS][CORNERS];
        t->sighting = s;
        memcpy(t->pixel, s->corner, sizeof t->pixel);
        for (int k = 0; k < 4; k++)
            t->corner[k] = cap_tag_corner(b->capture->tag + s->place, k);
        for (int k = 0; k < CORNERS; k++)
            for (int j = 0; j < CORNERS; j++)
                l[k][j] = s->covariance[k][j] * scale;
        if (!dense_cholesky(CORNERS, l[0]))
            return cap_fail(err, STATUS_SOLVER, "tag %d: covariance of its corners",
                            b->capture->tag[s->place].id);
        dense_whitener(CORNERS, l[0], t->whitener[0]);
        w->ceres[n] = (struct ceres_term){.evaluate = evaluate,
                                          .context = t,
                                          .residuals = CORNERS,
                                          .parameters = 2,
                                          .cauchy = cauchy};
        w->ceres[n].parameter[0] = b->calibration->view[s->view].camera;
        w->ceres[n].parameter[1] = b->calibration->cameras + s->view;
        n++;
    }
    w->problem.term = w->ceres;
    w->problem.terms = n;
    return STATUS_OK;
}

static void take_values(const struct bundle *b, const struct workspace *w)
{
    struct calibration *c = b->calibration;
    for (int i = 0; i < c->cameras; i++)
        lens_from_array(c->camera + i, w->camera[i]);
    for (int i = 0; i < c->views; i++)
        memcpy(&c->view[i].view_from_world, w->pose[i], sizeof w->pose[i]);
}

static enum status solve(struct bundle *b, struct workspace *w, double scale, struct error *err)
{
    set_parameters(w, b);
    enum status status = set_terms(w, b, scale, sqrt(cauchy2), err);
    if (!status)
        status = ceres_solve(&w->problem, err);
    if (!status)
        take_values(b, w);
    return status;
}

// ---- stages

// Unknowns in the order of lens.h: fx fy cx cy k1 k2 p1 p2 k3.
static void hold_for_stage(bool held[LENS_PARAMETERS], enum bundle_stage stage)
{
    static const bool stages[][LENS_PARAMETERS] = {
        [BUNDLE_FOCAL] = {0, 0, 1, 1, 0, 1, 1, 1, 1},
        [BUNDLE_LENS] = {0, 0, 0, 0, 0, 0, 0, 0, 1},
        [BUNDLE_CHOOSE] = {0},
    };
    memcpy(held, stages[stage], sizeof stages[stage]);
}

// Find the highest distortion term of a camera that is 0 within two deviations (p1 and p2 go
// together), set it to 0 and hold it there. false: all that are free are needed.
static bool hold_a_term(struct camera *camera, bool held[LENS_PARAMETERS],
                        const double covariance[LENS_PARAMETERS * LENS_PARAMETERS])
{
    static const int candidates[][2] = {{8, 8}, {6, 7}, {5, 5}, {4, 4}};  // k3, p1 p2, k2, k1
    double value[LENS_PARAMETERS];
    lens_to_array(value, camera);
    for (int c = 0; c < 4; c++) {
        bool small = true, free_one = false;
        for (int e = 0; e < 2; e++) {
            int k = candidates[c][e];
            small = small && value[k] * value[k] < 4 * covariance[k * LENS_PARAMETERS + k];
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
}

// Solve and take the scale of the noise, until no sighting changes sides.
static enum status settle(struct bundle *b, struct workspace *w, bool reject, double *scale,
                          struct error *err)
{
    enum status status = STATUS_OK;
    for (int round = 0; !status && round < 4; round++) {
        status = solve(b, w, *scale, err);
        double new_scale = status ? *scale : noise_scale(b);
        if (!status && isnan(new_scale))
            status = cap_fail(err, STATUS_MEMORY, "bundle of %d tags", b->sightings);
        bool steady = fabs(log(new_scale / *scale)) < 0.05;
        *scale = new_scale;
        int changed = 0;
        if (!status && reject)
            status = reject_outliers(b, *scale, &changed, err);
        if (steady && changed == 0)
            break;
    }
    return status;
}

// Covariances of all unknowns, from the Jacobian without the loss, and the tamed noise.
static enum status find_covariance(struct bundle *b, struct workspace *w, double scale,
                                   struct error *err)
{
    enum status status = set_terms(w, b, tamed_scale(b, scale), 0, err);
    return status ? status : ceres_covariance(&w->problem, err);
}

// Drop terms one by one; each time all is solved again, since the others answer for it.
static enum status choose_terms(struct bundle *b, struct workspace *w, double *scale,
                                struct error *err)
{
    for (;;) {
        bool dropped = false;
        enum status status = find_covariance(b, w, *scale, err);
        if (status)
            return status;
        for (int i = 0; i < b->calibration->cameras; i++)
            dropped = hold_a_term(b->calibration->camera + i, w->held[i], w->camera_covariance[i])
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
    double scale = noise_scale(b);
    if (isnan(scale))
        return cap_fail(err, STATUS_MEMORY, "bundle of %d tags", b->sightings);
    enum status status = workspace_make(&w, b, err);
    if (status)
        return status;
    for (int i = 0; i < b->calibration->cameras; i++)
        hold_for_stage(w.held[i], stage);
    status = settle(b, &w, stage == BUNDLE_CHOOSE, &scale, err);
    if (!status && stage == BUNDLE_CHOOSE)
        status = choose_terms(b, &w, &scale, err);
    if (!status && stage == BUNDLE_CHOOSE)
        fill_sigmas(b, &w);
    workspace_free(&w);
    return status;
}
