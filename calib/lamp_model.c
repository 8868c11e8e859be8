/* lamp_model.c -- how a lamp lights a facet, as residuals with derivatives.
 *
 * Method.   In logarithms, for channels c (charts: lamp_model.h):
 *
 *               ln L_c = ln E_c + ln k + ln f_c + ln(q.n) - 3 ln|q| + ln B(q) + ln V(pixel)
 *
 *           Derivatives are exact but for the sample's lobe, whose derivative by the lamp's place
 *           is a central difference.
 */
#include "beam_model.h"

#include <string.h>

static const double CHART_MM = 1000;  // x2 is 1 for a lamp at this distance

/* ---- places ---------------------------------------------------------------------------------- */

double cal_chart_inverse_mm(double x2)
{
    return x2 / CHART_MM;
}

struct lamp_chart cal_lamp_chart(const struct lamp *lamp, vec3 origin, double x[3])
{
    vec3 to = lamp->at_infinity ? lamp->direction : vec3_sub(lamp->position, origin);
    double distance = fmax(vec3_length(to), 1e-3);
    vec3 axis = vec3_scale(to, 1 / distance);
    vec3 away = fabs(axis.z) < 0.8 ? (vec3){0, 0, 1} : (vec3){1, 0, 0};
    vec3 u = vec3_normalize(vec3_cross(away, axis));
    x[0] = x[1] = 0;
    x[2] = lamp->at_infinity ? 0 : CHART_MM / distance;
    return (struct lamp_chart){origin, axis, u, vec3_cross(axis, u)};
}

vec3 cal_chart_direction(const struct lamp_chart *chart, const double x[3])
{
    vec3 off = vec3_add(vec3_scale(chart->u, x[0]), vec3_scale(chart->v, x[1]));
    return vec3_normalize(vec3_add(chart->axis, off));
}

/** q of a point, and its derivatives by x. */
static vec3 way_to(const struct lamp_chart *chart, const double x[3], vec3 point, vec3 by_x[3])
{
    vec3 off = vec3_add(vec3_scale(chart->u, x[0]), vec3_scale(chart->v, x[1]));
    double length = vec3_length(vec3_add(chart->axis, off));
    vec3 d = cal_chart_direction(chart, x), from_point = vec3_sub(chart->origin, point);
    const vec3 side[2] = {chart->u, chart->v};
    for (int a = 0; a < 2; a++)
        by_x[a] = vec3_scale(vec3_sub(side[a], vec3_scale(d, vec3_dot(d, side[a]))), 1 / length);
    by_x[2] = vec3_scale(from_point, 1 / CHART_MM);
    return vec3_add(d, vec3_scale(by_x[2], x[2]));
}

/* ---- residuals ------------------------------------------------------------------------------- */

/** ln((q.n)/|q|^3), and with a beam its share; by_x and by_beam its gradients. */
static double log_geometry(const struct observation *o, const double x[3],
                           const double beam[BEAM_NUMBERS], double by_x[3],
                           double by_beam[BEAM_NUMBERS])
{
    vec3 q_by_x[3], q = way_to(o->chart, x, o->point, q_by_x);
    double q2 = vec3_dot(q, q), up = vec3_dot(q, o->normal), least = 0.01 * sqrt(q2);
    bool flat = up < least;  // held there, so that a wild step costs and does not fail
    if (flat)
        up = least;
    vec3 n = flat ? vec3_scale(q, up / q2) : o->normal;
    vec3 g = vec3_sub(vec3_scale(n, 1 / up), vec3_scale(q, 3 / q2));
    double beam_by_x[3] = {0}, share = 0;
    if (beam[2] != 0)
        share = beam_log(o->chart, x, beam, q, q_by_x, beam_by_x, by_beam);
    for (int a = 0; a < 3; a++)
        by_x[a] = vec3_dot(g, q_by_x[a]) + beam_by_x[a];
    return log(up) - 1.5 * log(q2) + share;
}

/** The sample's ln f for a lamp at x; derivative as in cal_lobe_log. */
static void log_sample(const struct observation *o, const double *lobe, const double x[3],
                       double log_f[3], double *derivative)
{
    vec3 unused[3], wi = vec3_normalize(way_to(o->chart, x, o->point, unused));
    vec3 h = vec3_normalize(vec3_add(wi, o->to_eye));
    double cos_i = fmax(vec3_dot(wi, o->normal), 0.01);
    double cos_o = fmax(vec3_dot(o->to_eye, o->normal), 0.01);
    cal_lobe_log(lobe, cos_i, cos_o, fmax(vec3_dot(h, o->normal), 0.01), vec3_dot(wi, h), log_f,
                 derivative);
}

/** The observation of a sphere whose centre (world) and radius are off by `shift`: what the same
 * ray meets. */
static struct observation moved(const struct observation *o, const double shift[SHIFTS])
{
    struct observation m = *o;
    vec3 by = {0, 0, 0};
    for (int a = 0; a < 3; a++)
        by = vec3_add(by, vec3_scale(o->axis[a], shift[a]));
    vec3 from_center = vec3_sub(vec3_scale(o->normal, o->radius), by);
    double b = -vec3_dot(from_center, o->to_eye), radius = o->radius + shift[3];
    double under = b * b - vec3_dot(from_center, from_center) + radius * radius;
    double t = -b - sqrt(fmax(under, 0));
    m.point = vec3_sub(o->point, vec3_scale(o->to_eye, t));
    m.normal = vec3_normalize(vec3_sub(from_center, vec3_scale(o->to_eye, t)));
    return m;
}

/** ln of geometry and f [3] of a sample that is off by shift. */
static void log_moved(const struct observation *o, const double *lobe, const double x[3],
                      const double *beam, const double shift[SHIFTS], double log_l[3])
{
    double unused[3], unused_too[BEAM_NUMBERS];
    struct observation m = moved(o, shift);
    log_sample(&m, lobe, x, log_l, NULL);
    double geometry = log_geometry(&m, x, beam, unused, unused_too);
    for (int c = 0; c < 3; c++)
        log_l[c] += geometry;
}

/** Its d / d shift [3][SHIFTS], by central differences. */
static void sample_by_shift(const struct observation *o, const double *lobe, const double x[3],
                            const double *beam, const double shift[SHIFTS],
                            double by_shift[3][SHIFTS])
{
    const double step = 1e-4 * o->radius;
    for (int a = 0; a < SHIFTS; a++) {
        double high_at[SHIFTS], low_at[SHIFTS], high[3], low[3];
        memcpy(high_at, shift, sizeof high_at);
        memcpy(low_at, shift, sizeof low_at);
        high_at[a] += step;
        low_at[a] -= step;
        log_moved(o, lobe, x, beam, high_at, high);
        log_moved(o, lobe, x, beam, low_at, low);
        for (int c = 0; c < 3; c++)
            by_shift[c][a] = (high[c] - low[c]) / (2 * step);
    }
}

/** The sample's d ln f / d x [3][3], by central differences: the lobe's splines are smooth. */
static void sample_by_place(const struct observation *o, const double *lobe, const double x[3],
                            double by_x[3][3])
{
    const double step = 1e-4;
    for (int a = 0; a < 3; a++) {
        double high_x[3] = {x[0], x[1], x[2]}, low_x[3] = {x[0], x[1], x[2]}, high[3], low[3];
        high_x[a] += step;
        low_x[a] -= step;
        log_sample(o, lobe, high_x, high, NULL);
        log_sample(o, lobe, low_x, low, NULL);
        for (int c = 0; c < 3; c++)
            by_x[c][a] = (high[c] - low[c]) / (2 * step);
    }
}

bool cal_lamp_evaluate(const void *context, double const *const *block, double *residual,
                       double **jacobian)
{
    const struct observation *o = context;
    struct observation moved_sample;
    if (o->kind == KIND_SAMPLE && jacobian && jacobian[5]) {
        double by_shift[3][SHIFTS];
        sample_by_shift(o, block[4], block[0], block[7], block[5], by_shift);
        for (int c = 0; c < 3; c++)
            for (int a = 0; a < SHIFTS; a++)
                jacobian[5][SHIFTS * c + a] = -by_shift[c][a] / o->sigma[c];
    }
    if (o->kind == KIND_SAMPLE) {
        moved_sample = moved(o, block[5]);
        o = &moved_sample;
    }
    double by_x[3], log_f[3] = {o->log_f, o->log_f, o->log_f}, by_lobe[3 * LOBE_SIZE];
    double sample_by_x[3][3] = {{0}};
    const int at_echo = o->kind == KIND_PATCH ? 4 : o->kind == KIND_PAPER ? 5 : 6;
    const int at_beam = at_echo + 1;
    double by_beam[BEAM_NUMBERS] = {0};
    double geometry = log_geometry(o, block[0], block[at_beam], by_x, by_beam);
    double v = 1 + o->q * (block[3][0] + o->q * block[3][1]);
    if (v < 0.05)
        return false;
    if (o->kind == KIND_PAPER)
        memcpy(log_f, block[4], sizeof log_f);
    if (o->kind == KIND_SAMPLE) {
        log_sample(o, block[4], block[0], log_f, jacobian && jacobian[4] ? by_lobe : NULL);
        if (jacobian && jacobian[0])
            sample_by_place(o, block[4], block[0], sample_by_x);
    }
    for (int c = 0; c < 3; c++) {
        const double s = -1 / o->sigma[c];
        double value = o->facet->log_value[c];
        for (int e = 0; e < ECHOES; e++)
            value -= o->facet->echo[e][c] * block[at_echo][e];
        residual[c] =
            -s * (value - block[1][c] - block[2][0] - log_f[c] - geometry - o->log_bend - log(v));
        if (!jacobian)
            continue;
        if (jacobian[at_beam])
            for (int a = 0; a < BEAM_NUMBERS; a++)
                jacobian[at_beam][BEAM_NUMBERS * c + a] = s * by_beam[a];
        if (jacobian[at_echo])
            for (int e = 0; e < ECHOES; e++)
                jacobian[at_echo][ECHOES * c + e] = s * o->facet->echo[e][c];
        if (jacobian[0])
            for (int a = 0; a < 3; a++)
                jacobian[0][3 * c + a] = s * (by_x[a] + sample_by_x[c][a]);
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

/** From the lamp at x to what a sample that is off by shift mirrors, along two axes across wi. */
static void highlight_off(const struct observation *o, const double x[3],
                          const double shift[SHIFTS], double off[2])
{
    struct observation m = moved(o, shift);
    vec3 unused[3], lamp = vec3_normalize(way_to(o->chart, x, m.point, unused));
    vec3 mirror = vec3_sub(vec3_scale(m.normal, 2 * vec3_dot(m.normal, o->to_eye)), o->to_eye);
    vec3 away = fabs(o->wi.z) < 0.8 ? (vec3){0, 0, 1} : (vec3){1, 0, 0};
    vec3 u = vec3_normalize(vec3_cross(away, o->wi)), v = vec3_cross(o->wi, u);
    vec3 d = vec3_sub(mirror, lamp);
    off[0] = vec3_dot(d, u) / o->sigma[0];
    off[1] = vec3_dot(d, v) / o->sigma[0];
}

bool cal_lamp_evaluate_highlight(const void *context, double const *const *block, double *residual,
                                 double **jacobian)
{
    const struct observation *o = context;
    highlight_off(o, block[0], block[1], residual);
    const double step[2] = {1e-5, 1e-5 * o->radius};
    const int size[2] = {3, SHIFTS};
    for (int b = 0; jacobian && b < 2; b++)
        for (int a = 0; jacobian[b] && a < size[b]; a++) {
            double at[2][SHIFTS], high[2], low[2];
            memcpy(at[0], block[0], 3 * sizeof(double));
            memcpy(at[1], block[1], sizeof at[1]);
            at[b][a] += step[b];
            highlight_off(o, at[0], at[1], high);
            at[b][a] -= 2 * step[b];
            highlight_off(o, at[0], at[1], low);
            for (int k = 0; k < 2; k++)
                jacobian[b][size[b] * k + a] = (high[k] - low[k]) / (2 * step[b]);
        }
    return true;
}

bool cal_lamp_evaluate_lobe_prior(const void *context, double const *const *block, double *residual,
                                  double **jacobian)
{
    (void)context;
    cal_lobe_priors(block[0], residual, jacobian ? jacobian[0] : NULL);
    return true;
}

bool cal_lamp_evaluate_zero_prior(const void *context, double const *const *block, double *residual,
                                  double **jacobian)
{
    const struct observation *o = context;
    int n = o->kind == KIND_ECHO_PRIOR                                  ? (int)ECHOES
            : o->kind == KIND_SHAPE_PRIOR                               ? (int)SHIFTS
            : o->kind == KIND_PLACE_PRIOR || o->kind == KIND_BEAM_PRIOR ? 3
            : o->kind == KIND_VIGNETTING_PRIOR                          ? 2
                                                                        : 1;
    for (int a = 0; a < n; a++) {
        residual[a] = block[0][a] / o->sigma[a];
        for (int b = 0; jacobian && jacobian[0] && b < n; b++)
            jacobian[0][n * a + b] = a == b ? 1 / o->sigma[a] : 0;
    }
    return true;
}
