/* test_facet_sums.c -- means over pieces of surface: the slope of shading is no noise, and what
 * bends is made the radiance in the middle. */
#include "facet_sums.h"
#include "near.h"

#include <stdlib.h>
#include <string.h>

enum { WIDTH = 24, HEIGHT = 20 };
static const double VARIANCE = 1e-4;

/** c [6]: 1, x, y, xx, xy, yy of the radiance at a point. */
static double radiance_at(const double c[6], double x, double y)
{
    return c[0] + c[1] * x + c[2] * y + c[3] * x * x + c[4] * x * y + c[5] * y * y;
}

/** What photosites show of it through a lens of that blur: the mean over a variance of place. */
static struct radiance map_of(const double c[6], double blur_px)
{
    const size_t n = 3 * WIDTH * HEIGHT;
    struct radiance map = {.width = WIDTH, .height = HEIGHT, .channels = 3};
    map.value = malloc(n * sizeof *map.value);
    map.variance = malloc(n * sizeof *map.variance);
    assert_true(map.value && map.variance);
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        for (int k = 0; k < 3; k++) {
            double spread = blur_px * blur_px + 1.0 / 12;
            map.value[3 * i + k] =
                (float)((k + 1) * (radiance_at(c, i % WIDTH, i / WIDTH) + (c[3] + c[5]) * spread));
            map.variance[3 * i + k] = (float)VARIANCE;
        }
    return map;
}

static void test_a_slope_is_no_noise(void **state)
{
    (void)state;
    static const double plane[6] = {1, 0.01, -0.02};
    struct radiance map = map_of(plane, 0);
    struct facet_sums sums = {.count = 0};
    struct facet facet = {.view = 0};
    int n = 0;
    for (int y = 3; y < 9; y++)
        for (int x = 2; x < 12 - (y > 5); x++, n++)  // not a rectangle
            facet_sums_add(&sums, &map, x, y, 0.1 * x, 0.2 * y);
    assert_true(facet_of_sums(&sums, 0.5, &facet));
    assert_true(facet.bright);
    for (int k = 0; k < 3; k++) {
        double seen = (k + 1) * radiance_at(plane, facet.pixel[0], facet.pixel[1]);
        assert_near(facet.mean[k], seen, 1e-6);
        assert_near(facet.noise[k], sqrt(VARIANCE / n), 1e-6);
    }
    assert_false(facet_of_sums(&sums, 0.001, &facet));  // too much for an even material
    cap_radiance_free(&map);
}

static void test_what_bends_is_the_middle_s(void **state)
{
    (void)state;
    static const double bowl[6] = {2, 0.03, 0.01, -0.004, 0.003, 0.006};
    static const double blurs[] = {0, 0.5};
    for (int b = 0; b < 2; b++) {
        struct radiance map = map_of(bowl, blurs[b]);
        for (int side = 2; side < 6; side++) {
            double bend[3], mean[3] = {0}, middle = 0.5 * (side - 1);
            assert_true(facet_bend(&map, 7, 6, side, blurs[b], bend));
            for (int i = 0; i < side * side; i++)
                for (int k = 0; k < 3; k++)
                    mean[k] += (double)map.value[3 * ((6 + i / side) * WIDTH + 7 + i % side) + k]
                               / (side * side);
            for (int k = 0; k < 3; k++)
                assert_near(mean[k] - bend[k], (k + 1) * radiance_at(bowl, 7 + middle, 6 + middle),
                            1e-5);
        }
        double unused[3];
        assert_false(facet_bend(&map, 1, 6, 4, 0, unused));  // no room beside it
        cap_radiance_free(&map);
    }
}

/** Of a rectangle of a x b millimetres, a^2/12 and b^2/12. */
static void test_places_have_their_spread(void **state)
{
    (void)state;
    static const double even[6] = {1};
    struct radiance map = map_of(even, 0);
    struct facet_sums sums = {.count = 0};
    struct facet facet = {.view = 0};
    for (int y = 0; y < 10; y++)
        for (int x = 0; x < 20; x++)
            facet_sums_add(&sums, &map, x, y, (x + 0.5) / 20, (y + 0.5) / 10);
    facet_of_place(&sums, (vec3){1, 2, 3}, (vec3){40, 0, 0}, (vec3){0, 0, 20}, &facet);
    assert_near(facet.point.x, 21, 1e-12);
    assert_near(facet.point.z, 13, 1e-12);
    // Cells of one, less than the rectangle by the cells' own.
    assert_near(vec3_dot(facet.spread[0], facet.spread[0]), 1600.0 / 12 * (1 - 1.0 / 400), 1e-9);
    assert_near(vec3_dot(facet.spread[1], facet.spread[1]), 400.0 / 12 * (1 - 1.0 / 100), 1e-9);
    assert_near(facet.spread[1].x, 0, 1e-12);
    cap_radiance_free(&map);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_slope_is_no_noise),
        cmocka_unit_test(test_what_bends_is_the_middle_s),
        cmocka_unit_test(test_places_have_their_spread),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
