/* Vignetting: the model finds a known fall-off again, through noise and dust. */
#include "flat.h"
#include "synthetic.h"

enum { WIDTH = 384, HEIGHT = 256 };

/* 1 + a q + b q^2 + c q^3 about a centre that is not the image's. */
static double fall_off(int x, int y, int c)
{
    double dx = (x - 200) / 192.0, dy = (y - 120) / 192.0, q = (dx * dx + dy * dy) / 1.5;
    return 1 - (0.2 + 0.01 * c) * q - 0.05 * q * q + 0.02 * q * q * q;
}

static float *make_image(double noise, bool dust)
{
    float *image = malloc(3 * WIDTH * HEIGHT * sizeof *image);
    assert_non_null(image);
    uint64_t state = 7;
    for (int i = 0; i < 3 * WIDTH * HEIGHT; i++) {
        int x = i / 3 % WIDTH, y = i / 3 / WIDTH;
        double v = 3000 * fall_off(x, y, i % 3) * (1 + noise * random_normal(&state));
        bool dusty = dust && abs(x - 300) < 6 && abs(y - 60) < 6;
        image[i] = (float)(dusty ? 0.7 * v : v);
    }
    return image;
}

/* The largest deviation from the fall-off; both are 1 at the maximum, which is the centre's. */
static double largest_error(const struct flat *flat)
{
    float row[3 * WIDTH];
    double worst = 0;
    for (int y = 0; y < HEIGHT; y++) {
        flat_row(flat, y, row);
        for (int i = 0; i < 3 * WIDTH; i++)
            worst = fmax(worst, fabs((double)row[i] / fall_off(i / 3, y, i % 3) - 1));
    }
    return worst;
}

static void test_exact_polynomial_is_found_exactly(void **state)
{
    (void)state;
    struct flat flat;
    float *image = make_image(0, false);
    assert_true(flat_fit_image(&flat, image, WIDTH, HEIGHT));
    free(image);
    // Cells of 3 x 3 pixels average the curvature: 1e-5; the rest is float rounding.
    assert_near(largest_error(&flat), 0, 3e-5);
    flat_free(&flat);
}

static void test_noise_and_dust_do_little(void **state)
{
    (void)state;
    struct flat flat;
    float *image = make_image(0.01, true);
    assert_true(flat_fit_image(&flat, image, WIDTH, HEIGHT));
    free(image);
    // At a corner all polynomials peak: variance 1 %^2 / 98304 times the sum of (2i + 1)(2j + 1)
    // over i + j <= 6, which is 532: 0.074 %, of which 4 standard deviations.
    assert_near(largest_error(&flat), 0, 4 * 7.4e-4);
    flat_free(&flat);
}

static void test_darkness_is_no_flat_frame(void **state)
{
    (void)state;
    struct flat flat;
    float *image = calloc(3 * WIDTH * HEIGHT, sizeof *image);
    assert_non_null(image);
    assert_false(flat_fit_image(&flat, image, WIDTH, HEIGHT));
    free(image);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_exact_polynomial_is_found_exactly),
        cmocka_unit_test(test_noise_and_dust_do_little),
        cmocka_unit_test(test_darkness_is_no_flat_frame),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
