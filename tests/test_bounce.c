/* Interreflection, where radiometry has it in closed form. */
#include "bounce.h"
#include "near.h"

static struct scene_lamp sun = {
    .kind = LAMP_DISTANT, .direction = {0, 0.8660254037844386, 0.5}, .intensity = {2, 1, 0.5}};
static const double colour[] = {0.9, 0.6, 0.3};
static struct scene_shot shot = {.power = 1};

/** A matt ball high over an even sheet, under a low sun: its shadow falls beside the sheet. */
static struct scene ball_over_sheet(double radius, double height, double side)
{
    struct scene scene = {
        .lamp = &sun,
        .lamps = 1,
        .shot = &shot,
        .shots = 1,
        .bounces = 1,
        .sample = {.place = {.shape = SHAPE_SPHERE, .radius = radius, .center = {0, 0, height}},
                   .material = sam_material(rec_model_find("lambert"), colour)},
        .board = {.size = {side, side}, .albedo = 0.5, .family = "tag16h5", .thickness = 0.001},
    };
    return scene;
}

/** View factor from a small piece that faces the middle of a square from a height; the sum of four
 *  rectangles with a corner below it (Howell, A Catalog of Radiation Heat Transfer Configuration
 *  Factors, B-3). */
static double view_factor(double side, double height)
{
    double a = side / 2, r = hypot(a, height);
    return 4 / (2 * CAP_PI) * 2 * (a / r) * atan(a / r);
}

static void build(struct scene *scene, vec3 eye, struct world *world, struct shot_view *view,
                  struct bounce *bounce)
{
    shot.view_from_world = (pose){{0, 0, 0}, vec3_scale(eye, -1)};
    assert_int_equal(sam_world_build(world, scene, NULL), STATUS_OK);
    *view = sam_shot_view(world, &shot);
    assert_int_equal(sam_bounce_build(bounce, view, 2, NULL), STATUS_OK);
}

// L = rho_ball/pi F rho_sheet E cos: seen from below, where only the sheet lights the ball.
static void test_a_square_sheet_lights_the_ball(void **state)
{
    (void)state;
    struct scene scene = ball_over_sheet(10, 100, 120);
    struct world world;
    struct shot_view view;
    struct bounce bounce;
    build(&scene, (vec3){0, 0, -400}, &world, &view, &bounce);
    struct spot bottom = {.matter = MATTER_SAMPLE, .point = {0, 0, 90}, .normal = {0, 0, -1}};
    double rgb[3] = {0, 0, 0};
    sam_bounce_add(&bounce, &bottom, rgb);
    for (int c = 0; c < 3; c++) {
        double expected =
            colour[c] / CAP_PI * view_factor(120, 90 + 0.001) * 0.5 * sun.intensity[c] * 0.5;
        assert_near(rgb[c], expected, 1e-3 * expected);
    }
    sam_bounce_free(&bounce);
    sam_world_free(&world);
}

// A small matt ball under an even beam of irradiance E shines at the angle alpha from the lamp with
// the intensity 2/3 rho/pi E R^2 (sin a + (pi - a) cos a): Lambert's sphere.
static void test_the_ball_lights_the_sheet(void **state)
{
    (void)state;
    struct scene scene = ball_over_sheet(0.1, 100, 120);
    struct world world;
    struct shot_view view;
    struct bounce bounce;
    build(&scene, (vec3){0, 0, -400}, &world, &view, &bounce);
    static const vec3 places[] = {{0, 0, 0}, {30, 20, 0}, {-25, 40, 0}, {10, -50, 0}};
    for (int i = 0; i < 4; i++) {
        struct spot spot = {
            .matter = MATTER_SHEET, .point = places[i], .normal = {0, 0, 1}, .albedo = 0.5};
        double rgb[3] = {0, 0, 0};
        sam_bounce_add(&bounce, &spot, rgb);
        vec3 to = vec3_sub(places[i], scene.sample.place.center);
        double d = vec3_length(to), a = acos(vec3_dot(to, sun.direction) / d);
        for (int c = 0; c < 3; c++) {
            double intensity = 2.0 / 3 * colour[c] / CAP_PI * sun.intensity[c] * 0.01
                               * (sin(a) + (CAP_PI - a) * cos(a));
            double expected = 0.5 / CAP_PI * intensity * 100 / (d * d * d);
            // The ball is 1e-3 of the distance in radius, which shifts its crescent by twice that.
            assert_near(rgb[c], expected, 3e-3 * expected);
        }
    }
    sam_bounce_free(&bounce);
    sam_world_free(&world);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_square_sheet_lights_the_ball),
        cmocka_unit_test(test_the_ball_lights_the_sheet),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
