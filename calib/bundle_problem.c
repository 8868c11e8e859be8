/* bundle_problem.c -- a bundle, said as a least-squares problem: residuals with their derivatives.
 *
 * Method.   Residuals are the eight coordinates of a tag in a view, whitened by the covariance of
 *           its own fit, which follows the lens (corners.h); Cauchy's loss on the eight together,
 * since what goes wrong goes wrong with a whole tag. A place is six unknowns, a turn about where
 * the tag was at the start and the centre: the tag's size is never one of them, and so holds the
 * scale. What is known of places and lenses beforehand are terms of their own.
 */
#include "bundle_problem.h"

#include "dense.h"

#include <stdlib.h>
#include <string.h>

// One sighting, ready for the solver.
struct term {
    vec3 arm[4];  // from the tag's centre to its corners, in the world, at the start
    const struct sighting *sighting;
    double whitener[TAG_NUMBERS][TAG_NUMBERS];  // lower triangular
};

// A place that somebody measured: the turn that brings the start to it, its centre, sigmas.
struct place_term {
    double expected[PLACE], sigma[PLACE];
};

struct lens_term {
    const struct lens_prior *prior;
};

// ---- residuals

static vec3 vec3_of(const double v[3])
{
    return (vec3){v[0], v[1], v[2]};
}

// The parameters of a term, and how many rows of derivatives each has room for.
enum { BY_CAMERA, BY_POSE, BY_PLACE, PARTS };

struct corner_derivatives {
    double camera[2][LENS_PARAMETERS], pose[2][POSE], place[2][PLACE];
};

// Residual of one corner with derivatives; false: the corner is behind the camera.
static bool corner_residual(const struct term *t, int k, double const *const *parameters,
                            double r[2], struct corner_derivatives *by)
{
    const double *place = parameters[BY_PLACE];
    double world_by_turn[3][3], view_by_turn[3][3], by_view[2][3], pixel[2];
    vec3 world =
        vec3_add(lens_rotate(vec3_of(place), t->arm[k], world_by_turn), vec3_of(place + 3));
    vec3 turned = lens_rotate(vec3_of(parameters[BY_POSE]), world, view_by_turn);
    vec3 p = vec3_add(turned, vec3_of(parameters[BY_POSE] + 3));
    if (!(p.z > 0))
        return false;
    lens_project(parameters[BY_CAMERA], p, pixel, by_view, by->camera);
    mat3 view_from_world = cal_rotation(vec3_of(parameters[BY_POSE]));
    const struct sighting *s = t->sighting;
    for (int i = 0; i < 2; i++) {
        r[i] = s->corner[k][i] - pixel[i];
        for (int c = 0; c < LENS_PARAMETERS; c++) {
            r[i] += s->by_lens[2 * k + i][c] * (parameters[BY_CAMERA][c] - s->lens[c]);
            by->camera[i][c] = s->by_lens[2 * k + i][c] - by->camera[i][c];
        }
        double by_world[3];
        for (int j = 0; j < 3; j++) {
            by->pose[i][j] = 0;
            by_world[j] = 0;
            for (int m = 0; m < 3; m++) {
                by->pose[i][j] -= by_view[i][m] * view_by_turn[m][j];
                by_world[j] -= by_view[i][m] * view_from_world.m[m][j];
            }
            by->pose[i][3 + j] = -by_view[i][j];
            by->place[i][3 + j] = by_world[j];
        }
        for (int j = 0; j < 3; j++)
            by->place[i][j] = by_world[0] * world_by_turn[0][j] + by_world[1] * world_by_turn[1][j]
                              + by_world[2] * world_by_turn[2][j];
    }
    return true;
}

// out = whitener * in, for [8][columns] matrices.
static void whiten(const struct term *t, int columns, const double *in, double *out)
{
    for (int i = 0; i < TAG_NUMBERS; i++)
        for (int c = 0; c < columns; c++) {
            double sum = 0;
            for (int j = 0; j <= i; j++)
                sum += t->whitener[i][j] * in[j * columns + c];
            out[i * columns + c] = sum;
        }
}

static bool evaluate_tag(const void *context, double const *const *parameters, double *residuals,
                         double **jacobians)
{
    const struct term *t = context;
    double r[TAG_NUMBERS], by_camera[TAG_NUMBERS][LENS_PARAMETERS], by_pose[TAG_NUMBERS][POSE],
        by_place[TAG_NUMBERS][PLACE];
    for (int k = 0; k < 4; k++) {
        struct corner_derivatives by;
        if (!corner_residual(t, k, parameters, r + 2 * k, &by))
            return false;
        memcpy(by_camera + 2 * k, by.camera, sizeof by.camera);
        memcpy(by_pose + 2 * k, by.pose, sizeof by.pose);
        memcpy(by_place + 2 * k, by.place, sizeof by.place);
    }
    whiten(t, 1, r, residuals);
    if (jacobians && jacobians[BY_CAMERA])
        whiten(t, LENS_PARAMETERS, by_camera[0], jacobians[BY_CAMERA]);
    if (jacobians && jacobians[BY_POSE])
        whiten(t, POSE, by_pose[0], jacobians[BY_POSE]);
    if (jacobians && jacobians[BY_PLACE])
        whiten(t, PLACE, by_place[0], jacobians[BY_PLACE]);
    return true;
}

// Numbers that are known to a deviation each: the residuals of places and lenses.
static bool evaluate_known(int count, const double *expected, const double *sigma,
                           const double *value, double *residuals, double **jacobians)
{
    for (int i = 0; i < count; i++) {
        bool tells = isfinite(sigma[i]) && sigma[i] > 0;
        residuals[i] = tells ? (value[i] - expected[i]) / sigma[i] : 0;
        for (int j = 0; jacobians && jacobians[0] && j < count; j++)
            jacobians[0][i * count + j] = tells && i == j ? 1 / sigma[i] : 0;
    }
    return true;
}

static bool evaluate_place(const void *context, double const *const *parameters, double *residuals,
                           double **jacobians)
{
    const struct place_term *t = context;
    return evaluate_known(PLACE, t->expected, t->sigma, parameters[0], residuals, jacobians);
}

static bool evaluate_lens(const void *context, double const *const *parameters, double *residuals,
                          double **jacobians)
{
    const struct lens_term *t = context;
    return evaluate_known(LENS_PARAMETERS, t->prior->value, t->prior->sigma, parameters[0],
                          residuals, jacobians);
}

static bool evaluate_square(const void *context, double const *const *parameters, double *residuals,
                            double **jacobians)
{
    const struct lens_term *t = context;
    const double *lens = parameters[0], sigma = t->prior->sigma_square;
    residuals[0] = log(lens[1] / lens[0]) / sigma;
    for (int k = 0; jacobians && jacobians[0] && k < LENS_PARAMETERS; k++)
        jacobians[0][k] = k == 0 ? -1 / (lens[0] * sigma) : k == 1 ? 1 / (lens[1] * sigma) : 0;
    return isfinite(residuals[0]);
}

// ---- the workspace

void workspace_free(struct workspace *w)
{
    free(w->term);
    free(w->known);
    free(w->lens);
    free(w->ceres);
    free(w->parameter);
    free(w->camera);
    free(w->pose);
    free(w->place);
    free(w->camera_covariance);
    free(w->pose_covariance);
    free(w->place_covariance);
    free(w->held);
    free(w->place_held);
    free(w->start);
    *w = (struct workspace){0};
}

enum status workspace_make(struct workspace *w, const struct bundle *b, struct error *err)
{
    size_t n = (size_t)b->sightings + 1, cameras = (size_t)b->calibration->cameras,
           views = (size_t)b->calibration->views, tags = (size_t)b->capture->tags;
    *w = (struct workspace){
        .term = calloc(n, sizeof *w->term),
        .known = calloc(tags, sizeof *w->known),
        .lens = calloc(cameras, sizeof *w->lens),
        .ceres = calloc(n + tags + 2 * cameras, sizeof *w->ceres),
        .parameter = calloc(cameras + views + tags, sizeof *w->parameter),
        .camera = calloc(cameras, sizeof *w->camera),
        .pose = calloc(views, sizeof *w->pose),
        .place = calloc(tags, sizeof *w->place),
        .camera_covariance = calloc(cameras, sizeof *w->camera_covariance),
        .pose_covariance = calloc(views, sizeof *w->pose_covariance),
        .place_covariance = calloc(tags, sizeof *w->place_covariance),
        .held = calloc(cameras, sizeof *w->held),
        .place_held = calloc(tags, sizeof *w->place_held),
        .start = calloc(tags, sizeof *w->start),
    };
    if (w->term && w->known && w->lens && w->ceres && w->parameter && w->camera && w->pose
        && w->place && w->camera_covariance && w->pose_covariance && w->place_covariance && w->held
        && w->place_held && w->start)
        return STATUS_OK;
    workspace_free(w);
    return cap_fail(err, STATUS_MEMORY, "bundle of %d tags", b->sightings);
}

// ---- the unknowns

static bool is_free(const struct bundle *b, int place)
{
    bool seen = false;
    if (!b->given || !(b->place_sigma > 0 || b->given[place].unplaced)
        || !bundle_placed(b->capture->tag + place))
        return false;
    for (int i = 0; i < b->sightings && !seen; i++)
        seen = b->sighting[i].place == place && !b->sighting[i].rejected;
    return seen;
}

static void add_parameter(struct workspace *w, struct ceres_parameter parameter)
{
    w->parameter[w->problem.parameters++] = parameter;
}

void workspace_parameters(struct workspace *w, const struct bundle *b)
{
    const struct calibration *c = b->calibration;
    w->problem.parameter = w->parameter;
    w->problem.parameters = 0;
    for (int i = 0; i < c->cameras; i++) {
        lens_to_array(w->camera[i], c->camera + i);
        add_parameter(w, (struct ceres_parameter){.value = w->camera[i],
                                                  .size = LENS_PARAMETERS,
                                                  .held = w->held[i],
                                                  .covariance = w->camera_covariance[i]});
    }
    for (int i = 0; i < c->views; i++) {
        memcpy(w->pose[i], &c->view[i].view_from_world, sizeof w->pose[i]);
        add_parameter(w, (struct ceres_parameter){.value = w->pose[i],
                                                  .size = POSE,
                                                  .eliminate = true,
                                                  .covariance = w->pose_covariance[i]});
    }
    for (int i = 0; i < b->capture->tags; i++) {
        const vec3 at = b->capture->tag[i].center;
        w->start[i] = b->capture->tag[i];
        w->place[i][0] = w->place[i][1] = w->place[i][2] = 0;
        if (bundle_placed(b->capture->tag + i))
            memcpy(w->place[i] + 3, &at, sizeof at);
        bool held = !is_free(b, i);
        for (int k = 0; k < PLACE; k++)
            w->place_held[i][k] = held;
        add_parameter(w,
                      (struct ceres_parameter){.value = w->place[i],
                                               .size = PLACE,
                                               .held = w->place_held[i],
                                               .covariance = held ? NULL : w->place_covariance[i]});
    }
}

// ---- the terms

static enum status tag_term(struct term *t, const struct bundle *b, const struct sighting *s,
                            double scale, struct error *err)
{
    const struct tag_place *tag = b->capture->tag + s->place;
    double l[TAG_NUMBERS][TAG_NUMBERS];
    t->sighting = s;
    for (int k = 0; k < 4; k++)
        t->arm[k] = vec3_sub(cap_tag_corner(tag, k), tag->center);
    for (int k = 0; k < TAG_NUMBERS; k++)
        for (int j = 0; j < TAG_NUMBERS; j++)
            l[k][j] = s->covariance[k][j] * scale * exp(s->log_noise);
    if (!dense_cholesky(TAG_NUMBERS, l[0]))
        return cap_fail(err, STATUS_SOLVER, "tag %d: covariance of its corners", tag->id);
    dense_whitener(TAG_NUMBERS, l[0], t->whitener[0]);
    return STATUS_OK;
}

// The turn from one tag's axes to another's, small: half the sum of the crosses of their axes.
static vec3 turn_between(const struct tag_place *from, const struct tag_place *to)
{
    vec3 from_z = vec3_cross(from->x_axis, from->y_axis), to_z = vec3_cross(to->x_axis, to->y_axis);
    vec3 sum = vec3_add(vec3_cross(from->x_axis, to->x_axis), vec3_cross(from->y_axis, to->y_axis));
    return vec3_scale(vec3_add(sum, vec3_cross(from_z, to_z)), 0.5);
}

static void known_place(struct place_term *t, const struct bundle *b, int place)
{
    const struct tag_place *given = b->given + place;
    vec3 turn = turn_between(b->capture->tag + place, given);
    memcpy(t->expected, &turn, sizeof turn);
    memcpy(t->expected + 3, &given->center, sizeof given->center);
    for (int k = 0; k < PLACE; k++)  // both ends of an edge are measured: that is the turn's sigma
        t->sigma[k] = k < 3 ? b->place_sigma * sqrt(2) / given->size : b->place_sigma;
}

static struct ceres_term *add_term(struct workspace *w, ceres_evaluate evaluate,
                                   const void *context, int residuals, double cauchy)
{
    struct ceres_term *term = w->ceres + w->problem.terms++;
    *term = (struct ceres_term){.evaluate = evaluate,
                                .context = context,
                                .residuals = residuals,
                                .parameters = 1,
                                .cauchy = cauchy};
    return term;
}

static void add_knowledge(struct workspace *w, const struct bundle *b, double cauchy)
{
    const struct calibration *c = b->calibration;
    for (int i = 0; b->prior && i < c->cameras; i++) {
        w->lens[i].prior = b->prior + i;
        add_term(w, evaluate_lens, w->lens + i, LENS_PARAMETERS, 0)->parameter[0] = i;
        if (b->prior[i].sigma_square > 0)
            add_term(w, evaluate_square, w->lens + i, 1, 0)->parameter[0] = i;
    }
    for (int i = 0; i < b->capture->tags; i++) {
        if (w->place_held[i][0] || b->given[i].unplaced)
            continue;
        known_place(w->known + i, b, i);
        add_term(w, evaluate_place, w->known + i, PLACE, cauchy)->parameter[0] =
            c->cameras + c->views + i;
    }
}

enum status workspace_terms(struct workspace *w, const struct bundle *b, double scale,
                            double cauchy, struct error *err)
{
    const struct calibration *c = b->calibration;
    enum status status = STATUS_OK;
    w->problem.term = w->ceres;
    w->problem.terms = 0;
    for (int i = 0; i < b->sightings && !status; i++) {
        const struct sighting *s = b->sighting + i;
        if (s->rejected || !bundle_placed(b->capture->tag + s->place))
            continue;
        struct term *t = w->term + w->problem.terms;
        status = tag_term(t, b, s, scale, err);
        struct ceres_term *term = add_term(w, evaluate_tag, t, TAG_NUMBERS, cauchy);
        term->parameters = PARTS;
        term->parameter[BY_CAMERA] = c->view[s->view].camera;
        term->parameter[BY_POSE] = c->cameras + s->view;
        term->parameter[BY_PLACE] = c->cameras + c->views + s->place;
    }
    if (!status)
        add_knowledge(w, b, cauchy);
    return status;
}

// ---- the result

void workspace_take(const struct bundle *b, const struct workspace *w)
{
    struct calibration *c = b->calibration;
    for (int i = 0; i < c->cameras; i++)
        lens_from_array(c->camera + i, w->camera[i]);
    for (int i = 0; i < c->views; i++)
        memcpy(&c->view[i].view_from_world, w->pose[i], sizeof w->pose[i]);
    for (int i = 0; i < b->capture->tags; i++) {
        if (w->place_held[i][0])
            continue;
        struct tag_place *tag = b->capture->tag + i;
        mat3 turn = cal_rotation(vec3_of(w->place[i]));
        tag->center = vec3_of(w->place[i] + 3);
        tag->x_axis = vec3_normalize(mat3_mul(&turn, w->start[i].x_axis));
        tag->y_axis = mat3_mul(&turn, w->start[i].y_axis);
        double slant = vec3_dot(tag->x_axis, tag->y_axis);  // of rounding
        tag->y_axis = vec3_normalize(vec3_sub(tag->y_axis, vec3_scale(tag->x_axis, slant)));
    }
}
