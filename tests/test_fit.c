/* test_fit.c -- fits return what was put in, within what the noise allows. */
#include "made_bins.h"
#include "near.h"

#include <string.h>

static struct run run;

static int begin(void **state)
{
    (void)state;
    cap_run_begin(&run, 2, true);
    return 0;
}

static int end(void **state)
{
    (void)state;
    cap_run_end(&run);
    return 0;
}

static struct fits fitted(const char *name, const double *value, double noise)
{
    struct bins bins = made_bins(rec_model_find(name), value, 53, noise);
    struct fits fits = {0};
    struct error err = {0};
    assert_int_equal(rec_fit(&fits, &bins, NULL, 0, &run, &err), STATUS_OK);
    rec_bins_free(&bins);
    return fits;
}

// The right model wins, and its parameters are within 4 sigma (one in 16,000 is not) of the truth.
static void check(const char *name, const double *value)
{
    struct fits fits = fitted(name, value, 0.02);
    const struct fit *best = &fits.fit[0];
    assert_string_equal(best->model->name, name);
    for (int k = 0; k < rec_model_size(best->model); k++) {
        assert_near(best->value[k], value[k], 4 * best->sigma[k]);
        assert_true(best->sigma[k] < 0.05 * value[k]);
    }
    assert_near(best->chi, 0.02 / hypot(0.02, 0.01), 0.2);  // its sigma holds 1 % for the model
    rec_fits_free(&fits);
}

static void test_lambert(void **state)
{
    (void)state;
    check("lambert", (const double[]){0.3, 0.09, 0.6});
}

static void test_plastic(void **state)
{
    (void)state;
    check("ggx", (const double[]){0.3, 0.09, 0.06, 0.12, 1.5});
}

static void test_rough_plastic_of_high_index(void **state)
{
    (void)state;
    check("ggx", (const double[]){0.05, 0.1, 0.2, 0.4, 2.1});
}

// Its albedo is 0 and at its bound: only what is determined is judged.
static void test_metal(void **state)
{
    (void)state;
    const double gold[] = {0, 0, 0, 0.95, 0.7, 0.35, 0.2, 1};
    struct fits fits = fitted("ggx_schlick", gold, 0.02);
    assert_string_equal(fits.fit[0].model->name, "ggx_schlick");
    for (int k = 3; k < 7; k++)
        assert_near(fits.fit[0].value[k], gold[k], 0.01 * gold[k]);
    for (int k = 0; k < 3; k++)
        assert_near(fits.fit[0].value[k], 0, 2e-3);
    rec_fits_free(&fits);
}

static void test_beckmann_lobe_of_constant_colour(void **state)
{
    (void)state;
    const double value[] = {0.1, 0.2, 0.3, 0.5, 0.4, 0.3, 0.25, 0};
    struct fits fits = fitted("beckmann_schlick", value, 0.02);
    assert_string_equal(fits.fit[0].model->name, "beckmann_schlick");
    for (int k = 0; k < 7; k++)
        assert_near(fits.fit[0].value[k], value[k], 0.01 * value[k]);
    rec_fits_free(&fits);
}

// One bin in a hundred is wrong by a factor of three: the robust loss holds.
static void test_outliers_do_not_move_it(void **state)
{
    (void)state;
    const double value[] = {0.3, 0.09, 0.06, 0.12, 1.5};
    struct bins bins = made_bins(rec_model_find("ggx"), value, 53, 0.02);
    struct fits fits = {0};
    const struct model *models[] = {rec_model_find("ggx")};
    for (int i = 0; i < bins.count; i += 100)
        for (int c = 0; c < 3; c++)
            bins.bin[i].mean[c] *= 3;
    assert_int_equal(rec_fit(&fits, &bins, models, 1, &run, NULL), STATUS_OK);
    for (int k = 0; k < 5; k++)
        assert_near(fits.fit[0].value[k], value[k], 0.01 * value[k]);
    rec_fits_free(&fits);
    rec_bins_free(&bins);
}

static void test_threads_change_no_bit(void **state)
{
    (void)state;
    const double value[] = {0.3, 0.09, 0.06, 0.12, 1.5};
    struct fits two = fitted("ggx", value, 0.05);
    run.threads = 1;
    struct fits one = fitted("ggx", value, 0.05);
    run.threads = 2;
    for (int i = 0; i < one.count; i++) {
        assert_ptr_equal(one.fit[i].model, two.fit[i].model);
        assert_memory_equal(one.fit[i].value, two.fit[i].value, sizeof one.fit[i].value);
    }
    rec_fits_free(&one);
    rec_fits_free(&two);
}

// All bins share 1 % of the lamp's error: the albedo is known no better, however many there are.
static void test_shared_errors_do_not_average_out(void **state)
{
    (void)state;
    const double value[] = {0.3, 0.3, 0.3};
    struct bins bins = made_bins(rec_model_find("lambert"), value, 53, 0.005);
    struct fits fits = {0};
    const struct model *models[] = {rec_model_find("lambert")};
    for (int i = 0; i < bins.count; i++) {
        bins.bin[i].systematic = 0.01;
        bins.bin[i].sigma[0] = hypot(bins.bin[i].noise[0], 0.003);
    }
    assert_int_equal(rec_fit(&fits, &bins, models, 1, &run, NULL), STATUS_OK);
    assert_near(fits.fit[0].sigma[0], 0.003, 0.0003);
    rec_fits_free(&fits);
    rec_bins_free(&bins);
}

static void test_too_few_bins_are_told(void **state)
{
    (void)state;
    const double value[] = {0.3, 0.3, 0.3};
    struct bins bins = made_bins(rec_model_find("lambert"), value, 53, 0.02);
    struct bins few = {.bin = bins.bin + bins.count / 2, .count = 50};
    struct fits fits = {0};
    struct error err = {0};
    assert_int_equal(rec_fit(&fits, &few, NULL, 0, &run, &err), STATUS_DATA);
    assert_null(fits.fit);
    rec_bins_free(&bins);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_lambert),
        cmocka_unit_test(test_plastic),
        cmocka_unit_test(test_rough_plastic_of_high_index),
        cmocka_unit_test(test_metal),
        cmocka_unit_test(test_beckmann_lobe_of_constant_colour),
        cmocka_unit_test(test_outliers_do_not_move_it),
        cmocka_unit_test(test_threads_change_no_bit),
        cmocka_unit_test(test_shared_errors_do_not_average_out),
        cmocka_unit_test(test_too_few_bins_are_told),
    };
    return cmocka_run_group_tests(tests, begin, end);
}
