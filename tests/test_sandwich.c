/* test_sandwich.c -- sigmas of a mean, for independent and for shared errors. */
#include "sandwich.h"

#include "near.h"

#include <stdlib.h>

enum { TERMS = 400, CLUSTERS = 20 };

/** residual = value - measured: the mean is the solution. */
static bool evaluate(const void *context, double const *const *value, double *residual,
                     double **jacobian)
{
    residual[0] = value[0][0] - *(const double *)context;
    if (jacobian && jacobian[0])
        jacobian[0][0] = 1;
    return true;
}

/** A normal deviate, nearly: the sum of twelve uniform ones. */
static double deviate(void)
{
    double sum = -6;
    for (int i = 0; i < 12; i++)
        sum += rand() / (double)RAND_MAX;
    return sum;
}

/** Solve for the mean of measured[] and return its sigma. */
static double sigma_of_mean(const double *measured, const int *cluster, double *mean)
{
    struct ceres_parameter parameter = {.value = mean, .size = 1};
    struct ceres_term term[TERMS];
    for (int t = 0; t < TERMS; t++)
        term[t] = (struct ceres_term){.evaluate = evaluate,
                                      .context = &measured[t],
                                      .residuals = 1,
                                      .parameters = 1,
                                      .parameter = {0}};
    struct ceres_problem p = {
        .parameter = &parameter, .term = term, .parameters = 1, .terms = TERMS};
    double sigma;
    assert_int_equal(ceres_solve(&p, NULL), STATUS_OK);
    assert_int_equal(cal_sandwich(&sigma, &p, cluster, CLUSTERS, NULL), STATUS_OK);
    return sigma;
}

static void test_independent_errors(void **state)
{
    (void)state;
    double measured[TERMS], mean = 0;
    int cluster[TERMS];
    srand(1);
    for (int t = 0; t < TERMS; t++) {
        measured[t] = 5 + deviate();
        cluster[t] = t % CLUSTERS;
    }
    double sigma = sigma_of_mean(measured, cluster, &mean);
    assert_near(mean, 5, 3 / sqrt(TERMS));
    // 1/sqrt(n), and never below it; twenty clusters know their own scatter to a sixth
    assert_true(sigma >= 1 / sqrt(TERMS) - 1e-12 && sigma < 1.5 / sqrt(TERMS));
}

static void test_shared_errors_do_not_average_out(void **state)
{
    (void)state;
    double measured[TERMS], mean = 0, shared[CLUSTERS];
    int cluster[TERMS];
    srand(2);
    for (int k = 0; k < CLUSTERS; k++)
        shared[k] = 3 * deviate();
    for (int t = 0; t < TERMS; t++) {
        cluster[t] = t % CLUSTERS;
        measured[t] = shared[cluster[t]] + 0.1 * deviate();
    }
    double sigma = sigma_of_mean(measured, cluster, &mean);
    assert_near(sigma, 3 / sqrt(CLUSTERS), 3 * 3 / sqrt(CLUSTERS) / sqrt(2.0 * CLUSTERS));
    assert_true(fabs(mean) < 3 * sigma);
}

/** A table whose rows and columns have errors of their own: both are in the mean's. */
static void test_errors_shared_in_two_ways(void **state)
{
    (void)state;
    double measured[TERMS], mean = 0, row[CLUSTERS], column[CLUSTERS], two, same;
    int by_row[TERMS], by_column[TERMS];
    struct ceres_term term[TERMS];
    srand(3);
    for (int k = 0; k < CLUSTERS; k++) {
        row[k] = 3 * deviate();
        column[k] = 2 * deviate();
    }
    for (int t = 0; t < TERMS; t++) {
        by_row[t] = t / CLUSTERS;
        by_column[t] = t % CLUSTERS;
        measured[t] = row[by_row[t]] + column[by_column[t]] + 0.1 * deviate();
    }
    double one = sigma_of_mean(measured, by_row, &mean);
    struct ceres_parameter parameter = {.value = &mean, .size = 1};
    for (int t = 0; t < TERMS; t++)
        term[t] = (struct ceres_term){
            .evaluate = evaluate, .context = &measured[t], .residuals = 1, .parameters = 1};
    struct ceres_problem p = {
        .parameter = &parameter, .term = term, .parameters = 1, .terms = TERMS};
    assert_int_equal(cal_sandwich_two_ways(&two, &p, by_row, CLUSTERS, by_column, CLUSTERS, NULL),
                     STATUS_OK);
    // Of each way's variance the clusters tell to sqrt(2 / 20).
    assert_near(two, 13.0 / CLUSTERS, 3 * 13.0 / CLUSTERS * sqrt(2.0 / CLUSTERS));
    assert_near(one * one, 9.0 / CLUSTERS, 3 * 9.0 / CLUSTERS * sqrt(2.0 / CLUSTERS));
    assert_true(two > one * one);
    assert_int_equal(cal_sandwich_two_ways(&same, &p, by_row, CLUSTERS, by_row, CLUSTERS, NULL),
                     STATUS_OK);
    assert_near(same, one * one, 1e-9);
}

static void test_held_numbers_have_none(void **state)
{
    (void)state;
    double value[2] = {1, 2}, measured = 1.5, sigma[2] = {9, 9};
    const bool held = true;
    struct ceres_parameter parameter[2] = {{.value = &value[0], .size = 1},
                                           {.value = &value[1], .size = 1, .held = &held}};
    struct ceres_term term[2];
    for (int t = 0; t < 2; t++)
        term[t] = (struct ceres_term){.evaluate = evaluate,
                                      .context = &measured,
                                      .residuals = 1,
                                      .parameters = 1,
                                      .parameter = {t}};
    struct ceres_problem p = {.parameter = parameter, .term = term, .parameters = 2, .terms = 2};
    const int cluster[2] = {-1, -1};
    assert_int_equal(cal_sandwich(sigma, &p, cluster, 0, NULL), STATUS_OK);
    assert_near(sigma[0], 1, 1e-12);
    assert_near(sigma[1], 0, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_independent_errors),
        cmocka_unit_test(test_shared_errors_do_not_average_out),
        cmocka_unit_test(test_errors_shared_in_two_ways),
        cmocka_unit_test(test_held_numbers_have_none),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
