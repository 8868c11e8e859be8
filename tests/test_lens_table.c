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
    for (int v = 0; v < camera.height; v += 7)
        for (int u = 0; u < camera.width; u += LANES) {
            struct lens_row row;
            rec_lens_row(&row, &table, u, v);
            for (int i = 0; i < LANES && u + i < camera.width; i++) {
                double pixel[2] = {u + i, v}, px = camera.focal[0];  // of a pixel in x/z
                vec3 ray = cal_ray(&camera, pixel);
                bool inside = u + i >= 8 && v >= 8 && u + i < camera.width - 9;
                double near = inside && v < camera.height - 9 ? 1e-4 : 1e-2;
                assert_near(row.at[0][i] * px, ray.x / ray.z * px, near);
                assert_near(row.at[1][i] * px, ray.y / ray.z * px, near);
            }
        }
    rec_lens_free(&table);
}

static void test_slopes_are_those_of_the_rays(void **state)
{
    (void)state;
    struct camera camera = strong_lens(640, 480);
    struct lens_table table;
    assert_int_equal(rec_lens_make(&table, &camera, NULL), STATUS_OK);
    struct lens_row row, above, below;
    rec_lens_row(&row, &table, 256, 100);
    rec_lens_row(&above, &table, 256, 99);
    rec_lens_row(&below, &table, 256, 101);
    // The third derivative of a lens of this strength, over 6, is below 1e-6 of the slope.
    for (int i = 1; i < LANES - 1; i++) {
        double px = camera.focal[0];
        assert_near(row.by_u[0][i] * px, (row.at[0][i + 1] - row.at[0][i - 1]) / 2 * px, 1e-5);
        assert_near(row.by_u[1][i] * px, (row.at[1][i + 1] - row.at[1][i - 1]) / 2 * px, 1e-5);
        assert_near(row.by_v[0][i] * px, (below.at[0][i] - above.at[0][i]) / 2 * px, 1e-5);
        assert_near(row.by_v[1][i] * px, (below.at[1][i] - above.at[1][i]) / 2 * px, 1e-5);
    }
    rec_lens_free(&table);
}

static void test_a_tiny_image_has_rays(void **state)
{
    (void)state;
    struct camera camera = {.name = "a", .width = 3, .height = 2, .focal = {9, 9}};
    struct lens_table table;
    double pixel[2] = {2, 1};
    struct lens_row row;
    assert_int_equal(rec_lens_make(&table, &camera, NULL), STATUS_OK);
    rec_lens_row(&row, &table, 0, 1);
    vec3 ray = cal_ray(&camera, pixel);
    assert_near(row.at[0][2], ray.x / ray.z, 1e-12);
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
