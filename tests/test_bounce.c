/* Interreflection, where radiometry has it in closed form. */
#include "bounce.h"
#include "bounce_ball.h"
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
    struct scene scene = ball_over_sheet(10, 50, 60);
    struct world world;
    struct shot_view view;
    struct bounce bounce;
    build(&scene, (vec3){0, 0, -400}, &world, &view, &bounce);
    struct spot bottom = {.matter = MATTER_SAMPLE, .point = {0, 0, 40}, .normal = {0, 0, -1}};
    double rgb[3] = {0, 0, 0};
    sam_bounce_add(&bounce, &bottom, rgb);
    for (int c = 0; c < 3; c++) {
        double expected =
            colour[c] / CAP_PI * view_factor(60, 40 + 0.001) * 0.5 * sun.intensity[c] * 0.5;
        assert_near(rgb[c], expected, 1e-3 * expected);
    }
    sam_bounce_free(&bounce);
    sam_world_free(&world);
}

/** What a ball of radius 0.1, 100 above the sheet, sends to a place of it. */
static void thrown(struct scene *scene, vec3 place, double irradiance[3])
{
    struct world world;
    shot.view_from_world = (pose){{0, 0, 0}, {0, 0, 400}};
    assert_int_equal(sam_world_build(&world, scene, NULL), STATUS_OK);
    struct shot_view view = sam_shot_view(&world, &shot);
    irradiance[0] = irradiance[1] = irradiance[2] = 0;
    sam_ball_throws(&view, place, irradiance);
    sam_world_free(&world);
}

// A small matt ball under an even beam of irradiance E shines at the angle alpha from the lamp with
// the intensity 2/3 rho/pi E R^2 (sin a + (pi - a) cos a): Lambert's sphere.
static void test_a_matt_ball_lights_the_sheet(void **state)
{
    (void)state;
    struct scene scene = ball_over_sheet(0.1, 100, 120);
    static const vec3 places[] = {{0, 0, 0}, {30, 20, 0}, {-25, 40, 0}, {10, -50, 0}};
    for (int i = 0; i < 4; i++) {
        double rgb[3];
        thrown(&scene, places[i], rgb);
        vec3 to = vec3_sub(places[i], scene.sample.place.center);
        double d = vec3_length(to), a = acos(vec3_dot(to, sun.direction) / d);
        for (int c = 0; c < 3; c++) {
            double intensity = 2.0 / 3 * colour[c] / CAP_PI * sun.intensity[c] * 0.01
                               * (sin(a) + (CAP_PI - a) * cos(a));
            double expected = intensity * 100 / (d * d * d);
            // The ball is 1e-3 of the distance in radius, which shifts its crescent by twice that;
            // and of a thin crescent few pieces are lit.
            assert_near(rgb[c], expected, 0.01 * expected);
        }
    }
}

// A small ball that mirrors all light sends it evenly everywhere: intensity E R^2 / 4. Its lobe is
// far narrower than any even spread of points would meet; 1 % of the light is in its wide tails.
static void test_a_mirror_ball_lights_the_sheet(void **state)
{
    (void)state;
    static const double all[] = {0, 0, 0, 1, 1, 1, 0.01, 1};  // albedo, f0, alpha, edge
    struct scene scene = ball_over_sheet(0.1, 100, 120);
    scene.sample.material = sam_material(rec_model_find("ggx_schlick"), all);
    static const vec3 places[] = {{0, 0, 0}, {30, 20, 0}, {-25, 40, 0}, {10, 50, 0}};
    for (int i = 0; i < 4; i++) {
        double rgb[3], d = vec3_length(vec3_sub(places[i], (vec3){0, 0, 100}));
        thrown(&scene, places[i], rgb);
        for (int c = 0; c < 3; c++) {
            double expected = sun.intensity[c] * 0.01 / 4 * 100 / (d * d * d);
            assert_near(rgb[c], expected, 0.02 * expected);
        }
    }
}

// A matt ball over an endless sheet of radiance B gets pi B (1 + cos t)/2 where its normal is at t
// from straight down; so straight down it shines with rho B R^2 pi (1/2 + 1/3).
static void test_the_boards_light_comes_back(void **state)
{
    (void)state;
    struct scene scene = ball_over_sheet(0.1, 100, 120);
    struct world world;
    const double radiance[3] = {1, 2, 3}, wide = 1e6;
    const struct board_glow endless = {-wide / 2, -wide / 2, wide, 1, 1, radiance};
    shot.view_from_world = (pose){{0, 0, 0}, {0, 0, 400}};
    assert_int_equal(sam_world_build(&world, &scene, NULL), STATUS_OK);
    struct shot_view view = sam_shot_view(&world, &shot);
    double irradiance[3] = {0, 0, 0};
    sam_ball_returns(&view, &endless, (vec3){0, 0, 0}, irradiance);
    for (int c = 0; c < 3; c++) {
        double expected = colour[c] * radiance[c] * 0.01 * CAP_PI * 5 / 6 / 1e4;
        // A piece's light is a sum over 36 rings of 20 directions.
        assert_near(irradiance[c], expected, 0.01 * expected);
    }
    sam_world_free(&world);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_mirror_ball_lights_the_sheet),
        cmocka_unit_test(test_the_boards_light_comes_back),
        cmocka_unit_test(test_a_square_sheet_lights_the_ball),
        cmocka_unit_test(test_a_matt_ball_lights_the_sheet),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
