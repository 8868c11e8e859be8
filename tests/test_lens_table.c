/* test_lens_table.c -- interpolated rays against cal_ray(). */
#include "lens_table.h"
#include "near.h"

static struct camera strong_lens(int width, int height)
{
    return (struct camera){
        .name = "a",
        .width = width,
        .height = height,
        .focal = {1.9 * width, 1.9 * width},
        .center = {0.503 * width, 0.49 * height},
        .distortion = {-0.3, 0.1, 6e-4, -4e-4, 0},
    };
}

static void test_rays_agree_to_a_hundredth_of_a_pixel(void **state)
{
    (void)state;
    struct camera camera = strong_lens(1080, 717);
    struct lens_table table;
    assert_int_equal(rec_lens_make(&table, &camera, NULL), STATUS_OK);
    for (double v = -1; v <= camera.height; v += 6.31)
        for (double u = -1; u <= camera.width; u += 7.77) {
            double pixel[2] = {u, v}, at[2], by_u[2], by_v[2];
            vec3 ray = cal_ray(&camera, pixel);
            rec_lens_at(&table, u, v, at, by_u, by_v);
            double px = camera.focal[0];  // of a pixel in x/z
            bool inside = u >= 8 && v >= 8 && u < camera.width - 9 && v < camera.height - 9;
            assert_near(at[0] * px, ray.x / ray.z * px, inside ? 1e-4 : 1e-2);
            assert_near(at[1] * px, ray.y / ray.z * px, inside ? 1e-4 : 1e-2);
        }
    rec_lens_free(&table);
}

static void test_slopes_are_those_of_the_rays(void **state)
{
    (void)state;
    struct camera camera = strong_lens(640, 480);
    struct lens_table table;
    assert_int_equal(rec_lens_make(&table, &camera, NULL), STATUS_OK);
    for (double u = 20; u < 600; u += 13.7) {
        double at[2], by_u[2], by_v[2], a[2], b[2], skip[2];
        rec_lens_at(&table, u, 100, at, by_u, by_v);
        rec_lens_at(&table, u + 1e-4, 100, a, skip, skip);
        rec_lens_at(&table, u - 1e-4, 100, b, skip, skip);
        assert_near(by_u[0] * 2e-4, a[0] - b[0], 1e-12);
        assert_near(by_v[1], 1 / camera.focal[1], 0.3 / camera.focal[1]);
    }
    rec_lens_free(&table);
}

static void test_a_tiny_image_has_rays(void **state)
{
    (void)state;
    struct camera camera = {.name = "a", .width = 3, .height = 2, .focal = {9, 9}};
    struct lens_table table;
    double at[2], by_u[2], by_v[2], pixel[2] = {1, 1};
    assert_int_equal(rec_lens_make(&table, &camera, NULL), STATUS_OK);
    rec_lens_at(&table, 1, 1, at, by_u, by_v);
    vec3 ray = cal_ray(&camera, pixel);
    assert_near(at[0], ray.x / ray.z, 1e-12);
    rec_lens_free(&table);
    rec_lens_free(&table);  // twice is no harm
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rays_agree_to_a_hundredth_of_a_pixel),
        cmocka_unit_test(test_slopes_are_those_of_the_rays),
        cmocka_unit_test(test_a_tiny_image_has_rays),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
