/* lamp_bounced.c -- lamps where the lit board shines on the sample, and the sample on the board.
 *
 * Method.   What light a facet has from others is predicted (board_light.c, sample_light.c) and
 *           taken out of it, then the lamps are fitted, and so on until they stay. The prediction
 *           rests on the sample's reflectance, known roughly where no camera looks, and of narrow
 *           lobes hardly at all: by what it is too large or too small, in each of ECHOES kinds, the
 *           fit finds together with the lamps (the facets' echo), for the sample's light on the
 *           board and for the board's on the sample apart. What is wrong beyond that is doubt.
 */
#include "board_light.h"
#include "cues.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

enum { BOUNCE_ROUNDS = 3 };
static const double PRECISE = 0.02;                  // rad
static const double DOUBT = 30;                      // of facets of a sample that may mislead
static const double EXTRA_MAX = 0.5, SETTLED = 0.3;  // sigmas that a lamp may still move
// What is left of a prediction when the fit has found its shares: of the board's light on the
// sample, matte and mirrored; of the sample's light on the board. It is alike all over an area of
// the sample, of which there are some ALIKE, and in all views: each facet there is as much less
// sure.
static const double MATTE_SIGMA = 0.01, GLOSS_SIGMA = 0.05, ECHO_SIGMA = 0.05, ALIKE = 25;

/** Radiance that comes to a facet of the sample by way of the board, in its kinds; all: with what
 * it may mirror at most. */
static void extra_on_sample(const struct facet *f, const struct calibration *c, double alike,
                            double extra[3], double all[3], double sigma[3], double echo[ECHOES][3])
{
    vec3 wo = vec3_normalize(vec3_sub(cal_eye(c->view[f->view].view_from_world), f->point));
    cal_bounce_kinds(c, f->view, f->point, f->normal, wo, echo);
    for (int k = 0; k < 3; k++) {
        double mirrored = c->surroundings.mirror[k] * echo[ECHO_MIRROR + k][k] + echo[ECHO_RIM][k];
        double gloss = fmax(mirrored, echo[ECHO_GLOSS][k]);
        extra[k] = echo[ECHO_MATTE][k] + echo[ECHO_GLOSS][k];
        all[k] = echo[ECHO_MATTE][k] + gloss;
        sigma[k] = alike * hypot(MATTE_SIGMA * echo[ECHO_MATTE][k], GLOSS_SIGMA * gloss);
    }
}

/** Radiance that comes to a facet of the board by way of the sample, in its kinds. */
static void extra_on_board(const struct facet *f, const struct calibration *c,
                           const struct returns *returns, const struct capture *capture,
                           double extra[3], double all[3], double sigma[3], double echo[ECHOES][3])
{
    double mirror[3] = {0}, rim[3] = {0};
    cal_sample_light(c, returns, f->view, f->point, f->normal, echo);
    if (c->surroundings.peak_unknown)
        cal_mirror_light(c, returns, f->view, f->point, f->normal, mirror, rim);
    for (int k = 0; k < 3; k++) {
        double albedo = f->material == MATERIAL_PAPER
                            ? c->surroundings.paper[k]
                            : capture->patch[f->material - MATERIAL_PATCH].albedo;
        extra[k] = 0;
        for (int e = 0; e < ECHO_MIRROR; e++) {
            echo[e][k] *= albedo;
            extra[k] += echo[e][k];
        }
        echo[ECHO_MIRROR + k][k] = albedo * mirror[k];
        echo[ECHO_RIM][k] = albedo * rim[k];
        sigma[k] = ECHO_SIGMA * extra[k];
        all[k] = extra[k];
    }
}

/** Take from a facet what does not come from the lamp itself. A facet that owes most of its
 *  radiance to others says nothing (sigma huge). */
static void correct_facet(struct facet *f, const struct calibration *c,
                          const struct returns *returns, const struct capture *capture,
                          double alike)
{
    const struct view *view = &c->view[f->view];
    vec3 at = cal_lamp_position(&c->lamp[view->light], view->view_from_world);
    if (!f->bright || vec3_dot(vec3_sub(at, f->point), f->normal) <= 0)
        return;  // not lit: no use
    double extra[3], all[3], sigma[3], echo[ECHOES][3] = {{0}};
    if (f->material == MATERIAL_SAMPLE)
        extra_on_sample(f, c, alike, extra, all, sigma, echo);
    else
        extra_on_board(f, c, returns, capture, extra, all, sigma, echo);
    for (int k = 0; k < 3; k++) {
        double seen = exp(f->log_seen[k]), part = extra[k] / seen;
        if (fmax(part, all[k] / seen) > EXTRA_MAX) {
            f->doubt[k] = 1e3;
            for (int e = 0; e < ECHOES; e++)
                f->echo[e][k] = 0;
            continue;
        }
        f->log_value[k] = f->log_seen[k] + log1p(-part);
        f->sigma[k] = f->sigma_seen[k] / (1 - part);
        f->doubt[k] = sigma[k] / seen / (1 - part);
        for (int e = 0; e < ECHOES; e++)
            f->echo[e][k] = echo[e][k] / seen / (1 - part);
    }
}

/** The largest move of a lamp since `before` [lamps], in its sigmas. */
static double lamps_moved(const struct calibration *c, const vec3 *before)
{
    double most = 0;
    for (int l = 0; l < c->lamps; l++) {
        const double *s = c->lamp[l].sigma_position;
        double sigma = sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
        double moved = vec3_length(vec3_sub(c->lamp[l].position, before[l]));
        most = fmax(most, moved / fmax(sigma, 1e-9));
    }
    return most;
}

/** Facets that are corrected begin as they were seen. */
static void forget_corrections(struct facets *facets)
{
    for (int i = 0; i < facets->count; i++)
        for (int k = 0; k < 3; k++) {
            facets->facet[i].log_value[k] = facets->facet[i].log_seen[k];
            facets->facet[i].sigma[k] = facets->facet[i].sigma_seen[k];
            facets->facet[i].doubt[k] = 0;
            for (int e = 0; e < ECHOES; e++)
                facets->facet[i].echo[e][k] = 0;
        }
}

/** Take out of all facets what light the present calibration predicts. */
static enum status correct_all(const struct calibration *c, const struct capture *capture,
                               struct facets *board, struct facets *sample, struct run *run,
                               struct error *err)
{
    struct returns returns = {0};
    const double alike = sqrt(fmax(sample->count / ALIKE, 1));
    enum status status = cal_returns(&returns, c, run, err);
    if (status)
        return status;
#pragma omp parallel for schedule(dynamic, 16) num_threads(run->threads)
    for (int i = 0; i < board->count + sample->count; i++)
        correct_facet(i < board->count ? &board->facet[i] : &sample->facet[i - board->count], c,
                      &returns, capture, alike);
    cal_returns_free(&returns);
    return STATUS_OK;
}

/** Where the sample shines like a mirror, its highlight tells the lamp's direction better than the
 *  board, on which it throws light: begin there. */
static enum status start_from_highlight(struct calibration *c, int l,
                                        const struct seen_highlight *highlight, struct error *err)
{
    struct lamp *lamp = &c->lamp[l];
    enum status status = cal_highlight_cue(c, l, highlight, err);
    const struct lamp_cue *cue = &lamp->cue[CUE_HIGHLIGHT], *joint = &lamp->cue[CUE_JOINT];
    if (!status && cue->sigma > 0 && cue->sigma < PRECISE && joint->distance > 0) {
        vec3 from = vec3_sub(lamp->position, vec3_scale(joint->direction, joint->distance));
        lamp->position = vec3_add(from, vec3_scale(cue->direction, joint->distance));
    }
    return status;
}

/** Where the night side is dark there is no such light; where no night side is seen, there is none
 *  if all fits better so. */
enum status cal_lamp_fit_bounced(struct calibration *c, const struct capture *capture,
                                 struct facets *board, struct facets *sample,
                                 const struct seen_highlight *highlight, double doubt,
                                 const struct board_survey *survey, struct sample_shift *shift,
                                 struct run *run, struct error *err)
{
    const struct lamp_evidence evidence = {board, sample, highlight, doubt};
    const struct lamp_evidence first = {board, sample, highlight, DOUBT};
    vec3 *before = calloc((size_t)c->lamps, sizeof *before);
    enum status status = before ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%d lamps", c->lamps);
    forget_corrections(board);
    forget_corrections(sample);
    c->surroundings.peak_unknown = false;
    for (int v = 0; v < c->views; v++)
        c->surroundings.peak_unknown =
            c->surroundings.peak_unknown
            || (highlight[v].sigma > 0 && (highlight[v].saturated || highlight[v].small));
    for (int l = 0; l < c->lamps && !status; l++)
        status = start_from_highlight(c, l, highlight, err);
    for (int k = 0; k < 3; k++)
        c->surroundings.mirror[k] = 1;
    const bool doubted = c->surroundings.peak_unknown && doubt < DOUBT;
    if (!status)  // a sample that may show more of the board than of the lamp misleads at first
        status = cal_lamp_fit(c, capture, doubted ? &first : &evidence, true, shift, err);
    double moved = DBL_MAX;
    for (int round = 0; round < BOUNCE_ROUNDS && moved > SETTLED && !status; round++) {
        status = cal_board_light(c, survey, run, err);
        if (!status)
            status = cal_board_light_strength(c, sample, run, err);
        if (!status && c->surroundings.strength == 0 && doubted)
            status = cal_lamp_fit(c, capture, &evidence, true, shift, err);
        if (status || c->surroundings.strength == 0)
            break;
        status = correct_all(c, capture, board, sample, run, err);
        if (status)
            break;
        for (int l = 0; l < c->lamps; l++)
            before[l] = c->lamp[l].position;
        const double direct = shift->misfit;
        status = cal_lamp_fit(c, capture, &evidence, true, shift, err);
        moved = lamps_moved(c, before);
        if (!status && round == 0 && !c->surroundings.told && shift->misfit > direct) {
            c->surroundings.strength = 0;
            forget_corrections(board);
            forget_corrections(sample);
            status = cal_lamp_fit(c, capture, &evidence, true, shift, err);
            break;
        }
    }
    free(before);
    return status;
}
