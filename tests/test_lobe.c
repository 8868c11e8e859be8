/* test_lobe.c -- the flexible reflectance: its derivatives, its symmetry, its reach. */
#include "lobe.h"

#include "near.h"

#include <string.h>

/** Some lobe, far from its start. */
static void some_lobe(double coefficient[LOBE_SIZE])
{
    const double albedo[3] = {0.3, 0.2, 0.1};
    cal_lobe_start(coefficient, albedo);
    for (int i = 0; i < LOBE_SIZE; i++)
        coefficient[i] += 0.3 * sin(1.7 * i);
}

static void test_start_is_matte(void **state)
{
    (void)state;
    double lobe[LOBE_SIZE], log_f[3];
    const double albedo[3] = {0.6, 0.5, 0.4};
    cal_lobe_start(lobe, albedo);
    cal_lobe_log(lobe, 0.8, 0.7, 0.3, 0.6, log_f, NULL);
    for (int c = 0; c < 3; c++) {  // the diffuse part is there, and not much more than it
        assert_true(exp(log_f[c]) > albedo[c] / CAP_PI);
        assert_true(exp(log_f[c]) < 1.6 * albedo[c] / CAP_PI);
    }
}

static void test_swapping_directions_changes_nothing(void **state)
{
    (void)state;
    double lobe[LOBE_SIZE], a[3], b[3];
    some_lobe(lobe);
    cal_lobe_log(lobe, 0.9, 0.4, 0.8, 0.7, a, NULL);
    cal_lobe_log(lobe, 0.4, 0.9, 0.8, 0.7, b, NULL);
    for (int c = 0; c < 3; c++)
        assert_near(a[c], b[c], 1e-14);
}

static void test_derivative_is_the_difference_quotient(void **state)
{
    (void)state;
    const double step = 1e-5;
    double lobe[LOBE_SIZE], at[3], high[3], low[3], derivative[3 * LOBE_SIZE];
    some_lobe(lobe);
    for (int n = 0; n < 20; n++) {
        double ci = 0.2 + 0.035 * n, co = 0.95 - 0.03 * n, ch = 0.3 + 0.034 * n,
               cd = 0.04 * (n + 1);
        cal_lobe_log(lobe, ci, co, ch, cd, at, derivative);
        for (int i = 0; i < LOBE_SIZE; i++) {
            double was = lobe[i];
            lobe[i] = was + step;
            cal_lobe_log(lobe, ci, co, ch, cd, high, NULL);
            lobe[i] = was - step;
            cal_lobe_log(lobe, ci, co, ch, cd, low, NULL);
            lobe[i] = was;
            for (int c = 0; c < 3; c++)
                assert_near(derivative[c * LOBE_SIZE + i], (high[c] - low[c]) / (2 * step), 1e-8);
        }
    }
}

static void test_prior_derivative_is_the_difference_quotient(void **state)
{
    (void)state;
    static double jacobian[LOBE_PRIORS * LOBE_SIZE];
    double lobe[LOBE_SIZE], base[LOBE_PRIORS], moved[LOBE_PRIORS];
    some_lobe(lobe);
    cal_lobe_priors(lobe, base, jacobian);
    for (int i = 0; i < LOBE_SIZE; i++) {
        lobe[i] += 1;  // priors are linear
        cal_lobe_priors(lobe, moved, NULL);
        lobe[i] -= 1;
        for (int r = 0; r < LOBE_PRIORS; r++)
            assert_near(jacobian[r * LOBE_SIZE + i], moved[r] - base[r], 1e-11);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_start_is_matte),
        cmocka_unit_test(test_swapping_directions_changes_nothing),
        cmocka_unit_test(test_derivative_is_the_difference_quotient),
        cmocka_unit_test(test_prior_derivative_is_the_difference_quotient),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
