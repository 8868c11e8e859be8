/* Lamps: points, balls, distant ones, on the camera; by numbers from the textbook. */
#include "light.h"
#include "near.h"
#include "place.h"

static struct scene one_lamp(struct scene_lamp *lamp)
{
    return (struct scene){.lamp = lamp, .lamps = 1};
}

static struct lighting lit_by(struct scene_lamp lamp, pose view)
{
    struct scene scene = one_lamp(&lamp);
    struct scene_shot shot = {.view_from_world = view, .power = 2};
    return sam_lighting(&scene, &shot);
}

static void test_a_point_falls_with_the_square(void **state)
{
    (void)state;
    struct lighting l = lit_by((struct scene_lamp){.position = {0, 3, 4}, .intensity = {50, 5, 1}},
                               (pose){{0, 0, 0}, {0, 0, 0}});
    struct incidence in = sam_light_part(&l, (vec3){0, 0, 0}, 0, 1);
    assert_near(in.distance, 5, 1e-15);
    assert_near(in.wi.z, 0.8, 1e-15);
    assert_near(in.irradiance[0], 2 * 50 / 25.0, 1e-15);
    assert_near(in.irradiance[2], 2 * 1 / 25.0, 1e-15);
}

static void test_a_distant_lamp_is_the_same_everywhere(void **state)
{
    (void)state;
    struct lighting l = lit_by((struct scene_lamp){.kind = LAMP_DISTANT,
                                                   .direction = {0, 0.6, 0.8},
                                                   .intensity = {3, 3, 3}},
                               (pose){{0, 0, 0}, {0, 0, 0}});
    struct incidence in = sam_light_part(&l, (vec3){500, -90, 70}, 0, 1);
    assert_true(in.distance == INFINITY);
    assert_near(in.wi.y, 0.6, 0);
    assert_near(in.irradiance[1], 6, 0);
}

// A ball that is wholly above the horizon lights a surface like a point in its middle:
// I cos / r^2 exactly (a sphere's vector irradiance is that of its centre).
static void test_a_ball_lights_like_its_middle(void **state)
{
    (void)state;
    for (int k = 0; k < 5; k++) {
        struct lighting l = lit_by((struct scene_lamp){.position = {30, 0, 40},
                                                       .radius = 4.0 * k,
                                                       .intensity = {100, 100, 100}},
                                   (pose){{0, 0, 0}, {0, 0, 0}});
        double sum = 0;
        for (int i = 0; i < LIGHT_SAMPLES; i++) {
            struct incidence in = sam_light_part(&l, (vec3){0, 0, 0}, i, LIGHT_SAMPLES);
            assert_near(vec3_length(in.wi), 1, 1e-14);
            sum += in.irradiance[0] * in.wi.z;
        }
        double sine = 4.0 * k / 50;
        // The mean cosine over the cone is exact, the spiral's azimuths nearly balance.
        assert_near(sum, 200 * 0.8 / 2500, 200 / 2500.0 * 0.6 * sine * 0.05 + 1e-16);
    }
}

// Turned by 60 degrees from its beam, a lamp of exponent 2 keeps a quarter.
static void test_fall_off(void **state)
{
    (void)state;
    struct lighting l = lit_by((struct scene_lamp){.position = {0, 0, 10},
                                                   .intensity = {100, 100, 100},
                                                   .beam = {sqrt(0.75), 0, -0.5},
                                                   .beam_exponent = 2},
                               (pose){{0, 0, 0}, {0, 0, 0}});
    struct incidence in = sam_light_part(&l, (vec3){0, 0, 0}, 0, 1);
    assert_near(in.irradiance[0], 2 * 100 / 100.0 / 4, 1e-14);
    in = sam_light_part(&l, (vec3){-100, 0, 10}, 0, 1);  // behind it
    assert_near(in.irradiance[0], 0, 0);
}

// A flash 50 mm to the right of a camera that looks along the world's -z from z = 400, upright.
static void test_a_lamp_on_the_camera_goes_with_it(void **state)
{
    (void)state;
    pose view = sam_look_at((vec3){0, 0, 400}, (vec3){0, 0, 0}, 0);
    struct lighting l = lit_by(
        (struct scene_lamp){
            .on_camera = true, .position = {50, 0, 0}, .beam = {0, 0, 1}, .intensity = {1, 1, 1}},
        view);
    assert_near(l.position.x, 50, 1e-9);
    assert_near(l.position.z, 400, 1e-9);
    assert_near(l.beam.z, -1, 1e-12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_point_falls_with_the_square),
        cmocka_unit_test(test_a_distant_lamp_is_the_same_everywhere),
        cmocka_unit_test(test_a_ball_lights_like_its_middle),
        cmocka_unit_test(test_fall_off),
        cmocka_unit_test(test_a_lamp_on_the_camera_goes_with_it),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
