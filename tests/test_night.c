/* test_night.c -- light where the lamp does not reach is measured: in size, and whether it fades.
 */
#include "ball_scene.h"
#include "night.h"

enum { SHOTS = 4 };

// What falls on a place so many degrees beyond the terminator, over the lamp's light.
static double nothing(double below)
{
    (void)below;
    return 0;
}
static double room_light(double below)
{
    (void)below;
    return 0.012;
}
static double comes_through(double below)
{
    return 0.03 * exp(-below / 8);
}

// A white ball; its dark side is lit by `extra`, a different share in each shot.
static void paint(struct scene *s, double (*extra)(double), double share)
{
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            vec3 n, p, wo;
            double pixel[2] = {x, y};
            if (!meet(s, x, y, &n, &p, &wo))
                continue;
            vec3 l = vec3_sub(s->lamp.position, p);
            double r = vec3_length(l), cos_i = vec3_dot(l, n) / r;
            double light = cos_i > 0 ? cos_i : share * extra(asin(-cos_i) * 180 / CAP_PI);
            s->map.value[3 * (y * WIDTH + x) + 1] =
                (float)(light * s->lamp.intensity[1] * s->view.power / (r * r) / CAP_PI
                        * cal_vignetting(&s->camera, pixel));
        }
}

static void add_shot(struct night *night, const struct scene *s)
{
    struct viewing v = rec_viewing(&s->calibration, 0, &s->lens, NULL);
    const pixel_box box = rec_sample_box(&v);
    struct shot_night shot = {0};
    struct strip strip = {0};
    for (strip.y = box.y0; strip.y < box.y1; strip.y++)
        for (strip.x0 = box.x0 / LANES * LANES; strip.x0 < box.x1; strip.x0 += LANES) {
            strip.from = strip.x0 < box.x0 ? box.x0 - strip.x0 : 0;
            strip.to = strip.x0 + LANES > box.x1 ? box.x1 - strip.x0 : LANES;
            rec_strip_make(&strip, &v, &s->map);
            assert_int_equal(rec_night_add(&shot, &strip, &v, &s->map, box, NULL), STATUS_OK);
        }
    rec_night_end_shot(night, &shot);
}

// Shots that show 0.9 to 1.1 of what is meant, so that their mean is what is meant.
static struct night shoot_all(double (*extra)(double))
{
    const double white[] = {1, 1, 1}, share[SHOTS] = {0.9, 1.1, 0.95, 1.05};
    struct night night = {0};
    struct scene *s = make_scene("lambert", white);
    s->lamp.position = (vec3){-400, -450, 250};
    shoot(s);
    for (int k = 0; k < SHOTS; k++) {
        paint(s, extra, share[k]);
        add_shot(&night, s);
    }
    free_scene(s);
    return night;
}

static void test_a_dark_side_is_dark(void **state)
{
    (void)state;
    struct night night = shoot_all(nothing);
    for (int z = 0; z < NIGHT_ZONES; z++) {
        darkness d = rec_darkness(&night, (enum night_zone)z, 0);
        assert_int_equal(d.shots, SHOTS);
        assert_near(d.mean, 0, 1e-9);
    }
}

static void test_room_light_is_the_same_everywhere(void **state)
{
    (void)state;
    struct night night = shoot_all(room_light);
    // The shares' standard deviation is 0.0913; a mean of four has half of it.
    for (int z = 0; z < NIGHT_ZONES; z++) {
        darkness d = rec_darkness(&night, (enum night_zone)z, 0);
        assert_near(d.mean, 0.012, 1e-6);
        assert_near(d.sigma, 0.012 * 0.0913 / 2, 0.012 * 0.001);
    }
}

static void test_what_comes_through_fades(void **state)
{
    (void)state;
    struct night night = shoot_all(comes_through);
    darkness dusk = rec_darkness(&night, ZONE_DUSK, 0), dark = rec_darkness(&night, ZONE_NIGHT, 0);
    // Means lie within what the zones' edges have.
    assert_true(dusk.mean < comes_through(5) && dusk.mean > comes_through(20));
    assert_true(dark.mean < comes_through(40) && dark.mean > comes_through(90));
}

static void test_a_shot_that_does_not_show_it_does_not_count(void **state)
{
    (void)state;
    const double white[] = {1, 1, 1};
    struct night night = {0}, twice = {0};
    struct scene *s = make_scene("lambert", white);
    s->lamp.position = (vec3){0, 0, -10};  // behind the camera
    shoot(s);
    add_shot(&night, s);
    assert_int_equal(rec_darkness(&night, ZONE_NIGHT, 0).shots, 0);
    assert_true(isnan(rec_darkness(&night, ZONE_NIGHT, 0).sigma));
    s->lamp.position = (vec3){-400, -450, 250};
    add_shot(&night, s);
    add_shot(&night, s);
    rec_night_merge(&twice, &night);
    rec_night_merge(&twice, &night);
    assert_int_equal(rec_darkness(&night, ZONE_NIGHT, 0).shots, 2);
    assert_int_equal(rec_darkness(&twice, ZONE_NIGHT, 0).shots, 4);
    free_scene(s);
}

// What the board sends is taken off, and its error is the shots' to share.
static void test_the_boards_light_has_an_error(void **state)
{
    (void)state;
    const int64_t unit = 1 << 30;
    struct night night = {.dark[ZONE_DUSK] = {4, 0, 0},
                          .bounced[ZONE_DUSK] = {4, 4 * unit / 100, 0}};
    assert_near(rec_darkness(&night, ZONE_DUSK, 0.1).sigma, 0.001, 1e-9);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_dark_side_is_dark),
        cmocka_unit_test(test_room_light_is_the_same_everywhere),
        cmocka_unit_test(test_what_comes_through_fades),
        cmocka_unit_test(test_a_shot_that_does_not_show_it_does_not_count),
        cmocka_unit_test(test_the_boards_light_has_an_error),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
