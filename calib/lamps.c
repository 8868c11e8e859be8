/* lamps.c -- all lamps of a merged capture: collect facets, start, fit the board, fit everything.
 */
#include "board_light.h"
#include "cues.h"
#include "highlight.h"
#include "lamp.h"
#include "view_map.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

// A few thousand facets tell all there is to tell; more views need fewer of each.
enum { BOUNCE_ROUNDS = 3 };
// Where the board is mirrored in the sample, cells and lobe are too coarse to say by how much: such
// facets count for little, and there are others.
static const double EXTRA_MAX = 0.5, MATTE_SIGMA = 0.1, GLOSS_SIGMA = 5;
static const double STRAY = 3;      // sigmas that board and sample may differ by
static const double DOUBT = 30;     // of a sample's facets that mislead
static const double SETTLED = 0.3;  // sigmas that a lamp may still move
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
            && cal_highlight_lamp(&h.wi, &h.point, &h.sigma, &map, q->c, v))
            *highlight = h;
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

/** The facets of all views, in the order of views; highlight [views] too, where it is asked for. */
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

static enum status check_patch(const struct calibration *c, const struct facets *board,
                               struct run *run, struct error *err)
{
    for (int l = 0; l < c->lamps; l++) {
        int patches = 0, views = 0;
        for (int v = 0; v < c->views; v++)
            views += c->view[v].light == l;
        for (int i = 0; i < board->count; i++)
            patches += c->view[board->facet[i].view].light == l
                       && board->facet[i].material >= MATERIAL_PATCH;
        if (views && !patches)
            return cap_fail(err, STATUS_DATA,
                            "lamp %s: the white patch is lit and visible in none of its %d "
                            "photographs, so its intensity cannot be told",
                            c->lamp[l].name, views);
        if (views && patches < 16)
            cap_warn(run,
                     "lamp %s: the white patch is hardly seen in its photographs; its "
                     "intensity rests on that",
                     c->lamp[l].name);
    }
    return STATUS_OK;
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

/** What comes to a facet by way of others: radiance for albedo 1 of board and patch, and how sure
 *  it is. */
static void extra_light(const struct facet *f, const struct calibration *c,
                        const double (*twice)[3], const struct capture *capture, double extra[3],
                        double sigma[3])
{
    vec3 eye = cal_eye(c->view[f->view].view_from_world);
    if (f->material == MATERIAL_SAMPLE) {
        double gloss[3];
        cal_bounce_parts(c, f->view, f->point, f->normal, vec3_normalize(vec3_sub(eye, f->point)),
                         extra, gloss);
        for (int k = 0; k < 3; k++) {
            sigma[k] = hypot(MATTE_SIGMA * extra[k], GLOSS_SIGMA * gloss[k]);
            extra[k] += gloss[k];
        }
        return;
    }
    double gloss[3];
    cal_sample_light(c, twice, f->view, f->point, f->normal, extra, gloss);
    for (int k = 0; k < 3; k++) {
        double albedo = f->material == MATERIAL_PAPER
                            ? c->surroundings.paper[k]
                            : capture->patch[f->material - MATERIAL_PATCH].albedo;
        // What the sample mirrors on the board comes from where the lobe is hardly known, grazing.
        sigma[k] = albedo * hypot(MATTE_SIGMA * extra[k], gloss[k]);
        extra[k] *= albedo;
    }
}

/** Take from a facet what does not come from the lamp itself. A facet that owes most of its
 *  radiance to others says nothing (sigma huge). */
static void correct_facet(struct facet *f, const struct calibration *c, const double (*twice)[3],
                          const struct capture *capture)
{
    const struct view *view = &c->view[f->view];
    vec3 at = cal_lamp_position(&c->lamp[view->light], view->view_from_world);
    if (!f->bright || vec3_dot(vec3_sub(at, f->point), f->normal) <= 0)
        return;  // not lit: no use
    double extra[3], sigma[3];
    extra_light(f, c, twice, capture, extra, sigma);
    for (int k = 0; k < 3; k++) {
        double seen = exp(f->log_seen[k]), part = extra[k] / seen;
        if (part > EXTRA_MAX) {
            f->sigma[k] = 1e3;
            continue;
        }
        f->log_value[k] = f->log_seen[k] + log1p(-part);
        f->sigma[k] = hypot(f->sigma_seen[k], sigma[k] / seen / (1 - part));
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
        }
}

/** Measure the light that goes between board and sample, take it out, and fit again, until the
 *  lamps stay where they are. Where the night side is dark there is none to take out; where no
 *  night side is seen, there is none if all fits better so. */
static enum status fit_without_bounces(struct calibration *c, const struct capture *capture,
                                       struct facets *board, struct facets *sample, double doubt,
                                       const char *out, struct sample_shift *shift, struct run *run,
                                       struct error *err)
{
    vec3 *before = calloc((size_t)c->lamps, sizeof *before);
    enum status status = before ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%d lamps", c->lamps);
    double moved = DBL_MAX;
    for (int round = 0; round < BOUNCE_ROUNDS && moved > SETTLED && !status; round++) {
        status = cal_board_light(c, capture, out, run, err);
        if (!status)
            status = cal_board_light_strength(c, sample, run, err);
        if (status || c->surroundings.strength == 0)
            break;
        double(*twice)[3] = NULL;
        status = cal_twice_bounced(&twice, c, run, err);
        if (status)
            break;
#pragma omp parallel for schedule(dynamic, 64) num_threads(run->threads)
        for (int i = 0; i < board->count + sample->count; i++)
            correct_facet(i < board->count ? &board->facet[i] : &sample->facet[i - board->count], c,
                          (const double(*)[3])twice, capture);
        free(twice);
        for (int l = 0; l < c->lamps; l++)
            before[l] = c->lamp[l].position;
        const double direct = shift->misfit;
        status = cal_lamp_fit(c, capture, board, sample, doubt, true, shift, err);
        moved = lamps_moved(c, before);
        if (!status && round == 0 && !cal_board_light_told(c) && shift->misfit > direct) {
            c->surroundings.strength = 0;
            forget_corrections(board);
            forget_corrections(sample);
            status = cal_lamp_fit(c, capture, board, sample, doubt, true, shift, err);
            break;
        }
    }
    free(before);
    return status;
}

static void move_sample(struct sample *s, const struct sample_shift *shift)
{
    s->center = vec3_add(s->center, (vec3){shift->by[0], shift->by[1], shift->by[2]});
    memcpy(s->sigma_center, shift->sigma, sizeof s->sigma_center);
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
    if (!status && capture->patches == 0)
        status = cap_fail(err, STATUS_DATA,
                          "%s: no `reference` in capture.yaml: without a patch of known albedo "
                          "reflectance has no scale",
                          capture->folder);
    if (!status)
        status = ask_all(&search->board, NULL, &board, run, err);
    if (!status)
        status = check_patch(c, &search->board, run, err);
    if (!status)
        status = start_lamps(c, &search->board, run, err);
    const struct facets none = {0};
    return status ? status : cal_lamp_fit(c, capture, &search->board, &none, 1, false, NULL, err);
}

/** Does light move the sample away from its outline, by more than can be? */
static bool misled(const struct calibration *c, const struct sample_shift *shift)
{
    bool far = false;
    for (int a = 0; a < 3; a++)
        far = far || fabs(shift->by[a]) > STRAY * hypot(c->sample.sigma_center[a], shift->sigma[a]);
    return far;
}

/** Board and sample together. Where light contradicts the outline, the sample's reflectance is what
 *  is not understood: then it is doubted. The shape of others than spheres is known less well. */
static enum status fit_together(struct lamp_search *search, struct calibration *c,
                                struct facets *sample, struct sample_shift *shift, struct run *run,
                                struct error *err)
{
    enum status status = STATUS_OK;
    double doubt = c->sample.shape == SHAPE_SPHERE ? 1 : DOUBT;
    for (bool again = true; again && !status;) {
        status = cal_lamp_fit(c, search->capture, &search->board, sample, doubt, true, shift, err);
        if (!status)
            status = fit_without_bounces(c, search->capture, &search->board, sample, doubt,
                                         search->out, shift, run, err);
        again = !status && doubt == 1 && misled(c, shift);
        if (again) {
            doubt = DOUBT;
            forget_corrections(&search->board);
            forget_corrections(sample);
        }
    }
    return status;
}

enum status cal_lamps_end(struct lamp_search *search, struct calibration *c, struct run *run,
                          struct error *err)
{
    struct facets sample = {0};
    const struct facets none = {0};
    struct sample_shift shift = {0};
    const struct capture *capture = search->capture;
    struct question question = {.c = c, .capture = capture, .out = search->out, .sample = true};
    question.wanted = SAMPLE_FACETS / c->views;
    question.wanted = question.wanted > VIEW_FACETS_MAX ? VIEW_FACETS_MAX : question.wanted;
    question.wanted = question.wanted < VIEW_FACETS_MIN ? VIEW_FACETS_MIN : question.wanted;
    struct seen_highlight *highlight = calloc((size_t)c->views + 1, sizeof *highlight);
    enum status status = highlight ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%d views", c->views);
    if (!status)
        status = ask_all(&sample, highlight, &question, run, err);
    if (!status && sample.count)
        status = fit_together(search, c, &sample, &shift, run, err);
    else if (!status)  // too small or too dark a sample: the board alone says which lamps are far
        status = cal_lamp_fit(c, capture, &search->board, &none, 1, true, NULL, err);
    if (!status && sample.count && c->sample.shape == SHAPE_SPHERE)
        move_sample(&c->sample, &shift);
    if (!status)
        status = cal_cues(c, capture, &search->board,
                          c->sample.shape == SHAPE_SPHERE ? &sample : &none, highlight, run, err);
    free(sample.facet);
    free(highlight);
    return status;
}

void cal_lamp_search_free(struct lamp_search *search)
{
    free(search->board.facet);
    *search = (struct lamp_search){0};
}
