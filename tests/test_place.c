/* Where cameras stand: look-at conventions, arcs and spirals. */
#include "near.h"
#include "place.h"

static struct camera pinhole(void)
{
    return (struct camera){.width = 101, .height = 101, .focal = {100, 100}, .center = {50, 50}};
}

static void assert_pixel(pose view, vec3 world, double x, double y)
{
    struct camera camera = pinhole();
    double pixel[2];
    cal_project(&camera, cal_to_view(view, world), pixel);
    assert_near(pixel[0], x, 1e-9);
    assert_near(pixel[1], y, 1e-9);
}

// From the front of the board (-y): its right is right, its up is up, and y = 0 in the image is
// above: rows grow downwards.
static void test_upright_camera(void **state)
{
    (void)state;
    pose view = sam_look_at((vec3){0, -100, 0}, (vec3){0, 0, 0}, 0);
    assert_pixel(view, (vec3){0, 0, 0}, 50, 50);
    assert_pixel(view, (vec3){10, 0, 0}, 60, 50);
    assert_pixel(view, (vec3){0, 0, 10}, 50, 40);
    vec3 eye = cal_eye(view);
    assert_near(eye.y, -100, 1e-9);
}

static void test_from_above_y_is_up(void **state)
{
    (void)state;
    pose view = sam_look_at((vec3){0, 0, 100}, (vec3){0, 0, 0}, 0);
    assert_pixel(view, (vec3){10, 0, 0}, 60, 50);
    assert_pixel(view, (vec3){0, 10, 0}, 50, 40);
}

// Turned by a quarter, what was to the right is below: the scene turns clockwise.
static void test_roll_turns_the_scene_clockwise(void **state)
{
    (void)state;
    pose view = sam_look_at((vec3){0, -100, 0}, (vec3){0, 0, 0}, CAP_PI / 2);
    assert_pixel(view, (vec3){10, 0, 0}, 50, 60);
    assert_pixel(view, (vec3){0, 0, 10}, 60, 50);
}

static void test_eye_and_target_from_everywhere(void **state)
{
    (void)state;
    for (int i = 0; i < 300; i++) {
        vec3 target = {3, -4, 45};
        vec3 eye = sam_around(target, i * 0.7, -1.5 + i * 0.01, 300 + i);
        pose view = sam_look_at(eye, target, i * 0.1);
        assert_near(vec3_length(vec3_sub(cal_eye(view), eye)), 0, 1e-9);
        assert_pixel(view, target, 50, 50);
        assert_near(cal_to_view(view, target).z, 300 + i, 1e-9);
    }
}

static void test_around_goes_over_the_top(void **state)
{
    (void)state;
    double deg = CAP_PI / 180;
    vec3 low = sam_around((vec3){0, 0, 10}, 0, 30 * deg, 2);
    vec3 over = sam_around((vec3){0, 0, 10}, 0, 150 * deg, 2);
    assert_near(low.x, sqrt(3), 1e-12);
    assert_near(over.x, -sqrt(3), 1e-12);
    assert_near(low.z, 11, 1e-12);
    assert_near(over.z, 11, 1e-12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_upright_camera),
        cmocka_unit_test(test_from_above_y_is_up),
        cmocka_unit_test(test_roll_turns_the_scene_clockwise),
        cmocka_unit_test(test_eye_and_target_from_everywhere),
        cmocka_unit_test(test_around_goes_over_the_top),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
