/* test_dense.c -- Cholesky, its inverse, and whitening. */
#include "dense.h"
#include "near.h"

#include <string.h>

// L = [2 0 0; 1 3 0; -1 2 1], A = L L^T by hand.
static const double lower[9] = {2, 0, 0, 1, 3, 0, -1, 2, 1};
static const double whole[9] = {4, 2, -2, 2, 10, 5, -2, 5, 6};

static void test_factor(void **state)
{
    (void)state;
    double a[9];
    memcpy(a, whole, sizeof a);
    assert_true(dense_cholesky(3, a));
    for (int i = 0; i < 3; i++)
        for (int j = 0; j <= i; j++)
            assert_near(a[3 * i + j], lower[3 * i + j], 1e-14);
}

static void test_solve_and_inverse(void **state)
{
    (void)state;
    double x[3] = {4 * 1 + 2 * 2 - 2 * 3, 2 * 1 + 10 * 2 + 5 * 3, -2 * 1 + 5 * 2 + 6 * 3};
    dense_solve(3, lower, x);  // A (1, 2, 3)
    for (int i = 0; i < 3; i++)
        assert_near(x[i], i + 1, 1e-14);
    double inverse[9];
    dense_inverse(3, lower, inverse);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double sum = 0;
            for (int k = 0; k < 3; k++)
                sum += whole[3 * i + k] * inverse[3 * k + j];
            assert_near(sum, i == j, 1e-13);
        }
}

static void test_whitener_makes_unit_noise(void **state)
{
    (void)state;
    double w[9];
    dense_whitener(3, lower, w);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double sum = 0;
            for (int k = 0; k < 3; k++)
                for (int l = 0; l < 3; l++)
                    sum += w[3 * i + k] * whole[3 * k + l] * w[3 * j + l];
            assert_near(sum, i == j, 1e-13);
        }
}

static void test_what_is_not_positive_is_refused(void **state)
{
    (void)state;
    double indefinite[4] = {1, 0, 2, 1}, zero[1] = {0}, nan[1] = {NAN};
    assert_false(dense_cholesky(2, indefinite));
    assert_false(dense_cholesky(1, zero));
    assert_false(dense_cholesky(1, nan));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_factor),
        cmocka_unit_test(test_solve_and_inverse),
        cmocka_unit_test(test_whitener_makes_unit_noise),
        cmocka_unit_test(test_what_is_not_positive_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
