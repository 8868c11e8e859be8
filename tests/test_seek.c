/* test_seek.c -- a sample found in painted photographs, far from where it is said to be. */
#include "seek.h"

#include "painted.h"
#include "sample_start.h"
#include "slopes.h"

static const struct sample ball = {.shape = SHAPE_SPHERE, .radius = 16, .center = {1.5, -2, 38}};
static const struct sample rod = {.shape = SHAPE_CYLINDER,
                                  .radius = 12,
                                  .height = 44,
                                  .center = {4, -2, 36},
                                  .axis = {0.97, 0.2, 0.138}};

/** Half a chessboard of dark and bright squares, its edges as clear as the sample's; night around
 *  it. */
static double ground(vec3 p)
{
    if (fabs(p.x) > 90 || fabs(p.y) > 70)
        return 0.01;
    if (fabs(p.x) < 50 && fabs(p.y) < 40)
        return 0.5;
    return ((int)floor(p.x / 14) + (int)floor(p.y / 14)) % 2 ? 0.9 : 0.1;
}

/** What a ray sees: the sample, lit from one side only, before the board. */
static double radiance_along(const void *sample, vec3 eye, vec3 ray)
{
    static const vec3 light = {-0.36, -0.48, 0.8};
    solid_hit hit = cal_solid_meet(sample, eye, ray);
    if (hit.s < INFINITY)
        return hit.cap ? 0.02 : fmax(0.4 * vec3_dot(hit.normal, light), 0);
    return ray.z < 0 ? ground(vec3_add(eye, vec3_scale(ray, -eye.z / ray.z))) : 0.01;
}

/** The best place, from a nominal one that is off. */
static struct place best(const struct shooting *s, const struct sample *from, int threads)
{
    struct run run = {.threads = threads, .quiet = true};
    struct seek *seek;
    struct place place[PLACES];
    int count = 0;
    assert_int_equal(cal_seek_begin(&seek, &s->c, from, s->folder, &run, NULL), STATUS_OK);
    assert_int_equal(cal_seek_find(place, &count, seek, from, 42, 0, &run, NULL), STATUS_OK);
    cal_seek_end(seek);
    assert_true(count >= 1);
    return place[0];
}

static void test_a_ball_is_found_from_far_off(void **state)
{
    (void)state;
    static const vec3 off[] = {{-30, -35, 10}, {5, 10, 40}};
    struct shooting s;
    shoot(&s, radiance_along, &ball);
    for (size_t k = 0; k < sizeof off / sizeof *off; k++) {
        struct sample from = ball;
        from.center = vec3_add(ball.center, off[k]);
        struct place p = best(&s, &from, 2), q = best(&s, &from, 3);
        assert_near(vec3_length(vec3_add(p.shift, off[k])), 0, 0.15 * ball.radius);
        assert_near(vec3_length(p.turn), 0, 0);
        assert_memory_equal(&p.shift, &q.shift, sizeof p.shift);  // for any number of threads
    }
    clear_up(&s);
}

static void test_a_cylinder_too_and_how_it_is_turned(void **state)
{
    (void)state;
    struct shooting s;
    struct sample from = rod;
    vec3 off = {-35, 20, 15};
    shoot(&s, radiance_along, &rod);
    assert_int_equal(cal_solid_move(&from, (vec3){0, 0.1, -0.12}, off, NULL), STATUS_OK);
    struct place p = best(&s, &from, 2);
    assert_int_equal(cal_solid_move(&from, p.turn, p.shift, NULL), STATUS_OK);
    assert_near(vec3_length(vec3_sub(from.center, rod.center)), 0, 0.15 * cal_solid_reach(&rod));
    assert_near(vec3_length(vec3_cross(from.axis, vec3_normalize(rod.axis))), 0, 0.08);
    clear_up(&s);
}

/** From a wrong capture.yaml to a pixel of the outline: a third of a millimetre here. -> warnings.
 */
static int start(const struct shooting *s, vec3 off, double radius)
{
    struct calibration c = s->c;
    struct board_tag tag[4] = {0};
    struct capture capture = {.sample = {.shape = SHAPE_SPHERE,
                                         .center = vec3_add(ball.center, off),
                                         .radius = radius * ball.radius,
                                         .radius_sigma = 0.005 * radius * ball.radius}};
    struct solid_prior prior = {0};
    struct run run = s->run;
    for (int k = 0; k < 4; k++)
        tag[k].place = (struct tag_place){.size = 20,
                                          .center = {k % 2 ? 80 : -80, k < 2 ? 60 : -60, 0},
                                          .x_axis = {1, 0, 0},
                                          .y_axis = {0, 1, 0}};
    c.tag = tag;
    c.tags = 4;
    assert_int_equal(cal_sample_start(&c, &prior, &capture, s->folder, &run, NULL), STATUS_OK);
    assert_near(vec3_length(vec3_sub(c.sample.center, ball.center)), 0, 1);
    assert_near(c.sample.radius, ball.radius, (radius == 1 ? 0 : 0.02) * ball.radius);
    int warnings = run.warnings;
    cap_run_end(&run);
    return warnings;
}

static void test_it_starts_where_its_outline_is(void **state)
{
    (void)state;
    struct shooting s;
    shoot(&s, radiance_along, &ball);
    assert_int_equal(start(&s, (vec3){1, -1, 1}, 1), 0);
    assert_int_equal(start(&s, (vec3){14, -9, 6}, 1), 1);    // nearby
    assert_int_equal(start(&s, (vec3){-60, 45, 20}, 1), 1);  // half the board away
    assert_int_equal(start(&s, (vec3){1, 0, 1}, 1.05), 0);   // a radius that is wrong
    clear_up(&s);
}

// A bright square before dark, blocks of two photosites.
static void test_slopes_know_the_way_of_an_edge(void **state)
{
    (void)state;
    enum { SIDE = 60 };
    struct radiance map = {.width = SIDE, .height = SIDE, .channels = 3};
    struct slopes slopes;
    map.value = calloc(3 * SIDE * SIDE, sizeof *map.value);
    map.variance = calloc(3 * SIDE * SIDE, sizeof *map.variance);
    for (int i = 0; i < SIDE * SIDE; i++)
        for (int k = 0; k < 3; k++)
            map.value[3 * i + k] = i % SIDE < 30 ? 1 : 0.3F;
    assert_int_equal(cal_slopes_make(&slopes, &map, 2, NULL), STATUS_OK);
    const double on[2] = {29.5, 20}, off[2] = {10, 20}, outside[2] = {-3, 20};
    const double across[2] = {-1, 0}, along[2] = {0, 1}, slanting[2] = {0.6, 0.8};
    assert_true(cal_slopes_edge(&slopes, on, across) > 0.8);
    assert_near(cal_slopes_edge(&slopes, on, along), 0, 0);
    assert_near(cal_slopes_edge(&slopes, on, slanting), 0, 0);
    assert_near(cal_slopes_edge(&slopes, off, across), 0, 0);
    assert_near(cal_slopes_edge(&slopes, outside, across), -1, 0);
    cal_slopes_free(&slopes);
    cap_radiance_free(&map);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_slopes_know_the_way_of_an_edge),
        cmocka_unit_test(test_a_ball_is_found_from_far_off),
        cmocka_unit_test(test_a_cylinder_too_and_how_it_is_turned),
        cmocka_unit_test(test_it_starts_where_its_outline_is),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
