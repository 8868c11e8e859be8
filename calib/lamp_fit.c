/* lamp_fit.c -- lamps, powers and vignetting from the light on board and sample.
 *
 * Method.   One least-squares problem over facets (photometry.h; the model: lamp_model.h) with the
 *           lamp's place and irradiances E_c, the view's power k, and for f the patch's albedo/pi
 *           (known), the paper's (unknown), or the sample's lobe (lobe.h: any isotropic
 *           reflectance). k of a lamp's first view is held; at the end powers get mean 1. Cauchy's
 *           loss takes shadows and stains out; it begins ten times wider than it ends, since a
 *           start from the board alone can be half a metre off. Facets whose way to the lamp the
 * sample blocks, or that see it too flat, are left out; since that needs the lamp, all is done
 * again. How far paper, patch and sample really stray from the model their own residuals tell, and
 *           weights follow that. A lamp whose distance comes out below FAR_SIGMAS sigmas of its
 *           inverse is at infinity: its distance is held there, and it has a direction alone.
 * Accuracy. The sandwich over views is used for sigmas (views share errors of pose and model),
 *           never below the formal ones.
 */
#include "ceres_shim.h"
#include "lamp_model.h"
#include "sandwich.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

static const double FLOOR_BOARD = 0.003;  // paper and patch are even to this, to begin with
static const double FLOOR_SAMPLE = 0.01;  // and any sample, with its lobe, to this
static const double OUTLIER = 3;          // scale of Cauchy's loss, in sigma
static const double COS_MIN = 0.17;       // 80 degrees: beyond it, a facet is too flat
static const double SHADOW_MM = 3;
static const double VIGNETTING_PRIOR = 0.3;
static const double POWER_PRIOR = 0.5;  // of ln k: a lamp does not double its light between shots
static const double FAR_SIGMAS = 3, FARTHEST_MM = 1e5;  // a lamp nearer than this has a place
static const double SCALE_MIN = 0.1, SCALE_MAX = 10;    // of a material's sigmas, by its residuals
enum { ROUNDS = 4, KINDS = KIND_SAMPLE + 1 };

/** The unknowns. */
struct state {
    struct lamp_chart *chart;         // [lamps]
    double (*place)[3], (*log_e)[3];  // [lamps]
    double *sigma_inverse;            // [lamps] of place[2], when solved
    bool *far;                        // [lamps]: held at infinity
    double *log_power;                // [views]
    double log_paper[3], lobe[LOBE_SIZE];
    double shift[SHIFTS];     // of the sample: centre, from where the outline has it
    double (*vignetting)[2];  // [cameras]
    double scale[KINDS];      // of the facets' sigmas
};

/* ---- which facets take part ---------------------------------------------------------------------
 */

/** Fill an observation; false: the facet sees the lamp or the camera too flat, or not at all. */
static bool observe(struct observation *o, const struct facet *f, const struct state *s,
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
    if (board && cal_sample_between(&c->sample, f->point, at, SHADOW_MM))
        return false;
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
    if (o->kind == KIND_PATCH)
        o->log_f = log(capture->patch[f->material - MATERIAL_PATCH].albedo / CAP_PI);
    for (int k = 0; k < 3; k++) {
        // Noise is known; what else a facet may stray by is scaled to what it does.
        double noise = f->noise[k] / f->mean[k], floor = board ? FLOOR_BOARD : FLOOR_SAMPLE;
        double model = hypot(sqrt(fmax(f->sigma[k] * f->sigma[k] - noise * noise, 0)), floor);
        o->sigma[k] = hypot(noise, s->scale[o->kind] * model);
    }
    return true;
}

/* ---- the problem --------------------------------------------------------------------------------
 */

/** A least-squares problem over a state. */
struct problem {
    struct observation *observation;
    struct ceres_term *term;
    struct ceres_parameter *parameter;
    bool *held;  // all true, room for the largest block
    int terms, parameters;
    int at_intensity, at_power, at_vignetting, at_paper, at_lobe, at_shift;  // first indices
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
    static const bool distance_held[3] = {false, false, true};
    bool *hold = p->held;
    int n = 0;
    for (int l = 0; l < c->lamps; l++)
        p->parameter[n++] = (struct ceres_parameter){
            .value = s->place[l], .size = 3, .held = s->far[l] ? distance_held : NULL};
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
    p->at_shift = n;
    p->parameter[n++] = (struct ceres_parameter){
        .value = s->shift, .size = SHIFTS, .held = has_sample ? NULL : hold};
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

static void add_facet(struct problem *p, const struct facet *f, const struct state *s,
                      const struct calibration *c, const struct capture *capture)
{
    struct observation *o = &p->observation[p->terms];
    if (!observe(o, f, s, c, capture))
        return;
    const struct view *view = &c->view[f->view];
    const int block[6] = {view->light,
                          p->at_intensity + view->light,
                          p->at_power + f->view,
                          p->at_vignetting + view->camera,
                          o->kind == KIND_PAPER ? p->at_paper : p->at_lobe,
                          p->at_shift};
    add_term(p, cal_lamp_evaluate, 3, OUTLIER, 4 + o->kind - KIND_PATCH, block);
}

static void add_priors(struct problem *p, const struct calibration *c)
{
    if (!p->parameter[p->at_lobe].held)
        add_term(p, cal_lamp_evaluate_lobe_prior, LOBE_PRIORS, 0, 1, &p->at_lobe);
    if (!p->parameter[p->at_shift].held) {
        struct observation *o = &p->observation[p->terms];
        *o = (struct observation){.kind = KIND_SHAPE_PRIOR};
        for (int k = 0; k < SHIFTS; k++)
            o->sigma[k] = fmax(c->sample.sigma_center[k], 1e-6);
        add_term(p, cal_lamp_evaluate_zero_prior, SHIFTS, 0, 1, &p->at_shift);
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

/* ---- start and result --------------------------------------------------------------------------
 */

static void state_free(struct state *s)
{
    free(s->chart);
    free(s->place);
    free(s->log_e);
    free(s->sigma_inverse);
    free(s->far);
    free(s->log_power);
    free(s->vignetting);
}

static bool state_make(struct state *s, const struct calibration *c)
{
    *s = (struct state){.chart = calloc((size_t)c->lamps, sizeof *s->chart),
                        .place = calloc((size_t)c->lamps, sizeof *s->place),
                        .log_e = calloc((size_t)c->lamps, sizeof *s->log_e),
                        .sigma_inverse = calloc((size_t)c->lamps, sizeof *s->sigma_inverse),
                        .far = calloc((size_t)c->lamps, sizeof *s->far),
                        .log_power = calloc((size_t)c->views, sizeof *s->log_power),
                        .vignetting = calloc((size_t)c->cameras, sizeof *s->vignetting)};
    for (int k = 0; k < KINDS; k++)
        s->scale[k] = SCALE_MAX;
    return s->chart && s->place && s->log_e && s->sigma_inverse && s->far && s->log_power
           && s->vignetting;
}

/** Where a lamp's chart begins: the sample (or the board's middle), as the lamp's frame has it. */
static vec3 chart_origin(const struct calibration *c, int l)
{
    vec3 sum = {0, 0, 0};
    int n = 0;
    for (int v = 0; v < c->views; v++)
        if (c->view[v].light == l) {
            sum = vec3_add(
                sum, cal_lamp_frame(&c->lamp[l], c->view[v].view_from_world, c->sample.center));
            n++;
        }
    return n ? vec3_scale(sum, 1.0 / n) : c->sample.center;
}

/** ln(cos(theta_i)/r^2) of a facet, r in distances of the lamp from its chart's origin. */
static double log_light(const struct facet *f, const struct state *s, const struct calibration *c)
{
    const struct view *view = &c->view[f->view];
    const struct lamp *lamp = &c->lamp[view->light];
    double falloff, w = cal_chart_inverse_mm(s->place[view->light][2]);
    vec3 wi = cal_lamp_way(lamp, view->view_from_world, f->point, &falloff);
    return log(fmax(vec3_dot(wi, f->normal), 0.05) * (lamp->at_infinity ? 1 : falloff / (w * w)));
}

/** Add to mean[3] what the facet's radiance asks for beyond its light and log_known. */
static void average(double mean[3], int count, const struct facet *f, double light,
                    const double log_known[3])
{
    for (int k = 0; k < 3; k++)
        mean[k] += (f->log_value[k] - light - log_known[k] - mean[k]) / count;
}

/** Starting values: places from the lamps, irradiances from the patch (without one, from the
 *  lamps), paper and sample from them. */
static bool start_values(struct state *s, const struct calibration *c,
                         const struct capture *capture, const struct facets *board,
                         const struct facets *sample)
{
    int papers = 0, samples = 0, *patches = calloc((size_t)c->lamps, sizeof *patches);
    for (int l = 0; l < c->lamps && patches; l++) {
        s->chart[l] = cal_lamp_chart(&c->lamp[l], chart_origin(c, l), s->place[l]);
        double w = c->lamp[l].at_infinity ? 1 : cal_chart_inverse_mm(s->place[l][2]);
        for (int k = 0; k < 3; k++)
            s->log_e[l][k] = log(fmax(c->lamp[l].intensity[k], 1e-30) * w * w);
    }
    for (int i = 0; i < board->count && patches; i++) {
        const struct facet *f = &board->facet[i];
        int l = c->view[f->view].light;
        if (f->material < MATERIAL_PATCH)
            continue;
        double log_f = log(capture->patch[f->material - MATERIAL_PATCH].albedo / CAP_PI);
        const double known[3] = {log_f, log_f, log_f};
        average(s->log_e[l], ++patches[l], f, log_light(f, s, c), known);
    }
    double albedo[3] = {0};
    for (int i = 0; i < board->count; i++) {
        const struct facet *f = &board->facet[i];
        if (f->material == MATERIAL_PAPER)
            average(s->log_paper, ++papers, f, log_light(f, s, c),
                    s->log_e[c->view[f->view].light]);
    }
    for (int i = 0; i < sample->count; i++) {
        const struct facet *f = &sample->facet[i];
        if (f->bright)
            average(albedo, ++samples, f, log_light(f, s, c), s->log_e[c->view[f->view].light]);
    }
    for (int k = 0; k < 3; k++)
        albedo[k] = exp(albedo[k]) * CAP_PI;
    cal_lobe_start(s->lobe, albedo);
    free(patches);
    return patches != NULL;
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

/** A covariance of all numbers, in the order of add_parameters. */
struct spread {
    double *covariance;  // [numbers][numbers]
    int numbers;
};

static double covariance_of(const struct spread *s, int a, int b)
{
    return s->covariance[(size_t)a * (size_t)s->numbers + (size_t)b];
}

/** sqrt(j C j^T) for the numbers at[n]. */
static double sigma_of(const struct spread *s, int n, const int *at, const double *j)
{
    double variance = 0;
    for (int a = 0; a < n; a++)
        for (int b = 0; b < n; b++)
            variance += j[a] * covariance_of(s, at[a], at[b]) * j[b];
    return sqrt(fmax(variance, 0));
}

static double part(vec3 v, int k)
{
    return k == 0 ? v.x : k == 1 ? v.y : v.z;
}

static void keep_lamp(struct lamp *lamp, const struct state *s, int l, int lamps, double power,
                      const struct spread *spread)
{
    const struct lamp_chart *chart = &s->chart[l];
    const int place[3] = {3 * l, 3 * l + 1, 3 * l + 2};
    double w_by_x = cal_chart_inverse_mm(1);
    double w = fmax(cal_chart_inverse_mm(s->place[l][2]), 1 / FARTHEST_MM);
    vec3 d = cal_chart_direction(chart, s->place[l]);
    double r = s->far[l] ? 1 : 1 / w;
    lamp->at_infinity = s->far[l];
    lamp->direction = d;
    lamp->position = s->far[l] ? (vec3){0, 0, 0} : vec3_add(chart->origin, vec3_scale(d, r));
    for (int k = 0; k < 3; k++) {
        const double j[3] = {r * part(chart->u, k), r * part(chart->v, k),
                             s->far[l] ? 0 : -r * r * w_by_x * part(d, k)};
        double sigma = sigma_of(spread, 3, place, j);
        lamp->sigma_direction[k] = s->far[l] ? sigma : 0;
        lamp->sigma_position[k] = s->far[l] ? 0 : sigma;
        const int both[2] = {3 * lamps + 3 * l + k, 3 * l + 2};
        const double log_by[2] = {1, s->far[l] ? 0 : -2 * r * w_by_x};  // ln I = ln E - 2 ln w
        lamp->intensity[k] = exp(s->log_e[l][k]) * r * r * power;
        lamp->sigma_intensity[k] = lamp->intensity[k] * sigma_of(spread, 2, both, log_by);
    }
}

/** The last numbers are the sample's centre. */
static void keep_shift(struct sample_shift *shift, const struct state *s,
                       const struct spread *spread)
{
    for (int k = 0; k < SHIFTS; k++) {
        int at = spread->numbers - SHIFTS + k;
        shift->by[k] = s->shift[k];
        shift->sigma[k] = sqrt(covariance_of(spread, at, at));
    }
}

static void keep(struct calibration *c, const struct state *s, bool with_sample,
                 const struct spread *spread)
{
    for (int l = 0; l < c->lamps; l++)
        keep_lamp(&c->lamp[l], s, l, c->lamps, mean_power(s, c, l), spread);
    for (int v = 0; v < c->views; v++) {
        struct view *view = &c->view[v];
        int at = 6 * c->lamps + v;
        view->power = exp(s->log_power[v]) / mean_power(s, c, view->light);
        view->sigma_power = view->power * sqrt(covariance_of(spread, at, at));
    }
    for (int k = 0; k < c->cameras; k++)
        memcpy(c->camera[k].vignetting, s->vignetting[k], sizeof c->camera[k].vignetting);
    for (int k = 0; k < 3; k++)
        c->surroundings.paper[k] = CAP_PI * exp(s->log_paper[k]);
    c->surroundings.has_lobe = with_sample;
    if (with_sample)
        cal_lobe_tabulate(&c->surroundings.lobe, s->lobe);
}

/* ---- all of it ----------------------------------------------------------------------------------
 */

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/** Make each material's sigmas as large as its residuals are: 1.4826 times their median is one
 *  sigma. False: out of memory. */
static bool rescale(struct state *s, const struct problem *p)
{
    double *left = calloc(3 * (size_t)p->terms + 1, sizeof *left);
    for (int kind = 0; left && kind < KINDS; kind++) {
        size_t n = 0;
        for (int t = 0; t < p->terms; t++) {
            const struct observation *o = p->term[t].context;
            const double *block[CERES_TERM_PARAMETERS];
            if (!o->facet || o->kind != kind)
                continue;
            for (int k = 0; k < p->term[t].parameters; k++)
                block[k] = p->parameter[p->term[t].parameter[k]].value;
            if (cal_lamp_evaluate(o, block, left + n, NULL))
                n += 3;
        }
        for (size_t i = 0; i < n; i++)
            left[i] = fabs(left[i]);
        qsort(left, n, sizeof *left, by_value);
        if (n > 30)  // fewer tell too little
            s->scale[kind] =
                fmin(fmax(s->scale[kind] * 1.4826 * left[n / 2], SCALE_MIN), SCALE_MAX);
    }
    free(left);
    return left != NULL;
}

static enum status spread_of(struct spread *spread, const struct problem *p,
                             struct ceres_problem *problem, int views, struct error *err)
{
    int *cluster = calloc((size_t)p->terms + 1, sizeof *cluster);
    spread->numbers = 0;
    for (int i = 0; i < p->parameters; i++)
        spread->numbers += p->parameter[i].size;
    size_t n = (size_t)spread->numbers;
    spread->covariance = calloc(n * n, sizeof *spread->covariance);
    enum status status = cluster && spread->covariance
                             ? STATUS_OK
                             : cap_fail(err, STATUS_MEMORY, "the covariance of %zu numbers", n);
    for (int t = 0; !status && t < p->terms; t++) {
        const struct observation *o = p->term[t].context;
        cluster[t] = o->facet ? o->view : -1;
    }
    if (!status)
        status = cal_sandwich_covariance(spread->covariance, problem, cluster, views, err);
    free(cluster);
    return status;
}

/** One solution from the facets that the present lamps light. */
static enum status solve(struct calibration *c, struct state *s, const struct capture *capture,
                         const struct facets *board, const struct facets *sample,
                         struct sample_shift *shift, struct error *err)
{
    size_t terms = (size_t)(board->count + sample->count + c->views + c->cameras + 2);
    size_t blocks = (size_t)(2 * c->lamps + c->views + c->cameras + 3);
    struct problem p = {.observation = calloc(terms, sizeof *p.observation),
                        .term = calloc(terms, sizeof *p.term),
                        .parameter = calloc(blocks, sizeof *p.parameter),
                        .held = calloc(LOBE_SIZE, sizeof *p.held)};
    struct spread spread = {0};
    enum status status = STATUS_OK;
    if (!p.observation || !p.term || !p.parameter || !p.held) {
        status = cap_fail(err, STATUS_MEMORY, "%zu photometric observations", terms);
        goto done;
    }
    memset(p.held, true, LOBE_SIZE * sizeof *p.held);
    add_parameters(&p, s, c, capture->flat != NULL, sample->count > 0);
    for (int i = 0; i < board->count; i++)
        add_facet(&p, &board->facet[i], s, c, capture);
    for (int i = 0; i < sample->count; i++)
        add_facet(&p, &sample->facet[i], s, c, capture);
    add_priors(&p, c);
    struct ceres_problem problem = {.parameter = p.parameter,
                                    .term = p.term,
                                    .parameters = p.parameters,
                                    .terms = p.terms,
                                    .iterations = 60};
    status = ceres_solve(&problem, err);
    if (!status)
        status = spread_of(&spread, &p, &problem, c->views, err);
    if (status)
        goto done;
    for (int l = 0; l < c->lamps; l++)
        s->sigma_inverse[l] = sqrt(covariance_of(&spread, 3 * l + 2, 3 * l + 2));
    keep(c, s, sample->count > 0, &spread);
    keep_shift(shift, s, &spread);
    if (!rescale(s, &p))
        status = cap_fail(err, STATUS_MEMORY, "%d residuals", p.terms);
done:
    free(spread.covariance);
    problem_free(&p);
    return status;
}

/** Hold the lamps at infinity whose distance is not determined. -> how many more there are. */
static int send_away(struct state *s, int lamps)
{
    int more = 0;
    for (int l = 0; l < lamps; l++)
        if (!s->far[l] && s->place[l][2] < FAR_SIGMAS * s->sigma_inverse[l]) {
            s->far[l] = true;
            s->place[l][2] = 0;
            more++;
        }
    return more;
}

enum status cal_lamp_fit(struct calibration *c, const struct capture *capture,
                         const struct facets *board, const struct facets *sample, bool may_be_far,
                         struct sample_shift *shift, struct error *err)
{
    struct state s;
    struct sample_shift moved;
    enum status status = STATUS_OK;
    if (!state_make(&s, c) || !start_values(&s, c, capture, board, sample))
        status = cap_fail(err, STATUS_MEMORY, "lamps of %d views", c->views);
    for (int round = 0; round < ROUNDS && !status; round++)
        status = solve(c, &s, capture, board, sample, &moved, err);
    if (!status && may_be_far && send_away(&s, c->lamps) > 0)
        status = solve(c, &s, capture, board, sample, &moved, err);
    if (!status && shift)
        *shift = moved;
    state_free(&s);
    return status;
}
