/* test_camera.c -- poses, the lens, and their derivatives. */
#include "lens.h"
#include "near.h"

#include <string.h>

static const double DEG = CAP_PI / 180;

// A strong lens: 40 % of barrel at the corner, decentred.
static const struct camera strong = {.width = 1200,
                                     .height = 800,
                                     .focal = {700, 720},
                                     .center = {610, 390},
                                     .distortion = {-0.28, 0.08, 1e-3, -2e-3, -0.01}};

static struct row {
    const char *name;
    vec3 rotation;  // degrees
    vec3 p, expected;
} rows[] = {
    {"no rotation", {0, 0, 0}, {1, 2, 3}, {1, 2, 3}},
    {"quarter turn about z", {0, 0, 90}, {1, 0, 0}, {0, 1, 0}},
    {"quarter turn about x", {90, 0, 0}, {0, 1, 0}, {0, 0, 1}},
    {"half turn about x: a camera that looks down", {180, 0, 0}, {1, 2, 3}, {1, -2, -3}},
    {"third of a turn about the diagonal",
     {69.28203230275509, 69.28203230275509, 69.28203230275509},
     {1, 2, 3},
     {3, 1, 2}},
};
enum { ROWS = sizeof rows / sizeof *rows };

static void test_rotation(void **state)
{
    const struct row *r = *state;
    mat3 m = cal_rotation(vec3_scale(r->rotation, DEG));
    vec3 got = mat3_mul(&m, r->p);
    assert_near(vec3_length(vec3_sub(got, r->expected)), 0, 1e-13);
    vec3 back = mat3_mul_t(&m, got);
    assert_near(vec3_length(vec3_sub(back, r->p)), 0, 1e-13);
}

static void test_small_rotations_lose_nothing(void **state)
{
    (void)state;
    // To first order R p = p + w x p; the next term is w^2/2.
    for (double t = 1e-12; t < 2e-3; t *= 10) {
        vec3 w = {t, -2 * t, 0.5 * t}, p = {1, 2, 3};
        mat3 m = cal_rotation(w);
        vec3 first = vec3_add(p, vec3_cross(w, p)), got = mat3_mul(&m, p);
        assert_near(vec3_length(vec3_sub(got, first)), 0, 10 * t * t + 1e-15);
        assert_near(vec3_length(got), vec3_length(p), 4e-15);
    }
}

static void test_eye_is_where_the_view_is_zero(void **state)
{
    (void)state;
    pose p = {{0.3, -2, 0.7}, {10, -20, 500}};
    assert_near(vec3_length(cal_to_view(p, cal_eye(p))), 0, 1e-12);
}

static void test_project_by_hand(void **state)
{
    (void)state;
    // x = 0.1, y = 0.2, q = 0.05; k1 = -0.2: radial 0.99; p1 = 0.01: dx = 2 p1 x y = 4e-4,
    // dy = p1 (q + 2 y^2) = 1.3e-3.
    struct camera c = {
        .focal = {1000, 2000}, .center = {500, 300}, .distortion = {-0.2, 0, 0.01, 0, 0}};
    double pixel[2];
    cal_project(&c, (vec3){0.3, 0.6, 3}, pixel);
    assert_near(pixel[0], 500 + 1000 * (0.1 * 0.99 + 4e-4), 1e-9);
    assert_near(pixel[1], 300 + 2000 * (0.2 * 0.99 + 1.3e-3), 1e-9);
}

static void test_ray_inverts_project(void **state)
{
    (void)state;
    for (double y = 0; y < strong.height; y += 99)
        for (double x = 0; x < strong.width; x += 99) {
            double pixel[2] = {x, y}, again[2];
            vec3 ray = cal_ray(&strong, pixel);
            assert_near(vec3_length(ray), 1, 1e-14);
            cal_project(&strong, vec3_scale(ray, 123), again);
            assert_near(again[0], x, 1e-9);  // 1e-12 of a focal length
            assert_near(again[1], y, 1e-9);
        }
}

static void test_a_ray_beyond_the_fold_is_finite(void **state)
{
    (void)state;
    // x (1 - 0.5 x^2) has its maximum at x = sqrt(2/3), 0.544: no ray reaches the pixel 0.9 away.
    struct camera c = {.focal = {100, 100}, .distortion = {-0.5}};
    vec3 ray = cal_ray(&c, (double[2]){90, 0});
    assert_true(isfinite(ray.x) && isfinite(ray.z) && ray.z > 0);
}

// Central differences of a step of 1e-6 are good to about 1e-9 of the function's size.
static void test_derivatives_of_project(void **state)
{
    (void)state;
    double parameters[LENS_PARAMETERS], pixel[2], by_point[2][3], by_parameter[2][LENS_PARAMETERS];
    lens_to_array(parameters, &strong);
    vec3 p = {120, -80, 310};
    lens_project(parameters, p, pixel, by_point, by_parameter);
    for (int k = 0; k < LENS_PARAMETERS; k++) {
        double low[LENS_PARAMETERS], high[LENS_PARAMETERS], a[2], b[2], h = 1e-6;
        memcpy(low, parameters, sizeof low);
        memcpy(high, parameters, sizeof high);
        low[k] -= h;
        high[k] += h;
        lens_project(low, p, a, NULL, NULL);
        lens_project(high, p, b, NULL, NULL);
        for (int i = 0; i < 2; i++)
            assert_near(by_parameter[i][k], (b[i] - a[i]) / (2 * h), 1e-6);
    }
    for (int k = 0; k < 3; k++) {
        double a[2], b[2], h = 1e-4;
        vec3 e = {k == 0, k == 1, k == 2};
        lens_project(parameters, vec3_sub(p, vec3_scale(e, h)), a, NULL, NULL);
        lens_project(parameters, vec3_add(p, vec3_scale(e, h)), b, NULL, NULL);
        for (int i = 0; i < 2; i++)
            assert_near(by_point[i][k], (b[i] - a[i]) / (2 * h), 1e-7);
    }
}

static void test_derivatives_of_rotation(void **state)
{
    (void)state;
    const vec3 rotations[] = {{0, 0, 0}, {1e-5, 2e-5, -1e-5}, {0.4, -1.1, 0.3}, {2, 1.5, -1.7}};
    vec3 p = {1, -2, 3};
    for (int r = 0; r < 4; r++) {
        double by[3][3], h = 1e-6;
        lens_rotate(rotations[r], p, by);
        for (int k = 0; k < 3; k++) {
            vec3 e = {h * (k == 0), h * (k == 1), h * (k == 2)};
            vec3 a = lens_rotate(vec3_sub(rotations[r], e), p, NULL);
            vec3 b = lens_rotate(vec3_add(rotations[r], e), p, NULL);
            vec3 d = vec3_scale(vec3_sub(b, a), 1 / (2 * h));
            assert_near(by[0][k], d.x, 1e-8);
            assert_near(by[1][k], d.y, 1e-8);
            assert_near(by[2][k], d.z, 1e-8);
        }
    }
}

static void test_vignetting_in_the_corner(void **state)
{
    (void)state;
    struct camera c = {
        .width = 800, .height = 600, .center = {400, 300}, .vignetting = {-0.2, 0.05}};
    assert_near(cal_vignetting(&c, (double[2]){400, 300}), 1, 1e-15);
    assert_near(cal_vignetting(&c, (double[2]){800, 600}), 0.85, 1e-15);  // q = 1
}

static void test_a_lamp_on_the_camera_moves_with_it(void **state)
{
    (void)state;
    struct lamp lamp = {.on_camera = true, .position = {50, 0, 0}};
    pose p = {{0.3, -2, 0.7}, {10, -20, 500}};
    vec3 world = cal_lamp_position(&lamp, p);
    assert_near(vec3_length(vec3_sub(world, cal_eye(p))), 50, 1e-10);
    assert_near(vec3_length(vec3_sub(cal_to_view(p, world), lamp.position)), 0, 1e-10);
}

int main(void)
{
    const struct CMUnitTest others[] = {
        cmocka_unit_test(test_small_rotations_lose_nothing),
        cmocka_unit_test(test_eye_is_where_the_view_is_zero),
        cmocka_unit_test(test_project_by_hand),
        cmocka_unit_test(test_ray_inverts_project),
        cmocka_unit_test(test_a_ray_beyond_the_fold_is_finite),
        cmocka_unit_test(test_derivatives_of_project),
        cmocka_unit_test(test_derivatives_of_rotation),
        cmocka_unit_test(test_vignetting_in_the_corner),
        cmocka_unit_test(test_a_lamp_on_the_camera_moves_with_it),
    };
    enum { OTHERS = sizeof others / sizeof *others };
    struct CMUnitTest tests[ROWS + OTHERS];
    for (int i = 0; i < ROWS; i++)
        tests[i] = (struct CMUnitTest){rows[i].name, test_rotation, NULL, NULL, &rows[i]};
    memcpy(tests + ROWS, others, sizeof others);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
