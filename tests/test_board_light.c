/* test_board_light.c -- light between board and sample, against closed forms. */
#include "board_light.h"
#include "sample_light.h"

#include "near.h"

#include <stdlib.h>
#include <string.h>

/** A matte ball of the given albedo under one lamp far along +x, seen by one view. */
struct scene {
    struct calibration calibration;
    struct camera camera;
    struct view view;
    struct lamp lamp;
};

static void make_scene(struct scene *s, double albedo)
{
    double lobe[LOBE_SIZE];
    const double start[3] = {albedo, albedo, albedo};
    *s = (struct scene){.camera = {.focal = {1000, 1000}}, .view = {.name = "v", .power = 1}};
    s->view.view_from_world.translation.z = 1000;
    s->lamp = (struct lamp){.position = {1e5, 0, 0}, .intensity = {1e10, 1e10, 1e10}};
    s->calibration = (struct calibration){.camera = &s->camera,
                                          .cameras = 1,
                                          .view = &s->view,
                                          .views = 1,
                                          .lamp = &s->lamp,
                                          .lamps = 1,
                                          .sample = {.shape = SHAPE_SPHERE, .radius = 20}};
    struct surroundings *around = &s->calibration.surroundings;
    around->strength = 1;
    around->has_lobe = true;
    cal_lobe_start(lobe, start);
    cal_lobe_tabulate(&around->lobe, lobe);
    for (int k = 0; k <= LOBE_TABLE; k++)
        around->lobe.distribution[k] = 0;  // no gloss: f is albedo/pi exactly
    memcpy(around->lobe.matte, around->lobe.diffuse, sizeof around->lobe.matte);
}

static void test_one_cell_is_the_form_factor(void **state)
{
    (void)state;
    struct scene s;
    make_scene(&s, 0.5);
    // 2 mm square, 100 mm above the point, both facing: L = albedo/pi B A / d^2
    struct glow cell = {.point = {0, 0, 100},
                        .normal = {0, 0, -1},
                        .x = {1, 0, 0},
                        .side = 2,
                        .radiance = {3, 2, 1}};
    s.calibration.surroundings.glow = &cell;
    s.calibration.surroundings.count = 1;
    double radiance[3];
    cal_bounce(&s.calibration, 0, (vec3){0, 0, 0}, (vec3){0, 0, 1}, (vec3){0.6, 0, 0.8}, radiance);
    for (int c = 0; c < 3; c++)
        assert_near(radiance[c], 0.5 / CAP_PI * cell.radiance[c] * 4 / 1e4, 1e-9);
    // behind the point, or seen from its own back, it gives nothing
    cal_bounce(&s.calibration, 0, (vec3){0, 0, 0}, (vec3){0, 0, -1}, (vec3){0, 0, -1}, radiance);
    assert_near(radiance[0], 0, 0);
    cal_bounce(&s.calibration, 0, (vec3){0, 0, 200}, (vec3){0, 0, -1}, (vec3){0, 0, -1}, radiance);
    assert_near(radiance[0], 0, 0);
}

static void test_a_wide_plane_fills_the_sky(void **state)
{
    (void)state;
    enum { N = 201 };
    struct scene s;
    make_scene(&s, 0.3);
    struct glow *cell = calloc(N * N, sizeof *cell);
    assert_non_null(cell);
    for (int i = 0; i < N * N; i++)
        cell[i] =
            (struct glow){.point = {5.0 * (i % N - N / 2), 5.0 * (i / N - N / 2), 0},  // NOLINT
                          .normal = {0, 0, 1},
                          .x = {1, 0, 0},
                          .side = 5,
                          .radiance = {1, 1, 1}};
    s.calibration.surroundings.glow = cell;
    s.calibration.surroundings.count = N * N;
    double radiance[3];
    cal_bounce(&s.calibration, 0, (vec3){0, 0, 20}, (vec3){0, 0, -1}, (vec3){0, 0, -1}, radiance);
    // Irradiance pi B but for what is missing beyond 500 mm: (20/500)^2, at most; so L = albedo B
    assert_near(radiance[0], 0.3, 0.3 * 0.004);
    free(cell);
}

static void test_a_matte_ball_from_the_lamp(void **state)
{
    (void)state;
    struct scene s;
    make_scene(&s, 0.6);
    double radiance[ECHOES][3];
    // Full moon: intensity 2/3 albedo E R^2, E = I/r^2; a surface at d gets that over d^2, and a
    // white one of albedo 1 shines with that over pi.
    double irradiance = 1e10 / 1e10, distance = 2000;
    double due = 2.0 / 3 * 0.6 * irradiance * 400 / (distance * distance) / CAP_PI;
    cal_sample_light(&s.calibration, NULL, 0, (vec3){distance, 0, 0}, (vec3){-1, 0, 0}, radiance);
    assert_near(radiance[ECHO_MATTE][0] / due, 1, 0.02);  // 400 points on the ball; d is 100 radii
    cal_sample_light(&s.calibration, NULL, 0, (vec3){-distance, 0, 0}, (vec3){1, 0, 0}, radiance);
    assert_near(radiance[ECHO_MATTE][0] / due, 0, 0.01);  // new moon
    assert_near(radiance[ECHO_GLOSS][0] / due, 0, 1e-4);
}

// A small mirror ball in an even beam E sends E R^2/4 into every direction, and what its
// reflectance is face on and at the rim adds up to all.
static void test_a_mirror_ball_from_the_lamp(void **state)
{
    (void)state;
    struct scene s;
    make_scene(&s, 0.6);
    double face_on[3], rim[3], distance = 4000, irradiance = 1e10 / 1e10;
    double due = irradiance * 400 / 4 / (distance * distance) / CAP_PI;
    cal_mirror_light(&s.calibration, NULL, 0, (vec3){distance, 0, 0}, (vec3){-1, 0, 0}, face_on,
                     rim);
    assert_near(face_on[0] / due, 1, 0.02);  // the ball is 1/200 of the distance, the lamp 25 away
    assert_near(rim[0] / due, 0, 1e-3);
    cal_mirror_light(&s.calibration, NULL, 0, (vec3){-distance, 0, distance / 4}, (vec3){1, 0, 0},
                     face_on, rim);
    double cosine = 1 / sqrt(1 + 1.0 / 16), d2 = distance * distance * (1 + 1.0 / 16);
    due = irradiance * 400 / 4 / d2 * cosine / CAP_PI;
    assert_near((face_on[0] + rim[0]) / due, 1, 0.02);
    assert_true(rim[0] > 0.3 * face_on[0]);  // it is met at 83 degrees
}

static void test_strength_is_what_the_night_side_shows(void **state)
{
    (void)state;
    enum { FACETS = 200 };
    struct scene s;
    make_scene(&s, 0.4);
    struct glow cell = {.point = {-100, 0, 0},
                        .normal = {1, 0, 0},
                        .x = {0, 1, 0},
                        .side = 50,
                        .radiance = {1, 1, 1}};
    s.calibration.surroundings.glow = &cell;
    s.calibration.surroundings.count = 1;
    struct facet facet[FACETS];
    struct facets facets = {facet, FACETS, FACETS};
    s.view.view_from_world.translation = (vec3){0, 0, 1000};  // the eye is at z = -1000
    for (int i = 0; i < FACETS; i++) {
        double a = 0.7 * i / FACETS;  // around the ball's -x, towards the eye
        vec3 n = {-cos(a + 0.7), 0, -sin(a + 0.7)};
        facet[i] =
            (struct facet){.normal = n, .point = vec3_scale(n, 20), .noise = {1e-9, 1e-9, 1e-9}};
        double radiance[3];
        vec3 wo = vec3_normalize(vec3_sub((vec3){0, 0, -1000}, facet[i].point));
        cal_bounce(&s.calibration, 0, facet[i].point, n, wo, radiance);
        for (int c = 0; c < 3; c++)
            facet[i].mean[c] = 0.7 * radiance[c];
    }
    struct run run;
    cap_run_begin(&run, 1, true);
    assert_int_equal(cal_board_light_strength(&s.calibration, &facets, &run, NULL), STATUS_OK);
    assert_near(s.calibration.surroundings.strength, 0.7, 1e-6);
    for (int i = 0; i < FACETS; i++)
        memset(facet[i].mean, 0, sizeof facet[i].mean);
    assert_int_equal(cal_board_light_strength(&s.calibration, &facets, &run, NULL), STATUS_OK);
    assert_near(s.calibration.surroundings.strength, 0, 0);  // direct light alone
    cap_run_end(&run);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_one_cell_is_the_form_factor),
        cmocka_unit_test(test_a_wide_plane_fills_the_sky),
        cmocka_unit_test(test_a_matte_ball_from_the_lamp),
        cmocka_unit_test(test_a_mirror_ball_from_the_lamp),
        cmocka_unit_test(test_strength_is_what_the_night_side_shows),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
