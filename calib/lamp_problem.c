/* lamp_problem.c -- what takes part in the fit of lamps, by what it is weighted, what is unknown.
 *
 * Method.   Facets whose way to the lamp the sample blocks, or that see it too flat, are left out.
 *           Priors are so weak that they matter only where nothing else tells.
 */
#include "lamp_problem.h"

#include "beam_model.h"
#include "lamp_scale.h"

#include <stdlib.h>
#include <string.h>

static const double FLOOR_BOARD = 0.003;  // paper and patch are even to this, to begin with
const double lamp_floor_sample = 0.01;    // and any sample, with its lobe, to this
static const double OUTLIER = 3;          // scale of Cauchy's loss, in sigma
static const double COS_MIN = 0.17;       // 80 degrees: beyond it, a facet is too flat
static const double SHADOW_MM = 3;
static const double CLEAR =
    0.01;  // of a mesh's radius: a way to the lamp begins above its own facet
static const double VIGNETTING_PRIOR = 0.3;
static const double POWER_PRIOR = 0.5;  // of ln k: a lamp does not double its light between shots
// Of a lamp's numbers, so weak that it matters only where nothing else tells: a flat board under a
// lamp at infinity is lit alike from everywhere.
static const double PLACE_PRIOR[3] = {1, 1, 10};
// Of light between board and sample, in its kinds, beside the strength of all such light. Of the
// gloss there may be none: renderers leave out what it throws onto the board (caustics). A mirror's
// reflectance is anything up to 1, where its highlight is not measured.
static const double ECHO_PRIOR[ECHOES] = {0.05, 1, 1, 0.5, 0.5, 0.5, 1};
static const double NO_MIRROR = 1e-6;
// Of a beam: an axis that points past the scene, and any exponent.
static const double BEAM_PRIOR[BEAM_NUMBERS] = {1, 1, 20};

/* ---- which facets take part ---------------------------------------------------------------------
 */

/** ln of the mean of a lamp's light over a facet of the board, over what falls on its middle. The
 *  lamp is known well enough for that after the first round. */
static double log_bend(const struct facet *f, const struct lamp *lamp, pose view_from_world)
{
    double sum = 0, falloff;
    vec3 wi = cal_lamp_way(lamp, view_from_world, f->point, &falloff);
    const double middle = vec3_dot(wi, f->normal) * falloff;
    for (int k = 0; k < 4;
         k++) {  // a quarter each, sqrt(2) sigmas out: they have the spread's covariance
        vec3 out = vec3_scale(f->spread[k / 2], k % 2 ? sqrt(2) : -sqrt(2));
        wi = cal_lamp_way(lamp, view_from_world, vec3_add(f->point, out), &falloff);
        sum += 0.25 * fmax(vec3_dot(wi, f->normal), 0) * falloff;
    }
    return sum > 0 ? log(sum / middle) : 0;
}

/** Fill an observation; false: the facet sees the lamp or the camera too flat, or not at all. */
static bool observe(struct observation *o, const struct facet *f, const struct lamp_state *s,
                    const struct calibration *c, const struct capture *capture)
{
    const struct view *view = &c->view[f->view];
    const struct lamp *lamp = &c->lamp[view->light];
    const struct camera *camera = &c->camera[view->camera];
    vec3 eye = cal_eye(view->view_from_world);
    vec3 at = cal_lamp_position(lamp, view->view_from_world);
    double unused;
    vec3 to_lamp = cal_lamp_way(lamp, view->view_from_world, f->point, &unused);
    vec3 to_eye = vec3_normalize(vec3_sub(eye, f->point));
    bool board = f->material != MATERIAL_SAMPLE;
    if (!f->bright || vec3_dot(to_lamp, f->normal) < (board ? 0.05 : COS_MIN)
        || vec3_dot(to_eye, f->normal) < (board ? 0.05 : COS_MIN))
        return false;
    if (board ? cal_in_the_way(c, f->point, at, SHADOW_MM)
              : cal_ball_between(c, f->point, at, SHADOW_MM))
        return false;
    if (!board && c->sample.shape == SHAPE_MESH) {  // its own shadow
        vec3 above = vec3_add(f->point, vec3_scale(f->normal, CLEAR * c->sample.radius));
        if (cal_sample_between(&c->sample, above, at, 0))
            return false;
    }
    double dx = f->pixel[0] - camera->center[0], dy = f->pixel[1] - camera->center[1];
    *o = (struct observation){
        .facet = f,
        .chart = &s->chart[view->light],
        .point = cal_lamp_frame(lamp, view->view_from_world, f->point),
        .normal = cal_lamp_frame_direction(lamp, view->view_from_world, f->normal),
        .to_eye = cal_lamp_frame_direction(lamp, view->view_from_world, to_eye),
        .radius = c->sample.radius,
        .q = (dx * dx + dy * dy) * 4
             / ((double)camera->width * camera->width + (double)camera->height * camera->height),
        .view = f->view,
        .kind = !board                          ? KIND_SAMPLE
                : f->material == MATERIAL_PAPER ? KIND_PAPER
                                                : KIND_PATCH,
    };
    for (int k = 0; k < 3; k++)
        o->axis[k] =
            cal_lamp_frame_direction(lamp, view->view_from_world, (vec3){k == 0, k == 1, k == 2});
    if (board)
        o->log_bend = log_bend(f, lamp, view->view_from_world);
    if (o->kind == KIND_PATCH)
        o->log_f = log(capture->patch[f->material - MATERIAL_PATCH].albedo / CAP_PI);
    for (int k = 0; k < 3; k++) {
        // Noise is known; what else a facet may stray by is scaled to what it does.
        double noise = f->noise[k] / f->mean[k], floor = board ? FLOOR_BOARD : lamp_floor_sample;
        double model = hypot(sqrt(fmax(f->sigma[k] * f->sigma[k] - noise * noise, 0)), floor);
        o->sigma[k] = hypot(noise, s->scale[o->kind] * model) * (board ? 1 : s->doubt);
        o->sigma[k] = hypot(o->sigma[k], f->doubt[k]);
    }
    return true;
}

/* ---- the problem --------------------------------------------------------------------------------
 */

static void add_parameters(struct lamp_problem *p, struct lamp_state *s,
                           const struct calibration *c, bool has_flat, bool has_sample)
{
    static const bool distance_held[3] = {false, false, true};
    static const double beam_low[BEAM_NUMBERS] = {-3, -3, 1e-3}, beam_high[] = {3, 3, 100};
    static const double nearest[3] = {-10, -10, 0}, farthest[3] = {10, 10, 100};  // w >= 0
    bool *hold = p->held;
    int n = 0;
    for (int l = 0; l < c->lamps; l++)
        p->parameter[n++] = (struct ceres_parameter){.value = s->place[l],
                                                     .size = 3,
                                                     .held = s->far[l] ? distance_held : NULL,
                                                     .low = s->far[l] ? NULL : nearest,
                                                     .high = s->far[l] ? NULL : farthest};
    p->at_intensity = n;
    for (int l = 0; l < c->lamps; l++)
        p->parameter[n++] = (struct ceres_parameter){.value = s->log_e[l], .size = 3};
    p->at_power = n;
    for (int v = 0; v < c->views; v++) {
        bool first = true;
        for (int w = 0; w < v; w++)
            first = first && c->view[w].light != c->view[v].light;
        p->parameter[n++] = (struct ceres_parameter){
            .value = &s->log_power[v], .size = 1, .held = first ? hold : NULL, .eliminate = !first};
    }
    p->at_vignetting = n;
    for (int k = 0; k < c->cameras; k++)
        p->parameter[n++] = (struct ceres_parameter){
            .value = s->vignetting[k], .size = 2, .held = has_flat ? hold : NULL};
    p->at_paper = n;
    p->parameter[n++] = (struct ceres_parameter){.value = s->log_paper, .size = 3};
    p->at_lobe = n;
    p->parameter[n++] = (struct ceres_parameter){
        .value = s->lobe, .size = LOBE_SIZE, .held = has_sample ? NULL : hold};
    p->at_echo = n;
    p->parameter[n++] = (struct ceres_parameter){
        .value = s->echo, .size = ECHOES, .held = c->surroundings.strength > 0 ? NULL : hold};
    p->at_lit = n;
    p->parameter[n++] =
        (struct ceres_parameter){.value = s->lit,
                                 .size = ECHOES,
                                 .held = has_sample && c->surroundings.strength > 0 ? NULL : hold};
    p->at_strength = n;
    for (int l = 0; l < c->lamps; l++) {
        const struct lamp_strength *known = &c->lamp[l].known;
        p->parameter[n++] =
            (struct ceres_parameter){.value = s->strength[l],
                                     .size = 3,
                                     .held = known->sigma_all > 0 && known->of == l ? NULL : hold};
    }
    p->at_still = n;
    p->parameter[n++] = (struct ceres_parameter){.value = s->still, .size = SHIFTS, .held = hold};
    p->at_beam = n;
    for (int l = 0; l < c->lamps; l++) {
        bool free = s->beams_free && s->beam[l][2] != 0 && !s->far[l];
        p->parameter[n++] = (struct ceres_parameter){.value = s->beam[l],
                                                     .size = BEAM_NUMBERS,
                                                     .held = free ? NULL : hold,
                                                     .low = free ? beam_low : NULL,
                                                     .high = free ? beam_high : NULL};
    }
    p->at_shift = n;
    p->parameter[n++] = (struct ceres_parameter){
        .value = s->shift,
        .size = SHIFTS,
        .held = has_sample && c->sample.shape == SHAPE_SPHERE ? NULL : hold};
    p->parameters = n;
}

static void add_term(struct lamp_problem *p, ceres_evaluate evaluate, int residuals, double loss,
                     int blocks, const int *block)
{
    struct ceres_term *t = &p->term[p->terms];
    *t = (struct ceres_term){.evaluate = evaluate,
                             .context = &p->observation[p->terms],
                             .residuals = residuals,
                             .parameters = blocks,
                             .cauchy = loss};
    memcpy(t->parameter, block, (size_t)blocks * sizeof *block);
    p->terms++;
}

static void add_facet(struct lamp_problem *p, const struct facet *f, const struct lamp_state *s,
                      const struct calibration *c, const struct capture *capture)
{
    struct observation *o = &p->observation[p->terms];
    if (!observe(o, f, s, c, capture))
        return;
    const struct view *view = &c->view[f->view];
    int block[CERES_TERM_PARAMETERS] = {view->light, p->at_intensity + view->light,
                                        p->at_power + f->view, p->at_vignetting + view->camera};
    int blocks = 4;
    if (o->kind == KIND_SAMPLE)
        block[blocks++] = p->at_lobe;
    if (o->kind == KIND_PAPER)
        block[blocks++] = p->at_paper;
    if (o->kind == KIND_SAMPLE)
        block[blocks++] = p->at_shift;
    block[blocks++] = o->kind == KIND_SAMPLE ? p->at_lit : p->at_echo;
    block[blocks++] = p->at_beam + view->light;
    add_term(p, cal_lamp_evaluate, 3, OUTLIER, blocks, block);
}

/** What a sphere, the sample or a ball, mirrors of the lamp in a view. at_shift: by how much it is
 *  moved. */
static void add_highlight(struct lamp_problem *p, const struct seen_highlight *h, int v,
                          const struct sample *sphere, int at_shift, const struct lamp_state *s,
                          const struct calibration *c)
{
    const struct view *view = &c->view[v];
    const struct lamp *lamp = &c->lamp[view->light];
    const pose at = view->view_from_world;
    struct observation *o = &p->observation[p->terms];
    if (h->sigma <= 0)
        return;
    vec3 normal = vec3_scale(vec3_sub(h->point, sphere->center), 1 / sphere->radius);
    *o = (struct observation){.kind = KIND_HIGHLIGHT,
                              .chart = &s->chart[view->light],
                              .point = cal_lamp_frame(lamp, at, h->point),
                              .normal = cal_lamp_frame_direction(lamp, at, normal),
                              .to_eye = cal_lamp_frame_direction(lamp, at, h->to_eye),
                              .wi = cal_lamp_frame_direction(lamp, at, h->wi),
                              .radius = sphere->radius,
                              .sigma = {h->sigma},
                              .view = v};
    for (int k = 0; k < 3; k++)
        o->axis[k] = cal_lamp_frame_direction(lamp, at, (vec3){k == 0, k == 1, k == 2});
    const int block[2] = {view->light, at_shift};
    add_term(p, cal_lamp_evaluate_highlight, 2, OUTLIER, 2, block);
}

/** Lamps that another capture knows, and a sample whose albedo is known. */
static void add_scale(struct lamp_problem *p, const struct lamp_state *s,
                      const struct calibration *c, const struct capture *capture)
{
    for (int l = 0; l < c->lamps; l++) {
        const struct lamp_strength *known = &c->lamp[l].known;
        const int block[3] = {l, p->at_intensity + l, p->at_strength + known->of};
        if (known->sigma_all <= 0)
            continue;
        p->observation[p->terms] = (struct observation){
            .kind = KIND_STRENGTH, .known = known, .log_power = log(lamp_mean_power(s, c, l))};
        add_term(p, cal_lamp_evaluate_strength, 3, 0, 3, block);
        if (known->of != l)
            continue;
        p->observation[p->terms] =
            (struct observation){.kind = KIND_STRENGTH_PRIOR, .known = known};
        add_term(p, cal_lamp_evaluate_strength_prior, 3, 0, 1, &block[2]);
    }
    if (capture->sample_albedo > 0 && !p->parameter[p->at_lobe].held) {
        p->observation[p->terms] = (struct observation){
            .kind = KIND_ALBEDO_PRIOR, .log_f = log(capture->sample_albedo / CAP_PI)};
        add_term(p, cal_lamp_evaluate_albedo_prior, 3, 0, 1, &p->at_lobe);
    }
}

/** Paper that no facet shows has no reflectance to find; and where nothing else gives a scale, as
 *  yet, it is held. */
static void hold_paper(struct lamp_problem *p)
{
    bool seen = false, scaled = false;
    for (int t = 0; t < p->terms; t++) {
        int kind = p->observation[t].kind;
        seen = seen || kind == KIND_PAPER;
        scaled = scaled || kind == KIND_PATCH || kind == KIND_STRENGTH || kind == KIND_ALBEDO_PRIOR;
    }
    if (!seen || !scaled)
        p->parameter[p->at_paper].held = p->held;
}

static void add_priors(struct lamp_problem *p, const struct calibration *c)
{
    for (int l = 0; l < c->lamps; l++) {
        struct observation *o = &p->observation[p->terms];
        *o = (struct observation){.kind = KIND_PLACE_PRIOR};
        memcpy(o->sigma, PLACE_PRIOR, sizeof PLACE_PRIOR);
        add_term(p, cal_lamp_evaluate_zero_prior, 3, 0, 1, &l);
    }
    for (int l = 0; l < c->lamps; l++) {
        const int block = p->at_beam + l;
        struct observation *o = &p->observation[p->terms];
        if (p->parameter[block].held)
            continue;
        *o = (struct observation){.kind = KIND_BEAM_PRIOR};
        memcpy(o->sigma, BEAM_PRIOR, sizeof BEAM_PRIOR);
        add_term(p, cal_lamp_evaluate_zero_prior, BEAM_NUMBERS, 0, 1, &block);
    }
    if (!p->parameter[p->at_lobe].held)
        add_term(p, cal_lamp_evaluate_lobe_prior, LOBE_PRIORS, 0, 1, &p->at_lobe);
    if (!p->parameter[p->at_shift].held) {
        struct observation *o = &p->observation[p->terms];
        *o = (struct observation){.kind = KIND_SHAPE_PRIOR};
        for (int k = 0; k < SHIFTS; k++)
            o->sigma[k] = fmax(k < 3 ? c->sample.sigma_center[k] : c->sample.sigma_radius, 1e-6);
        add_term(p, cal_lamp_evaluate_zero_prior, SHIFTS, 0, 1, &p->at_shift);
    }
    for (int k = 0; k < 2; k++) {
        const int block = k ? p->at_lit : p->at_echo;
        if (p->parameter[block].held)
            continue;
        p->observation[p->terms] = (struct observation){.kind = KIND_ECHO_PRIOR};
        double *sigma = p->observation[p->terms].sigma;
        for (int e = 0; e < ECHOES; e++)
            sigma[e] = e >= ECHO_MIRROR && !c->surroundings.peak_unknown
                           ? NO_MIRROR
                           : hypot(ECHO_PRIOR[e], c->surroundings.sigma_strength);
        add_term(p, cal_lamp_evaluate_zero_prior, ECHOES, 0, 1, &block);
    }
    for (int k = 0; k < c->cameras && !p->parameter[p->at_vignetting].held; k++) {
        int block = p->at_vignetting + k;
        p->observation[p->terms] = (struct observation){
            .kind = KIND_VIGNETTING_PRIOR, .sigma = {VIGNETTING_PRIOR, VIGNETTING_PRIOR}};
        add_term(p, cal_lamp_evaluate_zero_prior, 2, 0, 1, &block);
    }
    for (int v = 0; v < c->views; v++) {
        int block = p->at_power + v;
        p->observation[p->terms] =
            (struct observation){.kind = KIND_POWER_PRIOR, .sigma = {POWER_PRIOR}, .view = v};
        if (!p->parameter[block].held)
            add_term(p, cal_lamp_evaluate_zero_prior, 1, 0, 1, &block);
    }
}

enum status lamp_problem_make(struct lamp_problem *p, struct lamp_state *s,
                              const struct calibration *c, const struct capture *capture,
                              const struct lamp_evidence *e, struct error *err)
{
    const struct facets none = {0}, *board = e->board ? e->board : &none;
    const struct facets *sample = e->sample ? e->sample : &none;
    size_t terms = (size_t)(board->count + sample->count + (2 + c->balls) * c->views + c->cameras
                            + 4 * c->lamps + 5);
    size_t blocks = (size_t)(4 * c->lamps + c->views + c->cameras + 6);
    *p = (struct lamp_problem){.observation = calloc(terms, sizeof *p->observation),
                               .term = calloc(terms, sizeof *p->term),
                               .parameter = calloc(blocks, sizeof *p->parameter),
                               .held = calloc(LOBE_SIZE, sizeof *p->held)};
    if (!p->observation || !p->term || !p->parameter || !p->held) {
        lamp_problem_free(p);
        return cap_fail(err, STATUS_MEMORY, "%zu photometric observations", terms);
    }
    memset(p->held, true, LOBE_SIZE * sizeof *p->held);
    add_parameters(p, s, c, capture->flat != NULL, sample->count > 0);
    for (int i = 0; i < board->count; i++)
        add_facet(p, &board->facet[i], s, c, capture);
    for (int i = 0; i < sample->count; i++)
        add_facet(p, &sample->facet[i], s, c, capture);
    for (int v = 0; e->highlight && v < c->views; v++)
        add_highlight(p, &e->highlight[v], v, &c->sample, p->at_shift, s, c);
    for (int i = 0; e->highlight && i < c->balls * c->views; i++)
        add_highlight(p, &e->highlight[c->views + i], i % c->views, &c->ball[i / c->views],
                      p->at_still, s, c);
    add_scale(p, s, c, capture);
    hold_paper(p);
    add_priors(p, c);
    return STATUS_OK;
}

void lamp_problem_free(struct lamp_problem *p)
{
    free(p->observation);
    free(p->term);
    free(p->parameter);
    free(p->held);
    *p = (struct lamp_problem){0};
}
