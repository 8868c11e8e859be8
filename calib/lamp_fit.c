/* lamp_fit.c -- lamps, powers and vignetting from the light on board and sample.
 *
 * Method.   One least-squares problem in logarithms, over facets (photometry.h) and channels c:
 *
 *               ln L_c = ln I_c + ln k + ln f_c + ln(cos(theta_i) / r^2) + ln V(pixel)
 *
 *           with the lamp's place and intensities I_c, the view's power k, and for f the patch's
 *           albedo/pi (known), the paper's (unknown), or the sample's lobe (lobe.h: any isotropic
 *           reflectance). k of a lamp's first view is held; at the end powers get mean 1. Cauchy's
 *           loss takes shadows and stains out. Facets whose way to the lamp the sample blocks, or
 *           that see it too flat, are left out; since that needs the lamp, all is done twice.
 * Accuracy. The sandwich over views is used for sigmas (views share errors of pose and model),
 *           never below the formal ones.
 */
#include "ceres_shim.h"
#include "lamp.h"
#include "lobe.h"
#include "sandwich.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

static const double FLOOR_BOARD = 0.003;  // paper and patch are even to this
static const double FLOOR_SAMPLE = 0.01;  // and any sample, with its lobe, to this
static const double OUTLIER = 3;          // scale of Cauchy's loss, in sigma
static const double COS_MIN = 0.17;       // 80 degrees: beyond it, a facet is too flat
static const double SHADOW_MM = 3;
static const double VIGNETTING_PRIOR = 0.3;
static const double POWER_PRIOR = 0.5;  // of ln k: a lamp does not double its light between shots

/** One facet of the problem, or (facet NULL) a prior. */
struct observation {
    const struct facet *facet;
    vec3 point, normal, to_eye;  // in the lamp's frame
    double log_f;                // of a patch
    double q;                    // of vignetting
    double sigma[3];
    int view, kind;
};
enum {
    KIND_PATCH,
    KIND_PAPER,
    KIND_SAMPLE,
    KIND_LOBE_PRIOR,
    KIND_VIGNETTING_PRIOR,
    KIND_POWER_PRIOR
};

/** The unknowns. */
struct state {
    double (*place)[3], (*log_intensity)[3];  // [lamps]
    double *log_power;                        // [views]
    double log_paper[3], lobe[LOBE_SIZE];
    double (*vignetting)[2];  // [cameras]
};

/* ---- residuals --------------------------------------------------------------------------------
 */

/** ln(cos(theta_i)/r^2) at an observation for a lamp at p; by_p its gradient. */
static double log_geometry(const struct observation *o, vec3 p, double by_p[3])
{
    vec3 d = vec3_sub(p, o->point);
    double r2 = vec3_dot(d, d), up = vec3_dot(d, o->normal), least = 0.01 * sqrt(r2);
    bool flat = up < least;  // held there, so that a wild step costs and does not fail
    if (flat)
        up = least;
    vec3 n = flat ? vec3_scale(d, up / r2) : o->normal;
    vec3 g = vec3_sub(vec3_scale(n, 1 / up), vec3_scale(d, 3 / r2));
    by_p[0] = g.x;
    by_p[1] = g.y;
    by_p[2] = g.z;
    return log(up) - 1.5 * log(r2);
}

/** The sample's ln f for a lamp at p; derivative as in cal_lobe_log. */
static void log_sample(const struct observation *o, const double *lobe, vec3 p, double log_f[3],
                       double *derivative)
{
    vec3 wi = vec3_normalize(vec3_sub(p, o->point));
    vec3 h = vec3_normalize(vec3_add(wi, o->to_eye));
    double cos_i = fmax(vec3_dot(wi, o->normal), 0.01);
    double cos_o = fmax(vec3_dot(o->to_eye, o->normal), 0.01);
    cal_lobe_log(lobe, cos_i, cos_o, fmax(vec3_dot(h, o->normal), 0.01), vec3_dot(wi, h), log_f,
                 derivative);
}

/** The sample's d ln f / d p [3][3], by central differences: the lobe's splines are smooth. */
static void sample_by_place(const struct observation *o, const double *lobe, vec3 p,
                            double by_p[3][3])
{
    double step = 1e-4 * vec3_length(vec3_sub(p, o->point)), high[3], low[3];
    for (int a = 0; a < 3; a++) {
        vec3 s = {a == 0 ? step : 0, a == 1 ? step : 0, a == 2 ? step : 0};
        log_sample(o, lobe, vec3_add(p, s), high, NULL);
        log_sample(o, lobe, vec3_sub(p, s), low, NULL);
        for (int c = 0; c < 3; c++)
            by_p[c][a] = (high[c] - low[c]) / (2 * step);
    }
}

/** Blocks: place, ln intensity, ln power, vignetting, and paper or lobe. */
static bool evaluate_facet(const void *context, double const *const *block, double *residual,
                           double **jacobian)
{
    const struct observation *o = context;
    vec3 p = {block[0][0], block[0][1], block[0][2]};
    double by_p[3], log_f[3] = {o->log_f, o->log_f, o->log_f}, by_lobe[3 * LOBE_SIZE];
    double sample_by_p[3][3] = {{0}};
    double geometry = log_geometry(o, p, by_p);
    double v = 1 + o->q * (block[3][0] + o->q * block[3][1]);
    if (v < 0.05)
        return false;
    if (o->kind == KIND_PAPER)
        memcpy(log_f, block[4], sizeof log_f);
    if (o->kind == KIND_SAMPLE) {
        log_sample(o, block[4], p, log_f, jacobian && jacobian[4] ? by_lobe : NULL);
        if (jacobian && jacobian[0])
            sample_by_place(o, block[4], p, sample_by_p);
    }
    for (int c = 0; c < 3; c++) {
        const double s = -1 / o->sigma[c];
        residual[c] =
            -s
            * (o->facet->log_value[c] - block[1][c] - block[2][0] - log_f[c] - geometry - log(v));
        if (!jacobian)
            continue;
        if (jacobian[0])
            for (int a = 0; a < 3; a++)
                jacobian[0][3 * c + a] = s * (by_p[a] + sample_by_p[c][a]);
        if (jacobian[1])
            for (int a = 0; a < 3; a++)
                jacobian[1][3 * c + a] = a == c ? s : 0;
        if (jacobian[2])
            jacobian[2][c] = s;
        if (jacobian[3]) {
            jacobian[3][2 * c] = s * o->q / v;
            jacobian[3][2 * c + 1] = s * o->q * o->q / v;
        }
        if (o->kind == KIND_PAPER && jacobian[4])
            for (int a = 0; a < 3; a++)
                jacobian[4][3 * c + a] = a == c ? s : 0;
        if (o->kind == KIND_SAMPLE && jacobian[4])
            for (int a = 0; a < LOBE_SIZE; a++)
                jacobian[4][c * LOBE_SIZE + a] = s * by_lobe[c * LOBE_SIZE + a];
    }
    return true;
}

static bool evaluate_lobe_prior(const void *context, double const *const *block, double *residual,
                                double **jacobian)
{
    (void)context;
    cal_lobe_priors(block[0], residual, jacobian ? jacobian[0] : NULL);
    return true;
}

/** Each number of one block near 0, to its sigma[0]. */
static bool evaluate_zero_prior(const void *context, double const *const *block, double *residual,
                                double **jacobian)
{
    const struct observation *o = context;
    int n = o->kind == KIND_VIGNETTING_PRIOR ? 2 : 1;
    for (int a = 0; a < n; a++) {
        residual[a] = block[0][a] / o->sigma[0];
        for (int b = 0; jacobian && jacobian[0] && b < n; b++)
            jacobian[0][n * a + b] = a == b ? 1 / o->sigma[0] : 0;
    }
    return true;
}

/* ---- which facets take part ---------------------------------------------------------------------
 */

/** Fill an observation; false: the facet sees the lamp or the camera too flat, or not at all. */
static bool observe(struct observation *o, const struct facet *f, const struct calibration *c,
                    const struct capture *capture)
{
    const struct view *view = &c->view[f->view];
    const struct lamp *lamp = &c->lamp[view->light];
    const struct camera *camera = &c->camera[view->camera];
    vec3 eye = cal_eye(view->view_from_world);
    vec3 at = cal_lamp_position(lamp, view->view_from_world);
    vec3 to_lamp = vec3_normalize(vec3_sub(at, f->point));
    vec3 to_eye = vec3_normalize(vec3_sub(eye, f->point));
    bool board = f->material != MATERIAL_SAMPLE;
    if (!f->bright || vec3_dot(to_lamp, f->normal) < (board ? 0.05 : COS_MIN)
        || vec3_dot(to_eye, f->normal) < (board ? 0.05 : COS_MIN))
        return false;
    if (board && cal_sample_between(&c->sample, f->point, at, SHADOW_MM))
        return false;
    double dx = f->pixel[0] - camera->center[0], dy = f->pixel[1] - camera->center[1];
    *o = (struct observation){
        .facet = f,
        .point = cal_lamp_frame(lamp, view->view_from_world, f->point),
        .normal = cal_lamp_frame_direction(lamp, view->view_from_world, f->normal),
        .to_eye = cal_lamp_frame_direction(lamp, view->view_from_world, to_eye),
        .q = (dx * dx + dy * dy) * 4
             / ((double)camera->width * camera->width + (double)camera->height * camera->height),
        .view = f->view,
        .kind = !board                          ? KIND_SAMPLE
                : f->material == MATERIAL_PAPER ? KIND_PAPER
                                                : KIND_PATCH,
    };
    if (o->kind == KIND_PATCH)
        o->log_f = log(capture->patch[f->material - MATERIAL_PATCH].albedo / CAP_PI);
    for (int k = 0; k < 3; k++)
        o->sigma[k] = hypot(f->sigma[k], board ? FLOOR_BOARD : FLOOR_SAMPLE);
    return true;
}

/* ---- the problem --------------------------------------------------------------------------------
 */

/** A least-squares problem over a state. */
struct problem {
    struct observation *observation;
    struct ceres_term *term;
    struct ceres_parameter *parameter;
    bool *held;  // room for the largest block
    int terms, parameters;
    int at_intensity, at_power, at_vignetting, at_paper, at_lobe;  // first indices
};

static void problem_free(struct problem *p)
{
    free(p->observation);
    free(p->term);
    free(p->parameter);
    free(p->held);
}

static void add_parameters(struct problem *p, struct state *s, const struct calibration *c,
                           bool has_flat, bool has_sample)
{
    bool *hold = p->held;
    int n = 0;
    for (int l = 0; l < c->lamps; l++)
        p->parameter[n++] = (struct ceres_parameter){.value = s->place[l], .size = 3};
    p->at_intensity = n;
    for (int l = 0; l < c->lamps; l++)
        p->parameter[n++] = (struct ceres_parameter){.value = s->log_intensity[l], .size = 3};
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
    p->parameters = n;
}

static void add_term(struct problem *p, ceres_evaluate evaluate, int residuals, double loss,
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

static void add_facet(struct problem *p, const struct facet *f, const struct calibration *c,
                      const struct capture *capture)
{
    struct observation *o = &p->observation[p->terms];
    if (!observe(o, f, c, capture))
        return;
    const struct view *view = &c->view[f->view];
    const int block[5] = {view->light, p->at_intensity + view->light, p->at_power + f->view,
                          p->at_vignetting + view->camera,
                          o->kind == KIND_PAPER ? p->at_paper : p->at_lobe};
    add_term(p, evaluate_facet, 3, OUTLIER, o->kind == KIND_PATCH ? 4 : 5, block);
}

static void add_priors(struct problem *p, const struct calibration *c)
{
    if (!p->parameter[p->at_lobe].held)
        add_term(p, evaluate_lobe_prior, LOBE_PRIORS, 0, 1, &p->at_lobe);
    for (int k = 0; k < c->cameras && !p->parameter[p->at_vignetting].held; k++) {
        int block = p->at_vignetting + k;
        p->observation[p->terms] =
            (struct observation){.kind = KIND_VIGNETTING_PRIOR, .sigma = {VIGNETTING_PRIOR}};
        add_term(p, evaluate_zero_prior, 2, 0, 1, &block);
    }
    for (int v = 0; v < c->views; v++) {
        int block = p->at_power + v;
        p->observation[p->terms] =
            (struct observation){.kind = KIND_POWER_PRIOR, .sigma = {POWER_PRIOR}, .view = v};
        if (!p->parameter[block].held)
            add_term(p, evaluate_zero_prior, 1, 0, 1, &block);
    }
}

/* ---- all of it ----------------------------------------------------------------------------------
 */

static void state_free(struct state *s)
{
    free(s->place);
    free(s->log_intensity);
    free(s->log_power);
    free(s->vignetting);
}

/** ln of the intensity that the facet's radiance asks for, but for f. */
static double log_light(const struct facet *f, const struct calibration *c)
{
    const struct view *view = &c->view[f->view];
    vec3 to = vec3_sub(cal_lamp_position(&c->lamp[view->light], view->view_from_world), f->point);
    double r2 = vec3_dot(to, to), up = fmax(vec3_dot(to, f->normal), 0.05 * sqrt(r2));
    return log(up) - 1.5 * log(r2);
}

/** Starting values: places from the lamps, intensities from the patch, paper and sample from them.
 */
static void start_values(struct state *s, const struct calibration *c,
                         const struct capture *capture, const struct facets *board,
                         const struct facets *sample)
{
    for (int l = 0; l < c->lamps; l++) {
        const vec3 p = c->lamp[l].position;
        s->place[l][0] = p.x;
        s->place[l][1] = p.y;
        s->place[l][2] = p.z;
    }
    double paper[3] = {0}, albedo[3] = {0};
    int papers = 0, samples = 0;
    int *patches = calloc((size_t)c->lamps, sizeof *patches);
    for (int i = 0; i < board->count && patches; i++) {
        const struct facet *f = &board->facet[i];
        int l = c->view[f->view].light;
        if (f->material < MATERIAL_PATCH)
            continue;
        double log_f = log(capture->patch[f->material - MATERIAL_PATCH].albedo / CAP_PI);
        patches[l]++;
        for (int k = 0; k < 3; k++)
            s->log_intensity[l][k] +=
                (f->log_value[k] - log_light(f, c) - log_f - s->log_intensity[l][k]) / patches[l];
    }
    for (int i = 0; i < board->count; i++) {
        const struct facet *f = &board->facet[i];
        if (f->material == MATERIAL_PAPER && ++papers)
            for (int k = 0; k < 3; k++)
                paper[k] += (f->log_value[k] - log_light(f, c)
                             - s->log_intensity[c->view[f->view].light][k] - paper[k])
                            / papers;
    }
    for (int i = 0; i < sample->count; i++) {
        const struct facet *f = &sample->facet[i];
        if (f->bright && ++samples)
            for (int k = 0; k < 3; k++)
                albedo[k] += (f->log_value[k] - log_light(f, c)
                              - s->log_intensity[c->view[f->view].light][k] - albedo[k])
                             / samples;
    }
    memcpy(s->log_paper, paper, sizeof paper);
    for (int k = 0; k < 3; k++)
        albedo[k] = exp(albedo[k]) * CAP_PI;
    cal_lobe_start(s->lobe, albedo);
    free(patches);
}

static double mean_power(const struct state *s, const struct calibration *c, int l)
{
    double sum = 0;
    int n = 0;
    for (int v = 0; v < c->views; v++)
        if (c->view[v].light == l) {
            sum += exp(s->log_power[v]);
            n++;
        }
    return n ? sum / n : 1;
}

/** sigma is [number], in the order of add_parameters. */
static void keep(struct calibration *c, const struct state *s, bool with_sample,
                 const double *sigma)
{
    const double *of_intensity = sigma + 3 * c->lamps, *of_power = sigma + 6 * c->lamps;
    for (int l = 0; l < c->lamps; l++) {
        struct lamp *lamp = &c->lamp[l];
        double mean = mean_power(s, c, l);
        lamp->position = (vec3){s->place[l][0], s->place[l][1], s->place[l][2]};
        for (int k = 0; k < 3; k++) {
            lamp->intensity[k] = exp(s->log_intensity[l][k]) * mean;
            lamp->sigma_position[k] = sigma[3 * l + k];
            lamp->sigma_intensity[k] = lamp->intensity[k] * of_intensity[3 * l + k];
        }
    }
    for (int v = 0; v < c->views; v++) {
        struct view *view = &c->view[v];
        view->power = exp(s->log_power[v]) / mean_power(s, c, view->light);
        view->sigma_power = view->power * of_power[v];
    }
    for (int k = 0; k < c->cameras; k++)
        memcpy(c->camera[k].vignetting, s->vignetting[k], sizeof c->camera[k].vignetting);
    for (int k = 0; k < 3; k++)
        c->surroundings.paper[k] = CAP_PI * exp(s->log_paper[k]);
    c->surroundings.has_lobe = with_sample;
    if (with_sample)
        cal_lobe_tabulate(&c->surroundings.lobe, s->lobe);
}

/** One solution from the facets that the present lamps light. */
static enum status solve(struct calibration *c, struct state *s, const struct capture *capture,
                         const struct facets *board, const struct facets *sample, struct error *err)
{
    size_t terms = (size_t)(board->count + sample->count + c->views + c->cameras + 1);
    size_t blocks = (size_t)(2 * c->lamps + c->views + c->cameras + 2);
    struct problem p = {.observation = calloc(terms, sizeof *p.observation),
                        .term = calloc(terms, sizeof *p.term),
                        .parameter = calloc(blocks, sizeof *p.parameter),
                        .held = calloc(LOBE_SIZE, sizeof *p.held)};
    int *cluster = calloc(terms, sizeof *cluster);
    double *sigma = calloc(
        6 * (size_t)c->lamps + (size_t)(c->views + 2 * c->cameras) + 3 + LOBE_SIZE, sizeof *sigma);
    enum status status = STATUS_OK;
    if (!p.observation || !p.term || !p.parameter || !p.held || !cluster || !sigma) {
        status = cap_fail(err, STATUS_MEMORY, "%zu photometric observations", terms);
        goto done;
    }
    memset(p.held, true, LOBE_SIZE * sizeof *p.held);
    add_parameters(&p, s, c, capture->flat != NULL, sample->count > 0);
    for (int i = 0; i < board->count; i++)
        add_facet(&p, &board->facet[i], c, capture);
    for (int i = 0; i < sample->count; i++)
        add_facet(&p, &sample->facet[i], c, capture);
    add_priors(&p, c);
    struct ceres_problem problem = {.parameter = p.parameter,
                                    .term = p.term,
                                    .parameters = p.parameters,
                                    .terms = p.terms,
                                    .iterations = 60};
    status = ceres_solve(&problem, err);
    if (status)
        goto done;
    for (int t = 0; t < p.terms; t++) {
        const struct observation *o = p.term[t].context;
        cluster[t] = o->facet ? o->view : -1;
    }
    status = cal_sandwich(sigma, &problem, cluster, c->views, err);
    if (!status)
        keep(c, s, sample->count > 0, sigma);
done:
    free(sigma);
    free(cluster);
    problem_free(&p);
    return status;
}

enum status cal_lamp_fit(struct calibration *c, const struct capture *capture,
                         const struct facets *board, const struct facets *sample, struct error *err)
{
    struct state s = {.place = calloc((size_t)c->lamps, sizeof *s.place),
                      .log_intensity = calloc((size_t)c->lamps, sizeof *s.log_intensity),
                      .log_power = calloc((size_t)c->views, sizeof *s.log_power),
                      .vignetting = calloc((size_t)c->cameras, sizeof *s.vignetting)};
    enum status status = STATUS_OK;
    if (!s.place || !s.log_intensity || !s.log_power || !s.vignetting) {
        status = cap_fail(err, STATUS_MEMORY, "lamps of %d views", c->views);
    } else {
        start_values(&s, c, capture, board, sample);
        for (int round = 0; round < 2 && !status; round++)
            status = solve(c, &s, capture, board, sample, err);
    }
    state_free(&s);
    return status;
}
