/* test_balls.c -- a ball beside the sample: its place, what it mirrors, and what it hides. */
#include "balls.h"

#include "cues.h"
#include "painted.h"
#include "solid.h"
#include "view_map.h"

static const struct sample sample = {.shape = SHAPE_SPHERE, .radius = 16, .center = {22, -2, 34}};
static const struct sample ball = {.shape = SHAPE_SPHERE, .radius = 12, .center = {-24, 4, 12}};
static const vec3 lamp_at = {-180, -420, 330};
static const double LOBE = 0.1;  // rad, of what the ball mirrors

/** A matte sample and a mirror-like ball on gray paper. */
static double radiance_along(const void *unused, vec3 eye, vec3 ray)
{
    (void)unused;
    solid_hit on[2] = {cal_solid_meet(&sample, eye, ray), cal_solid_meet(&ball, eye, ray)};
    if (on[0].s == INFINITY && on[1].s == INFINITY)
        return ray.z < 0 ? 0.3 : 0.01;
    const bool mirrors = on[1].s < on[0].s;
    vec3 p = vec3_add(eye, vec3_scale(ray, on[mirrors].s)), n = on[mirrors].normal;
    vec3 to_lamp = vec3_normalize(vec3_sub(lamp_at, p));
    if (!mirrors)
        return fmax(0.5 * vec3_dot(n, to_lamp), 0);
    double off = vec3_length(vec3_sub(cal_mirror(n, vec3_scale(ray, -1)), to_lamp));
    return 0.02 + 40 * exp(-0.5 * off * off / (LOBE * LOBE));
}

/** Photographs with the sample placed, and one lamp, its place not known. */
static struct shooting *photographs(struct lamp *lamp)
{
    static struct shooting s;
    shoot(&s, radiance_along, NULL);
    *lamp = (struct lamp){.name = "lamp", .position = lamp_at};
    s.c.lamp = lamp;
    s.c.lamps = 1;
    s.c.sample = sample;
    return &s;
}

static struct capture said(vec3 off)
{
    return (struct capture){.ball = {{.radius = ball.radius,
                                      .radius_sigma = 0.06,
                                      .center = vec3_add(ball.center, off)}},
                            .balls = 1};
}

static void test_it_shows_where_the_lamp_is(void **state)
{
    (void)state;
    struct lamp lamp;
    struct shooting *s = photographs(&lamp);
    struct capture capture = said((vec3){0.8, -0.6, 0.5});
    assert_int_equal(cal_balls_start(&s->c, &capture, s->folder, &s->run, NULL), STATUS_OK);
    assert_int_equal(cal_balls_place(&s->c, &capture, s->folder, &s->run, NULL), STATUS_OK);
    assert_int_equal(s->c.balls, 1);
    assert_int_equal(s->run.warnings, 0);
    assert_near(vec3_length(vec3_sub(s->c.ball[0].center, ball.center)), 0, 0.1);  // 0.2 pixels
    int seen = 0;
    for (int v = 0; v < s->c.views; v++) {
        struct radiance map;
        struct seen_highlight h;
        assert_int_equal(cal_view_map(&map, s->folder, &s->c.view[v], NULL), STATUS_OK);
        if (cal_ball_highlight(&h, &map, &s->c, 0, v)) {
            vec3 true_wi = vec3_normalize(vec3_sub(lamp_at, h.point));
            assert_near(vec3_length(vec3_sub(h.wi, true_wi)), 0, fmin(3 * h.sigma, 0.03));
            seen++;
        }
        cap_radiance_free(&map);
    }
    assert_true(seen >= 4);
    clear_up(s);
}

static void test_one_that_is_not_there_is_left_out(void **state)
{
    (void)state;
    struct lamp lamp;
    struct shooting *s = photographs(&lamp);
    struct capture capture = said((vec3){10, 45, 20});
    assert_int_equal(cal_balls_start(&s->c, &capture, s->folder, &s->run, NULL), STATUS_OK);
    assert_int_equal(s->c.balls, 0);
    assert_int_equal(s->run.warnings, 1);
    clear_up(s);
}

static void test_it_hides_what_is_behind_it(void **state)
{
    (void)state;
    struct calibration c = {.sample = sample, .ball = {ball}, .balls = 1};
    vec3 above = {-24, 4, 90}, below = {-24, 4, 0}, clear = {-50, 4, 0};
    assert_true(cal_ball_between(&c, above, below, 0));
    assert_true(cal_in_the_way(&c, above, below, 0));
    assert_false(cal_in_the_way(&c, (vec3){-50, 4, 90}, clear, 2));
    assert_true(cal_in_the_way(&c, (vec3){22, -2, 90}, (vec3){22, -2, 0}, 0));  // the sample does
    assert_false(cal_ball_between(&c, (vec3){22, -2, 90}, (vec3){22, -2, 0}, 0));
}

static void test_a_ball_that_disagrees_is_named(void **state)
{
    (void)state;
    struct run run = {.threads = 1, .quiet = true};
    struct lamp lamp = {.name = "left",
                        .cue = {[CUE_JOINT] = {.direction = {0, 0, 1}, .sigma = 0.001},
                                [CUE_BALL] = {.direction = {0, 0.004, 1}, .sigma = 0.002}}};
    cal_cues_compare(&lamp, &run);
    assert_int_equal(run.warnings, 0);
    lamp.cue[CUE_BALL].direction.y = 0.02;
    cal_cues_compare(&lamp, &run);
    assert_int_equal(run.warnings, 1);
    assert_non_null(strstr(run.warning[0], "lamp left: its direction by ball alone"));
    cap_run_end(&run);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_it_shows_where_the_lamp_is),
        cmocka_unit_test(test_one_that_is_not_there_is_left_out),
        cmocka_unit_test(test_it_hides_what_is_behind_it),
        cmocka_unit_test(test_a_ball_that_disagrees_is_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
