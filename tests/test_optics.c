/* Point spread and veiling glare: light is moved, none is lost. */
#include "near.h"
#include "optics.h"

#include <string.h>

enum { WIDTH = 61, HEIGHT = 41 };
static float value[WIDTH * HEIGHT * 3];

static struct scene with(double blur, double glare)
{
    return (struct scene){.camera = {.width = WIDTH, .height = HEIGHT}, .optics = {blur, glare}};
}

static void one_star(void)
{
    memset(value, 0, sizeof value);
    value[3 * (20 * WIDTH + 30) + 1] = 1000;
}

static void test_a_star_becomes_a_gaussian(void **state)
{
    (void)state;
    struct scene scene = with(1.5, 0);
    double sum = 0, xx = 0, xy = 0;
    one_star();
    assert_int_equal(sam_optics_apply(&scene, 2, value, NULL), STATUS_OK);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            double v = value[3 * (y * WIDTH + x) + 1];
            sum += v;
            xx += v * (x - 30) * (x - 30);
            xy += v * (x - 30) * (y - 20);
        }
    assert_near(sum, 1000, 1e-3);
    assert_near(xx / sum, 1.5 * 1.5, 5e-3);  // four standard deviations hold all but 1e-3 of it
    assert_near(xy / sum, 0, 1e-6);
    assert_near(value[3 * (20 * WIDTH + 30)], 0, 0);  // red stays dark
}

static void test_an_even_picture_stays(void **state)
{
    (void)state;
    struct scene scene = with(2, 0.05);
    for (int i = 0; i < WIDTH * HEIGHT * 3; i++)
        value[i] = 0.25f;
    assert_int_equal(sam_optics_apply(&scene, 1, value, NULL), STATUS_OK);
    for (int i = 0; i < WIDTH * HEIGHT * 3; i++)
        assert_near(value[i], 0.25, 1e-6);
}

static void test_glare_lifts_the_dark(void **state)
{
    (void)state;
    struct scene scene = with(0, 0.02);
    one_star();
    assert_int_equal(sam_optics_apply(&scene, 1, value, NULL), STATUS_OK);
    assert_near(value[1], 0.02 * 1000 / (WIDTH * HEIGHT), 1e-8);
    assert_near(value[3 * (20 * WIDTH + 30) + 1], 980 + 20.0 / (WIDTH * HEIGHT), 1e-3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_star_becomes_a_gaussian),
        cmocka_unit_test(test_an_even_picture_stays),
        cmocka_unit_test(test_glare_lifts_the_dark),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
