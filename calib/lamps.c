/* lamps.c -- all lamps of a merged capture: collect facets, start, fit the board, fit everything.
 */
#include "balls.h"
#include "beam_model.h"
#include "cues.h"
#include "highlight.h"
#include "lamp.h"
#include "reference.h"
#include "shadow.h"
#include "view_map.h"

#include <stdlib.h>
#include <string.h>

static const double STRAY = 3;  // sigmas of the outline that light may move the sample by
// Of a sample's facets that mislead: by so much more at a time, up to where they have no say.
static const double DOUBT_STEP = 3, DOUBT = 30;
// Of a cylinder's: its turn is told by the outline alone, and what it is off by all of its facets
// share. With this lamps lie within their sigmas, with 1 they lie 3 of them off, with 30 a fifth.
static const double DOUBT_TURN = 5;
// A few thousand facets tell all there is to tell; more views need fewer of each.
enum { SAMPLE_FACETS = 6000, VIEW_FACETS_MAX = 600, VIEW_FACETS_MIN = 60 };

/** What all views are asked for. */
struct question {
    const struct calibration *c;
    const struct capture *capture;
    const char *out;
    bool sample;  // its facets and highlights; else the board's facets
    int wanted;   // facets of the sample a view
};

static enum status ask_board(struct facets *to, const struct radiance *map,
                             const struct question *q, int v, struct error *err)
{
    struct tag_family family = {0};
    enum status status = pattern_open(&family, q->capture->family, err);
    if (!status)
        status = cal_board_facets(to, map, q->c, v, q->capture, &family, err);
    pattern_close(&family);
    return status;
}

/** highlight: the view's, of [1 + balls][views]. */
static enum status ask_view(struct facets *to, struct seen_highlight *highlight,
                            const struct question *q, int v, struct error *err)
{
    struct radiance map = {0};
    struct seen_highlight h;
    enum status status = cal_view_map(&map, q->out, &q->c->view[v], err);
    if (!status && !q->sample) {
        status = ask_board(to, &map, q, v, err);
    } else if (!status) {
        status = cal_sample_facets(to, &map, q->c, v, q->wanted, err);
        if (!status && q->c->sample.shape == SHAPE_SPHERE
            && cal_highlight_lamp(&h, &map, q->c, &q->c->sample, v))
            *highlight = h;
        for (int i = 0; i < q->c->balls && !status; i++)
            if (cal_ball_highlight(&h, &map, q->c, i, v))
                highlight[(1 + i) * q->c->views] = h;
    }
    cap_radiance_free(&map);
    return status;
}

static enum status join(struct facets *all, const struct facets *one, struct error *err)
{
    int count = all->count + one->count;
    struct facet *grown = realloc(all->facet, (size_t)(count + 1) * sizeof *grown);
    if (!grown)
        return cap_fail(err, STATUS_MEMORY, "%d facets", count);
    if (one->count)
        memcpy(grown + all->count, one->facet, (size_t)one->count * sizeof *grown);
    *all = (struct facets){grown, count, count + 1};
    return STATUS_OK;
}

/** The facets of all views, in the order of views; highlight [1 + balls][views] too, where it is
 * asked for. */
static enum status ask_all(struct facets *all, struct seen_highlight *highlight,
                           const struct question *q, struct run *run, struct error *err)
{
    const int views = q->c->views;
    struct facets *of_view = calloc((size_t)views, sizeof *of_view);
    if (!of_view)
        return cap_fail(err, STATUS_MEMORY, "%d views", views);
    enum status status = STATUS_OK;
#pragma omp parallel for schedule(dynamic) num_threads(run->threads)
    for (int v = 0; v < views; v++) {
        struct error own = {0};
        enum status s = ask_view(&of_view[v], highlight ? &highlight[v] : NULL, q, v, &own);
        if (s) {
#pragma omp critical(lamps_error)
            status = cap_fail(err, s, "%s", own.text);
        }
        cap_step(run);
    }
    for (int v = 0; v < views; v++) {
        if (!status)
            status = join(all, &of_view[v], err);
        free(of_view[v].facet);
    }
    free(of_view);
    return status;
}

/** The facets of patches that a lamp lights, and its photographs. */
static int count_patches(const struct calibration *c, const struct facets *board, int lamp,
                         int *views)
{
    int patches = 0;
    *views = 0;
    for (int v = 0; v < c->views; v++)
        *views += c->view[v].light == lamp;
    for (int i = 0; i < board->count; i++)
        patches += c->view[board->facet[i].view].light == lamp
                   && board->facet[i].material >= MATERIAL_PATCH;
    return patches;
}

/** A patch tells how strong a lamp is. Where it does not see a patch, the paper does, and the
 *  sample, which another lamp lights too that sees one. */
static enum status check_patch(const struct calibration *c, const struct facets *board,
                               struct run *run, struct error *err)
{
    enum { HARDLY = 16 };
    bool any = false;
    for (int l = 0; l < c->lamps; l++) {
        int views, patches = count_patches(c, board, l, &views);
        any = any || patches > 0;
        if (views && patches < HARDLY)
            cap_warn(run,
                     "lamp %s: the white patch is %s in its %d photographs; its intensity "
                     "rests on %s",
                     c->lamp[l].name, patches ? "hardly lit and seen" : "never lit and seen", views,
                     patches ? "that" : "the paper, as the other lamps light it");
    }
    return any ? STATUS_OK
               : cap_fail(err, STATUS_DATA,
                          "the white patch is lit and visible in none of the photographs, so no "
                          "lamp's intensity can be told: lay it where a lamp lights it, and "
                          "check its place in capture.yaml");
}

/** One lamp for each light of the capture that has views; view->light becomes its index. */
static enum status name_lamps(struct calibration *c, const struct capture *capture,
                              struct error *err)
{
    c->lamp = calloc((size_t)capture->lights, sizeof *c->lamp);
    if (!c->lamp)
        return cap_fail(err, STATUS_MEMORY, "%d lamps", capture->lights);
    for (int light = 0; light < capture->lights; light++) {
        const struct light_place *place = &capture->light[light];
        bool used = false;
        for (int v = 0; v < c->views; v++)
            used = used || c->view[v].light == light;
        if (!used)
            continue;
        for (int v = 0; v < c->views; v++)
            if (c->view[v].light == light)
                c->view[v].light = c->lamps;
        struct lamp *lamp = &c->lamp[c->lamps++];
        *lamp = (struct lamp){.name = strdup(place->name),
                              .on_camera = place->on_camera,
                              .position = place->position,
                              .radius = place->radius};
        if (!lamp->name)
            return cap_fail(err, STATUS_MEMORY, "lamp %s", place->name);
    }
    return STATUS_OK;
}

static void move_sample(struct sample *s, const struct sample_shift *shift)
{
    s->center = vec3_add(s->center, (vec3){shift->by[0], shift->by[1], shift->by[2]});
    memcpy(s->sigma_center, shift->sigma, sizeof s->sigma_center);
    s->radius += shift->by[3];
    s->sigma_radius = s->sigma_radius > 0 ? shift->sigma[3] : 0;
}

/** First places of the lamps that nobody measured. */
static enum status start_lamps(struct calibration *c, const struct facets *board, struct run *run,
                               struct error *err)
{
    enum status status = STATUS_OK;
#pragma omp parallel for schedule(dynamic) num_threads(run->threads)
    for (int l = 0; l < c->lamps; l++) {
        struct error own = {0};
        enum status s = STATUS_OK;
        if (vec3_length(c->lamp[l].position) == 0)
            s = cal_lamp_start(c, l, board, &own);
        if (s) {
#pragma omp critical(lamps_error)
            status = cap_fail(err, s, "%s", own.text);
        }
    }
    return status;
}

enum status cal_lamps_begin(struct lamp_search *search, struct calibration *c,
                            const struct capture *capture, const char *out, struct run *run,
                            struct error *err)
{
    const struct question board = {.c = c, .capture = capture, .out = out};
    enum status status = name_lamps(c, capture, err);
    *search = (struct lamp_search){.capture = capture, .out = out};
    if (!status && capture->reference) {
        status = reference_strengths(c, capture, out, run, err);
        cap_stage(run, "lamps", c->views);
    } else if (!status && capture->patches == 0 && capture->sample_albedo <= 0)
        status = cap_fail(err, STATUS_DATA,
                          "%s: no `reference` in capture.yaml: without a patch of known albedo "
                          "reflectance has no scale",
                          capture->folder);
    if (!status)
        status = ask_all(&search->board, NULL, &board, run, err);
    if (!status && capture->patches)
        status = check_patch(c, &search->board, run, err);
    if (!status)
        status = start_lamps(c, &search->board, run, err);
    const struct lamp_evidence evidence = {.board = &search->board, .doubt = 1};
    return status ? status : cal_lamp_fit(c, capture, &evidence, false, NULL, err);
}

enum status cal_lamps_by_board(struct calibration *c, const struct capture *capture,
                               const char *out, struct run *run, struct error *err)
{
    struct lamp_search search = {0};
    enum status status = cal_lamps_begin(&search, c, capture, out, run, err);
    const struct lamp_evidence evidence = {.board = &search.board, .doubt = 1};
    if (!status)
        status = cal_lamp_fit(c, capture, &evidence, true, NULL, err);
    cal_lamp_search_free(&search);
    return status;
}

/** Does light move the sample away from its outline, by more than can be? Light that is understood
 *  moves it by no more than the outline's own error, however little light tells of its place. */
static bool misled(const struct sample *s, const struct sample_shift *shift)
{
    bool far = false;
    for (int a = 0; a < 3; a++)
        far = far || fabs(shift->by[a]) > STRAY * s->sigma_center[a];
    return far;
}

/** Board and sample together. Where light contradicts the outline, the sample's reflectance is what
 *  is not understood: then it is doubted, until light follows the outline. A cylinder's turn is
 *  known less well, and a mesh is known between its corners only by smooth normals. */
static enum status fit_together(struct lamp_search *search, struct calibration *c,
                                struct facets *sample, const struct seen_highlight *highlight,
                                struct sample_shift *shift, struct run *run, struct error *err)
{
    enum status status = STATUS_OK;
    double doubt = c->sample.shape == SHAPE_SPHERE     ? 1
                   : c->sample.shape == SHAPE_CYLINDER ? DOUBT_TURN
                                                       : DOUBT;
    for (bool again = true; again && !status;) {
        status = cal_lamp_fit_bounced(c, search->capture, &search->board, sample, highlight, doubt,
                                      &search->survey, shift, run, err);
        again = !status && doubt < DOUBT && c->sample.shape == SHAPE_SPHERE
                && misled(&c->sample, shift);
        doubt = fmin(doubt * DOUBT_STEP, DOUBT);
    }
    return status;
}

/** All that lights up: the fit, the sample in its place, and what each cue says. */
static enum status fit_all(struct lamp_search *search, struct calibration *c, struct facets *sample,
                           const struct seen_highlight *highlight, struct run *run,
                           struct error *err)
{
    const struct facets none = {0};
    const struct lamp_evidence board = {.board = &search->board, .highlight = NULL, .doubt = 1};
    struct sample_shift shift = {0};
    enum status status;
    if (sample->count)
        status = fit_together(search, c, sample, highlight, &shift, run, err);
    else  // too small or too dark a sample: the board alone says which lamps are far
        status = cal_lamp_fit(c, search->capture, &board, true, NULL, err);
    if (!status && sample->count && c->sample.shape == SHAPE_SPHERE)
        move_sample(&c->sample, &shift);
    return status ? status
                  : cal_cues(c, search->capture, &search->board,
                             c->sample.shape == SHAPE_SPHERE ? sample : &none, highlight, run, err);
}

/** Where board and sample disagree about a lamp, its light may fall off to the side: then all is
 *  fitted with that, and without it again where there turns out to be none. */
static enum status fit_beams(struct lamp_search *search, struct calibration *c,
                             struct facets *sample, const struct seen_highlight *highlight,
                             struct run *run, struct error *err)
{
    const struct sample before = c->sample;
    struct lamp *begun = malloc((size_t)(c->lamps + 1) * sizeof *begun);
    if (!begun)
        return cap_fail(err, STATUS_MEMORY, "%d lamps", c->lamps);
    memcpy(begun, c->lamp, (size_t)c->lamps * sizeof *begun);
    enum status status = fit_all(search, c, sample, highlight, run, err);
    bool suspected = false, found = true;
    for (int l = 0; l < c->lamps && !status && c->sample.shape == SHAPE_SPHERE; l++)
        if (beam_suspected(&c->lamp[l])) {
            suspected = true;
            beam_begin(&c->lamp[l]);
        }
    if (!status && suspected) {
        c->sample = before;
        status = fit_all(search, c, sample, highlight, run, err);
        for (int l = 0; l < c->lamps; l++) {
            if (beam_found(&c->lamp[l]))
                begun[l].beam = c->lamp[l].beam;
            else
                found = found && c->lamp[l].beam.exponent == 0;
        }
    }
    if (!status && !found) {
        c->sample = before;
        memcpy(c->lamp, begun, (size_t)c->lamps * sizeof *begun);
        status = fit_all(search, c, sample, highlight, run, err);
    }
    free(begun);
    return status;
}

enum status cal_lamps_end(struct lamp_search *search, struct calibration *c, struct run *run,
                          struct error *err)
{
    struct facets sample = {0};
    struct question question = {
        .c = c, .capture = search->capture, .out = search->out, .sample = true};
    question.wanted = SAMPLE_FACETS / c->views;
    question.wanted = question.wanted > VIEW_FACETS_MAX ? VIEW_FACETS_MAX : question.wanted;
    question.wanted = question.wanted < VIEW_FACETS_MIN ? VIEW_FACETS_MIN : question.wanted;
    struct seen_highlight *highlight =
        calloc((size_t)(c->views * (1 + c->balls)) + 1, sizeof *highlight);
    enum status status = highlight ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%d views", c->views);
    if (!status)
        status = ask_all(&sample, highlight, &question, run, err);
    if (!status && sample.count)
        status = cal_board_survey(&search->survey, c, search->capture, search->out, run, err);
    if (!status)
        status = fit_beams(search, c, &sample, highlight, run, err);
    if (!status)
        status = cal_shadow_cues(c, search->capture, search->out, run, err);
    free(sample.facet);
    free(highlight);
    return status;
}

void cal_lamp_search_free(struct lamp_search *search)
{
    free(search->board.facet);
    cal_board_survey_free(&search->survey);
    *search = (struct lamp_search){0};
}
