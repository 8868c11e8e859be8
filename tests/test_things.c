/* test_things.c -- balls, rods and boxes beside the sample: mirrors, occluders, gloss. */
#include "film.h"
#include "near.h"

#include <string.h>

static struct scene_lamp lamp;
static struct scene_shot shot;

/** A grey sheet under `lamp`, one thing, and a camera of one pixel; the sample is out of sight. */
static struct scene scene_with(struct thing thing)
{
    struct scene scene = {
        .camera = {.width = 1, .height = 1, .focal = {1e4, 1e4}},
        .lamp = &lamp,
        .lamps = 1,
        .shot = &shot,
        .shots = 1,
        .sample = {.place = {.shape = SHAPE_SPHERE, .radius = 1, .center = {0, 0, -500}}},
        .board = {.size = {600, 600}, .albedo = 0.5, .family = "tag16h5", .thickness = 1e-9},
    };
    scene.things.item[0] = thing;
    scene.things.count = 1;
    return scene;
}

static void pixel(const struct scene *scene, float rgb[3])
{
    struct world world;
    assert_int_equal(sam_world_build(&world, scene, NULL), STATUS_OK);
    assert_int_equal(sam_film_expose(&world, &shot, 1, rgb, NULL), STATUS_OK);
    sam_world_free(&world);
}

/** A camera at the origin of y that looks along y and down by `slope`: x right, y down, z ahead. */
static void stand(double height, double slope)
{
    double tilt = atan(slope);
    vec3 eye = {0, 0, height};
    shot =
        (struct scene_shot){.view_from_world = {.rotation = {CAP_PI / 2 + tilt, 0, 0}}, .power = 1};
    mat3 r = cal_rotation(shot.view_from_world.rotation);
    shot.view_from_world.translation = vec3_scale(mat3_mul(&r, eye), -1);
}

static struct thing box(double y, double z, double half_y, double half_z)
{
    return (struct thing){.shape = THING_BOX,
                          .box = {.center = {0, y, z},
                                  .axis = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                  .half = {100, half_y, half_z}}};
}

static struct thing mirror_wall(void)
{
    struct thing wall = box(201, 100, 1, 90);
    for (int c = 0; c < 3; c++)
        wall.material.mirror[c] = 0.8;
    return wall;
}

// From 100 mm up, 1 down in 4 ahead: the wall is met at height 50 and sends the ray down to the
// sheet below the camera. An upright sun of irradiance 2: L = 0.8 (albedo/pi) 2.
static void test_a_mirror_shows_the_sheet(void **state)
{
    (void)state;
    float rgb[3];
    lamp =
        (struct scene_lamp){.kind = LAMP_DISTANT, .direction = {0, 0, 1}, .intensity = {2, 1, 0.5}};
    struct scene scene = scene_with(mirror_wall());
    stand(100, 0.25);
    pixel(&scene, rgb);
    assert_near(rgb[0], 0.8 * 0.5 / CAP_PI * 2, 1e-7);
    assert_near(rgb[2], 0.8 * 0.5 / CAP_PI * 0.5, 1e-7);
}

// The same camera looking up by 1 in 4 meets the wall at 150 and, back above itself at 200, a lamp
// of radius 6: L = 0.8 I / (pi 6^2).
static void test_a_mirror_shows_the_lamp(void **state)
{
    (void)state;
    float rgb[3];
    lamp = (struct scene_lamp){
        .kind = LAMP_POINT, .position = {0, 0, 200}, .radius = 6, .intensity = {1000, 500, 10}};
    struct scene scene = scene_with(mirror_wall());
    stand(100, -0.25);
    pixel(&scene, rgb);
    assert_near(rgb[0], 0.8 * 1000 / (CAP_PI * 36), 1e-5);
}

// An upright sun and a box at 60 over the spot that is looked at: dark. Beside its shadow: bright.
static void test_a_box_throws_a_shadow(void **state)
{
    (void)state;
    float rgb[3];
    lamp =
        (struct scene_lamp){.kind = LAMP_DISTANT, .direction = {0, 0, 1}, .intensity = {2, 1, 0.5}};
    struct scene scene = scene_with(box(220, 60, 15, 5));
    stand(100, 0.5);  // at 200 on the sheet
    pixel(&scene, rgb);
    assert_near(rgb[0], 0.5 / CAP_PI * 2, 1e-7);
    scene = scene_with(box(210, 60, 15, 5));
    pixel(&scene, rgb);
    assert_near(rgb[0], 0, 0);
}

// The top of a matt ball under a sun above: albedo/pi E, seen from the side at the top's height.
static void test_a_ball_is_shaded_by_its_material(void **state)
{
    (void)state;
    const double grey[] = {0.3, 0.6, 0.9};
    struct thing ball = {.shape = THING_BALL, .rod = {.center = {0, 200, 0}, .radius = 40}};
    ball.material = sam_material(rec_model_find("lambert"), grey);
    float rgb[3];
    lamp =
        (struct scene_lamp){.kind = LAMP_DISTANT, .direction = {0, 0, 1}, .intensity = {2, 2, 2}};
    struct scene scene = scene_with(ball);
    // The ray through the ball's middle meets it where the normal is the way back to the eye.
    stand(200, 1);
    pixel(&scene, rgb);
    for (int c = 0; c < 3; c++)
        assert_near(rgb[c], grey[c] / CAP_PI * 2 * sqrt(0.5), 1e-6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_mirror_shows_the_sheet),
        cmocka_unit_test(test_a_mirror_shows_the_lamp),
        cmocka_unit_test(test_a_box_throws_a_shadow),
        cmocka_unit_test(test_a_ball_is_shaded_by_its_material),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
