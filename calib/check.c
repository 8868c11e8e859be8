/* check.c -- does a calibration still hold? New photographs tell, with its intrinsics held.
 *
 * Method.   The poses are found with the lens as the calibration has it, and, where three views or
 *           more allow it, with a lens of the photographs' own. What the held lens leaves
 * unexplained beyond the free one is its error; where there is no free one, the calibration's own
 *           residual is the measure.
 */
#include "calib.h"

#include "intrinsics.h"

#include <stdlib.h>
#include <string.h>

const char *cal_verdict_text(enum verdict verdict)
{
    static const char *const text[] = {[VERDICT_HOLDS] = "holds",
                                       [VERDICT_DRIFTED] = "has drifted a little, and is usable",
                                       [VERDICT_WRONG] = "does not hold: calibrate anew"};
    return text[verdict];
}

// The capture with every camera held as a file says; what the board lacks is the calibration's.
static enum status hold(struct capture *held, struct camera_given *given, struct tag_place **board,
                        const struct capture *capture, const struct calibration *c,
                        const char *path, struct error *err)
{
    *held = *capture;
    held->camera = calloc((size_t)capture->cameras + 1, sizeof *held->camera);
    *board = calloc((size_t)c->tags + 1, sizeof **board);
    given->file = strdup(path);
    if (!held->camera || !*board || !given->file)
        return cap_fail(err, STATUS_MEMORY, "%d cameras", capture->cameras);
    memcpy(held->camera, capture->camera, (size_t)capture->cameras * sizeof *held->camera);
    for (int k = 0; k < held->cameras; k++)
        held->camera[k].given = 0;
    held->given = given;
    held->givens = 1;
    if (capture->family || !c->family)
        return STATUS_OK;
    for (int i = 0; i < c->tags; i++)
        (*board)[i] = c->tag[i].place;
    held->family = c->family;
    held->tag = *board;
    held->tags = c->tags;
    return STATUS_OK;
}

// How far apart two lenses put the same ray, at most over the image, px; less a common shift, which
// is a turn of the camera.
static double rays_apart(const struct camera *a, const struct camera *b)
{
    enum { N = 9 };
    double off[N * N][2], mean[2] = {0}, most = 0;
    for (int i = 0; i < N * N; i++) {
        const double pixel[2] = {(i % N) * (a->width - 1.0) / (N - 1),
                                 (i / N) * (a->height - 1.0) / (N - 1)};
        cal_project(b, cal_ray(a, pixel), off[i]);
        for (int k = 0; k < 2; k++) {
            off[i][k] -= pixel[k];
            mean[k] += off[i][k] / (N * N);
        }
    }
    for (int i = 0; i < N * N; i++)
        most = fmax(most, hypot(off[i][0] - mean[0], off[i][1] - mean[1]));
    return most;
}

// Rays that are this far apart show in nobody's pictures, and in everybody's.
static const double unseen_px = 0.1, visible_px = 1;

// Poses make up for much of a wrong lens, so that residuals alone tell little: whether the free
// lens fits significantly better says that something has changed (an F test of nine unknowns, half
// of a tag's numbers counting, for its corners err together), and the rays say how much.
static enum verdict judge(const struct camera_check *k, double usual_px)
{
    double limit = 1.25 * (k->free_px > 0 ? k->free_px : usual_px) + 0.02;
    if (!(k->free_px > 0))
        return k->held_px <= limit       ? VERDICT_HOLDS
               : k->held_px <= 4 * limit ? VERDICT_DRIFTED
                                         : VERDICT_WRONG;
    double ratio = k->held_px * k->held_px / (k->free_px * k->free_px);
    bool changed = (ratio - 1) * (4 * k->tags) / 9 > 6;
    return !changed || k->rays_px < unseen_px ? VERDICT_HOLDS
           : k->rays_px < visible_px          ? VERDICT_DRIFTED
                                              : VERDICT_WRONG;
}

static void compare(struct camera_check *check, const struct calibration *held, int camera,
                    const struct calibration *own, const struct calibration *file)
{
    const struct camera *m = held->camera + camera;
    const struct camera *free_one = intrinsics_match(own, m), *told = intrinsics_match(file, m);
    snprintf(check->name, sizeof check->name, "%s", m->name);
    check->held_px = m->rms_px;
    for (int v = 0; v < held->views; v++) {
        if (held->view[v].camera != camera)
            continue;
        check->shots++;
        check->tags += held->view[v].tags;
        if (held->view[v].rms_px > check->worst_px) {
            check->worst_px = held->view[v].rms_px;
            snprintf(check->worst, sizeof check->worst, "%s", held->view[v].name);
        }
    }
    if (free_one) {
        check->free_px = free_one->rms_px;
        check->focal_off = free_one->focal[0] / m->focal[0] - 1;
        check->sigma_focal = free_one->sigma_focal[0] / free_one->focal[0];
        check->rays_px = rays_apart(free_one, m);
    }
    check->verdict = judge(check, told ? told->rms_px : 0);
}

enum status cal_check(struct calibration *held, struct camera_check **check,
                      const struct capture *capture, const char *path, const char *out,
                      const bool *usable, struct run *run, struct error *err)
{
    struct calibration file = {0}, own = {0}, made = {0};
    struct capture fixed = {0};
    struct camera_given given = {0};
    struct tag_place *board = NULL;
    struct camera_check *checks = NULL;
    enum status status = cal_calibration_import(&file, path, err);
    if (!status)
        status = hold(&fixed, &given, &board, capture, &file, path, err);
    if (!status)
        status = cal_geometry(&made, &fixed, out, usable, run, err);
    if (!status && made.views >= 3) {
        struct error why = {0};  // without a lens of their own the photographs still tell something
        struct run silent = {.threads = run->threads, .quiet = true, .mute = true};
        fixed.givens = 0;
        if (cal_geometry(&own, &fixed, out, usable, &silent, &why))
            cap_warn(run, "no lens of the photographs' own to compare with: %s", why.text);
        cap_run_end(&silent);
    }
    if (!status && !(checks = calloc((size_t)made.cameras, sizeof *checks)))
        status = cap_fail(err, STATUS_MEMORY, "%d cameras", made.cameras);
    for (int i = 0; !status && i < made.cameras; i++)
        compare(checks + i, &made, i, &own, &file);
    if (!status) {
        *held = made;
        *check = checks;
        made = (struct calibration){0};
    }
    cal_calibration_free(&made);
    cal_calibration_free(&own);
    cal_calibration_free(&file);
    free(fixed.camera);
    free(given.file);
    free(board);
    return status;
}
