/* lamp_state.c -- the unknowns of lamp_fit.c: where they start, and what they mean in the end. */
#include "lamp_state.h"

#include "beam_model.h"

#include <stdlib.h>
#include <string.h>

static const double MIRROR_LEAST = 0.04;  // of varnish and glass, face on
static const double FARTHEST_MM = 1e5;    // a lamp nearer than this has a place
static const double WHITE = 0.8;          // of paper, where nothing tells of any scale as yet

void lamp_state_free(struct lamp_state *s)
{
    free(s->chart);
    free(s->place);
    free(s->log_e);
    free(s->sigma_inverse);
    free(s->far);
    free(s->beam);
    free(s->log_power);
    free(s->strength);
    free(s->vignetting);
}

bool lamp_state_make(struct lamp_state *s, const struct calibration *c, double scale)
{
    *s = (struct lamp_state){.chart = calloc((size_t)c->lamps, sizeof *s->chart),
                             .place = calloc((size_t)c->lamps, sizeof *s->place),
                             .log_e = calloc((size_t)c->lamps, sizeof *s->log_e),
                             .sigma_inverse = calloc((size_t)c->lamps, sizeof *s->sigma_inverse),
                             .far = calloc((size_t)c->lamps, sizeof *s->far),
                             .beam = calloc((size_t)c->lamps, sizeof *s->beam),
                             .log_power = calloc((size_t)c->views, sizeof *s->log_power),
                             .strength = calloc((size_t)c->lamps, sizeof *s->strength),
                             .vignetting = calloc((size_t)c->cameras, sizeof *s->vignetting)};
    for (int k = 0; k < LAMP_KINDS; k++)
        s->scale[k] = scale;
    return s->chart && s->place && s->log_e && s->sigma_inverse && s->far && s->beam && s->log_power
           && s->strength && s->vignetting;
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
static double log_light(const struct facet *f, const struct lamp_state *s,
                        const struct calibration *c)
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

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/** f [3] of a lit facet of the sample, as the starting lamps have it; false: not lit, or too flat.
 */
static bool facet_f(double f[3], double *cos_h, const struct facet *facet,
                    const struct lamp_state *s, const struct calibration *c)
{
    const struct view *view = &c->view[facet->view];
    double unused;
    vec3 wi = cal_lamp_way(&c->lamp[view->light], view->view_from_world, facet->point, &unused);
    vec3 wo = vec3_normalize(vec3_sub(cal_eye(view->view_from_world), facet->point));
    if (!facet->bright || vec3_dot(wi, facet->normal) < 0.2 || vec3_dot(wo, facet->normal) < 0.2)
        return false;
    *cos_h = vec3_dot(vec3_normalize(vec3_add(wi, wo)), facet->normal);
    for (int k = 0; k < 3; k++)
        f[k] = exp(facet->log_value[k] - log_light(facet, s, c) - s->log_e[view->light][k]);
    return true;
}

/** The lobe by what the sample's facets show: matte as the darker of them, the rest gloss. */
static bool start_lobe(struct lamp_state *s, const struct calibration *c,
                       const struct facets *sample)
{
    const size_t room = (size_t)sample->count + 1;
    double *cos_h = calloc(room, sizeof *cos_h), *one = calloc(room, sizeof *one);
    double(*f)[3] = calloc(room, sizeof *f), albedo[3] = {0.1, 0.1, 0.1};
    bool good = cos_h && f && one;
    int n = 0;
    for (int i = 0; good && i < sample->count; i++)
        n += facet_f(f[n], &cos_h[n], &sample->facet[i], s, c);
    for (int k = 0; k < 3 && n; k++) {
        for (int i = 0; i < n; i++)
            one[i] = f[i][k];
        qsort(one, (size_t)n, sizeof *one, by_value);
        albedo[k] = CAP_PI * fmax(one[n / 4], 1e-6);
    }
    cal_lobe_start(s->lobe, albedo);
    if (good && n)
        good = cal_lobe_start_gloss(s->lobe, n, cos_h, (const double(*)[3])f);
    free(cos_h);
    free(one);
    free(f);
    return good;
}

bool lamp_state_start(struct lamp_state *s, const struct calibration *c,
                      const struct capture *capture, const struct lamp_evidence *evidence)
{
    const struct facets none = {0}, *board = evidence->board ? evidence->board : &none;
    const struct facets *sample = evidence->sample ? evidence->sample : &none;
    int papers = 0, *patches = calloc((size_t)c->lamps, sizeof *patches);
    for (int l = 0; l < c->lamps && patches; l++) {
        s->chart[l] = cal_lamp_chart(&c->lamp[l], chart_origin(c, l), s->place[l]);
        beam_to_numbers(s->beam[l], &c->lamp[l], &s->chart[l]);
        double w = c->lamp[l].at_infinity ? 1 : cal_chart_inverse_mm(s->place[l][2]);
        for (int k = 0; k < 3; k++)
            s->log_e[l][k] = log(fmax(c->lamp[l].intensity[k], 1e-30) * w * w);
    }
    for (int i = 0; i < board->count && patches; i++) {
        const struct facet *f = &board->facet[i];
        int l = c->view[f->view].light;
        if (f->material < MATERIAL_PATCH && (capture->patches || c->lamp[l].intensity[0] > 0))
            continue;
        double log_f =
            log((f->material < MATERIAL_PATCH ? WHITE
                                              : capture->patch[f->material - MATERIAL_PATCH].albedo)
                / CAP_PI);
        const double known[3] = {log_f, log_f, log_f};
        average(s->log_e[l], ++patches[l], f, log_light(f, s, c), known);
    }
    for (int i = 0; i < board->count; i++) {
        const struct facet *f = &board->facet[i];
        if (f->material == MATERIAL_PAPER)
            average(s->log_paper, ++papers, f, log_light(f, s, c),
                    s->log_e[c->view[f->view].light]);
    }
    free(patches);
    return patches != NULL && start_lobe(s, c, sample);
}

double lamp_mean_power(const struct lamp_state *s, const struct calibration *c, int l)
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

double lamp_covariance(const struct lamp_spread *s, int a, int b)
{
    return s->covariance[(size_t)a * (size_t)s->numbers + (size_t)b];
}

/** sqrt(j C j^T) for the numbers at[n]. */
static double sigma_of(const struct lamp_spread *s, int n, const int *at, const double *j)
{
    double variance = 0;
    for (int a = 0; a < n; a++)
        for (int b = 0; b < n; b++)
            variance += j[a] * lamp_covariance(s, at[a], at[b]) * j[b];
    return sqrt(fmax(variance, 0));
}

static double part(vec3 v, int k)
{
    return k == 0 ? v.x : k == 1 ? v.y : v.z;
}

static void keep_lamp(struct lamp *lamp, const struct lamp_state *s, int l, int lamps, double power,
                      const struct lamp_spread *spread)
{
    const struct lamp_chart *chart = &s->chart[l];
    const int place[3] = {3 * l, 3 * l + 1, 3 * l + 2};
    double w_by_x = cal_chart_inverse_mm(1);
    double w = fmax(cal_chart_inverse_mm(s->place[l][2]), 1 / FARTHEST_MM);
    vec3 d = cal_chart_direction(chart, s->place[l]);
    double r = s->far[l] ? 1 : 1 / w;
    lamp->at_infinity = s->far[l];
    lamp->direction = d;
    lamp->cue[CUE_JOINT] = (struct lamp_cue){
        .direction = d,
        .sigma = sqrt(0.5
                      * (lamp_covariance(spread, place[0], place[0])
                         + lamp_covariance(spread, place[1], place[1]))),
        .distance = s->far[l] ? 0 : r,
        .sigma_distance =
            s->far[l] ? 0 : r * r * w_by_x * sqrt(lamp_covariance(spread, place[2], place[2]))};
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

// Position, or direction, and ln intensity are functions of the place's three numbers and of ln E.
/** Beams are the numbers before the last, the sample's centre. */
static void keep_beam(struct lamp *lamp, const struct lamp_state *s, int l, int lamps,
                      const struct lamp_spread *spread)
{
    const int at = spread->numbers - SHIFTS - BEAM_NUMBERS * (lamps - l);
    double covariance[BEAM_NUMBERS][BEAM_NUMBERS];
    for (int a = 0; a < BEAM_NUMBERS; a++)
        for (int b = 0; b < BEAM_NUMBERS; b++)
            covariance[a][b] = lamp_covariance(spread, at + a, at + b);
    beam_from_numbers(lamp, s->beam[l], s->place[l], &s->chart[l], covariance);
}

static void keep_covariance(struct lamp *lamp, const struct lamp_state *s, int l, int lamps,
                            const struct lamp_spread *spread)
{
    const struct lamp_chart *chart = &s->chart[l];
    const double r = s->far[l] ? 1 : lamp->cue[CUE_JOINT].distance;
    const double by_w = s->far[l] ? 0 : r * cal_chart_inverse_mm(1);  // of ln w
    double j[4][4] = {{0}};
    for (int k = 0; k < 3; k++) {
        j[k][0] = r * part(chart->u, k);
        j[k][1] = r * part(chart->v, k);
        j[k][2] = -r * by_w * part(lamp->direction, k);
    }
    j[3][2] = -2 * by_w;
    j[3][3] = 1;
    for (int a = 0; a < 4; a++)
        for (int b = 0; b < 4; b++) {
            double sum = 0;
            for (int m = 0; m < 16; m++)
                for (int c = 0; c < 3; c++) {
                    int p = m / 4 < 3 ? 3 * l + m / 4 : 3 * lamps + 3 * l + c;
                    int q = m % 4 < 3 ? 3 * l + m % 4 : 3 * lamps + 3 * l + c;
                    sum += j[a][m / 4] * lamp_covariance(spread, p, q) * j[b][m % 4] / 3;
                }
            lamp->covariance[a][b] = sum;
        }
}

void lamp_keep_shift(struct sample_shift *shift, const struct lamp_state *s,
                     const struct lamp_spread *spread)
{
    for (int k = 0; k < SHIFTS; k++) {
        int at = spread->numbers - SHIFTS + k;
        shift->by[k] = s->shift[k];
        shift->sigma[k] = sqrt(lamp_covariance(spread, at, at));
    }
}

void lamp_keep(struct calibration *c, const struct lamp_state *s, bool with_sample,
               const struct lamp_spread *spread)
{
    for (int l = 0; l < c->lamps; l++) {
        keep_lamp(&c->lamp[l], s, l, c->lamps, lamp_mean_power(s, c, l), spread);
        keep_covariance(&c->lamp[l], s, l, c->lamps, spread);
        keep_beam(&c->lamp[l], s, l, c->lamps, spread);
    }
    for (int v = 0; v < c->views; v++) {
        struct view *view = &c->view[v];
        int at = 6 * c->lamps + v;
        view->power = exp(s->log_power[v]) / lamp_mean_power(s, c, view->light);
        view->sigma_power = view->power * sqrt(lamp_covariance(spread, at, at));
    }
    for (int k = 0; k < c->cameras; k++)
        memcpy(c->camera[k].vignetting, s->vignetting[k], sizeof c->camera[k].vignetting);
    for (int k = 0; k < 3; k++)
        c->surroundings.paper[k] = CAP_PI * exp(s->log_paper[k]);
    for (int k = 0; k < 3 && c->surroundings.strength > 0; k++) {
        double found = fmax(s->echo[ECHO_MIRROR + k], s->lit[ECHO_MIRROR + k]);
        c->surroundings.mirror[k] = fmin(fmax(found, MIRROR_LEAST), 1);
    }
    c->surroundings.has_lobe = with_sample;
    if (with_sample)
        cal_lobe_tabulate(&c->surroundings.lobe, s->lobe);
}
