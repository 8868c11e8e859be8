/* beam.c -- lamps that shine less to the side than along their axis.
 *
 * Method.   I = I0 cos(a)^n, a the angle from an axis: with n and an axis that may point past the
 *           scene the light's slope and bend over the scene are what any smooth fall-off about an
 *           axis has. The board alone cannot tell it from a lamp in another place (an even light's
 *           three numbers make as good a plane, nearly); a sphere's shading and its highlights
 *           tell the lamp's direction whatever the fall-off is. So it is looked for where board and
 *           sample disagree about a direction, and is kept where the fit finds it beyond doubt.
 */
#include "beam_model.h"

// Behind the lamp and nearly so there is this cosine's light: a logarithm must have something.
static const double COS_LEAST = 0.02;
static const double SUSPECT_SIGMAS = 5, SUSPECT_RAD = 0.02, FOUND_SIGMAS = 5, FOUND_LEAST = 0.1;

double cal_beam_share(const struct beam *beam, vec3 away)
{
    if (beam->exponent == 0)
        return 1;
    return pow(fmax(vec3_dot(beam->axis, away), COS_LEAST) / beam->cosine, beam->exponent);
}

static vec3 raw_axis(const struct lamp_chart *chart, const double b[BEAM_NUMBERS])
{
    vec3 side = vec3_add(vec3_scale(chart->u, b[0]), vec3_scale(chart->v, b[1]));
    return vec3_sub(side, chart->axis);
}

double beam_log(const struct lamp_chart *chart, const double x[3], const double b[BEAM_NUMBERS],
                vec3 q, const vec3 q_by_x[3], double by_x[3], double by_b[BEAM_NUMBERS])
{
    const vec3 raw = raw_axis(chart, b), axis = vec3_normalize(raw), side[2] = {chart->u, chart->v};
    const vec3 d = cal_chart_direction(chart, x);
    const double length = vec3_length(q), least = COS_LEAST * length;
    double along = -vec3_dot(axis, q), at_origin = fmax(-vec3_dot(axis, d), COS_LEAST);
    bool flat = along < least;
    if (flat)
        along = least;
    double log_share = log(along / length) - log(at_origin);
    for (int a = 0; a < 3; a++) {  // d and q share their derivatives by the first two numbers
        double by = flat ? 0 : -vec3_dot(axis, q_by_x[a]) / along;
        by -= flat ? 0 : vec3_dot(q, q_by_x[a]) / (length * length);
        by_x[a] = b[2] * (by + (a < 2 ? vec3_dot(axis, q_by_x[a]) / at_origin : 0));
    }
    for (int k = 0; k < 2; k++) {
        vec3 turn = vec3_sub(side[k], vec3_scale(axis, vec3_dot(axis, side[k])));
        turn = vec3_scale(turn, 1 / vec3_length(raw));
        by_b[k] = b[2] * ((flat ? 0 : -vec3_dot(turn, q) / along) + vec3_dot(turn, d) / at_origin);
    }
    by_b[2] = log_share;
    return b[2] * log_share;
}

void beam_to_numbers(double b[BEAM_NUMBERS], const struct lamp *lamp,
                     const struct lamp_chart *chart)
{
    const vec3 axis = lamp->beam.axis;
    double ahead = fmax(-vec3_dot(axis, chart->axis), 0.1);
    b[0] = b[1] = 0;
    b[2] = lamp->at_infinity ? 0 : lamp->beam.exponent;
    if (b[2] == 0)
        return;
    b[0] = vec3_dot(axis, chart->u) / ahead;
    b[1] = vec3_dot(axis, chart->v) / ahead;
}

void beam_from_numbers(struct lamp *lamp, const double b[BEAM_NUMBERS], const double x[3],
                       const struct lamp_chart *chart,
                       double covariance[BEAM_NUMBERS][BEAM_NUMBERS])
{
    if (b[2] == 0) {
        lamp->beam = (struct beam){0};
        return;
    }
    const vec3 raw = raw_axis(chart, b), axis = vec3_normalize(raw);
    const double shrink = 1 / vec3_length(raw);  // of a step of b0 or b1, seen as an angle, at most
    lamp->beam = (struct beam){
        .axis = axis,
        .exponent = b[2],
        .cosine = fmax(-vec3_dot(axis, cal_chart_direction(chart, x)), COS_LEAST),
        .sigma_axis = shrink * sqrt(fmax(0.5 * (covariance[0][0] + covariance[1][1]), 0)),
        .sigma_exponent = sqrt(fmax(covariance[2][2], 0))};
}

bool beam_suspected(const struct lamp *lamp)
{
    const struct lamp_cue *joint = &lamp->cue[CUE_JOINT];
    for (int k = CUE_BOARD; k < CUES && !lamp->at_infinity; k++) {
        const struct lamp_cue *cue = &lamp->cue[k];
        double off = vec3_length(vec3_sub(cue->direction, joint->direction));
        if (cue->sigma > 0 && off > SUSPECT_RAD
            && off > SUSPECT_SIGMAS * hypot(cue->sigma, joint->sigma))
            return true;
    }
    return false;
}

void beam_begin(struct lamp *lamp)
{
    lamp->beam = (struct beam){
        .axis = vec3_scale(lamp->cue[CUE_JOINT].direction, -1), .exponent = 1, .cosine = 1};
}

bool beam_found(const struct lamp *lamp)
{
    const struct beam *b = &lamp->beam;
    return b->exponent > FOUND_LEAST && b->exponent > FOUND_SIGMAS * b->sigma_exponent;
}
