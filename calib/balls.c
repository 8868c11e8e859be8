/* balls.c -- balls beside the sample, in which the lamps are seen.
 *
 * A ball is a sample that is a sphere, as far as its place goes: it is found by its outline
 * (sphere.c) in a copy of the calibration. Its reflectance is of no interest, only where it mirrors
 * the lamps (highlight.c).
 */
#include "balls.h"

#include "sample_start.h"
#include "solid.h"
#include "sphere.h"

#include <stdlib.h>

bool cal_ball_between(const struct calibration *c, vec3 a, vec3 b, double margin)
{
    bool between = false;
    for (int i = 0; i < c->balls && !between; i++)
        between = cal_sample_between(&c->ball[i], a, b, margin);
    return between;
}

bool cal_in_the_way(const struct calibration *c, vec3 a, vec3 b, double margin)
{
    return cal_sample_between(&c->sample, a, b, margin) || cal_ball_between(c, a, b, margin);
}

/** The place of capture.yaml that a ball came from: the nearest. */
static const struct ball_place *place_of(const struct sample *ball, const struct capture *capture)
{
    const struct ball_place *nearest = &capture->ball[0];
    for (int i = 1; i < capture->balls; i++)
        if (vec3_length(vec3_sub(capture->ball[i].center, ball->center))
            < vec3_length(vec3_sub(nearest->center, ball->center)))
            nearest = &capture->ball[i];
    return nearest;
}

/** A capture whose sample is the ball. */
static struct capture as_sample(const struct capture *capture, const struct ball_place *place)
{
    struct capture copy = *capture;
    copy.sample = (struct sample_place){.shape = SHAPE_SPHERE,
                                        .radius = place->radius,
                                        .radius_sigma = place->radius_sigma,
                                        .center = place->center};
    return copy;
}

enum status cal_balls_start(struct calibration *c, const struct capture *capture, const char *out,
                            struct run *run, struct error *err)
{
    enum status status = STATUS_OK;
    c->balls = 0;
    for (int i = 0; i < capture->balls && !status; i++) {
        const struct ball_place *place = &capture->ball[i];
        const struct capture of_ball = as_sample(capture, place);
        struct calibration with = *c;
        bool sure = false;
        with.sample = (struct sample){
            .shape = SHAPE_SPHERE, .center = place->center, .radius = place->radius};
        status = cal_sphere_start(&sure, &with, &of_ball, out, run, err);
        if (!status && sure && cal_edges_enough(&with))
            c->ball[c->balls++] = with.sample;
        else if (!status || status == STATUS_DATA) {
            cap_warn(run,
                     "balls: the ball at %.0f, %.0f, %.0f mm is not seen near there, and left out",
                     place->center.x, place->center.y, place->center.z);
            status = STATUS_OK;
        }
    }
    return status;
}

enum status cal_balls_place(struct calibration *c, const struct capture *capture, const char *out,
                            struct run *run, struct error *err)
{
    enum status status = STATUS_OK;
    for (int i = 0; i < c->balls && !status; i++) {
        const struct capture of_ball = as_sample(capture, place_of(&c->ball[i], capture));
        struct calibration with = *c;
        struct edge *edges = NULL;
        int count = 0;
        with.sample = c->ball[i];
        status = cal_sphere_place(&edges, &count, &with, &of_ball, out, run, err);
        c->ball[i] = with.sample;
        free(edges);
    }
    return status;
}

bool cal_ball_highlight(struct seen_highlight *seen, const struct radiance *map,
                        const struct calibration *c, int ball, int v)
{
    const struct sample *s = &c->ball[ball];
    const struct view *view = &c->view[v];
    struct seen_highlight h;
    if (!cal_highlight_lamp(&h, map, c, s, v))
        return false;
    const vec3 lamp = cal_lamp_position(&c->lamp[view->light], view->view_from_world);
    if (cal_sample_between(&c->sample, cal_eye(view->view_from_world), h.point, 0)
        || cal_sample_between(&c->sample, h.point, lamp, 0))
        return false;
    // A normal that is off by an angle turns what is mirrored by twice that.
    double off = 0;
    for (int k = 0; k < 3; k++)
        off += s->sigma_center[k] * s->sigma_center[k] / 3;
    h.sigma = hypot(h.sigma, 2 * sqrt(off) / s->radius);
    *seen = h;
    return true;
}
