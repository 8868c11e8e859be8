/* Random numbers: the published test vector, moments, and streams that do not meet. */
#include "near.h"
#include "random.h"

enum { DRAWS = 200000 };

// Known answer of Philox4x32-10 for counter and key 0, from the authors' Random123.
static void test_philox_is_the_published_one(void **state)
{
    (void)state;
    static const uint32_t answer[4] = {0x6627e8d5u, 0xe169c58du, 0xbc57ac4cu, 0x9b00dbd8u};
    struct random random = sam_random_at(0, 0, 0);
    for (int i = 3; i >= 0; i--)  // a block is used from its end
        assert_near(sam_uniform(&random), (answer[i] + 0.5) * 0x1p-32, 0);
}

static void test_places_have_streams_of_their_own(void **state)
{
    (void)state;
    static const uint64_t places[][3] = {
        {1, 0, 0}, {2, 0, 0}, {1, 1, 0}, {1, 0, 1}, {1, 0, 1ull << 32}};
    double first[5];
    for (int i = 0; i < 5; i++) {
        struct random random = sam_random_at(places[i][0], (uint32_t)places[i][1], places[i][2]);
        first[i] = sam_uniform(&random);
        for (int j = 0; j < i; j++)
            assert_true(first[i] != first[j]);
    }
}

static void test_normal_has_its_moments(void **state)
{
    (void)state;
    struct random random = sam_random_at(5, 0, 0);
    double m[5] = {0};
    for (int i = 0; i < DRAWS; i++) {
        double x = sam_normal(&random);
        for (int k = 1; k <= 4; k++)
            m[k] += pow(x, k) / DRAWS;
    }
    // Five standard deviations of each moment's mean: variances 1, 2, 15, 96 over the draws.
    assert_near(m[1], 0, 5 * sqrt(1.0 / DRAWS));
    assert_near(m[2], 1, 5 * sqrt(2.0 / DRAWS));
    assert_near(m[3], 0, 5 * sqrt(15.0 / DRAWS));
    assert_near(m[4], 3, 5 * sqrt(96.0 / DRAWS));
}

static double means[] = {0.003, 0.5, 3, 9.99, 10, 10.5, 31, 400, 5e4};
enum { MEANS = sizeof means / sizeof *means };

// Mean, variance and third central moment of a Poisson number are all its mean.
static void test_poisson_moments(void **state)
{
    double mean = *(double *)*state, sum = 0, square = 0, cube = 0;
    struct random random = sam_random_at(9, 1, (uint64_t)(mean * 1000));
    for (int i = 0; i < DRAWS; i++) {
        double d = sam_poisson(&random, mean) - mean;
        sum += d / DRAWS;
        square += d * d / DRAWS;
        cube += d * d * d / DRAWS;
    }
    assert_near(sum, 0, 5 * sqrt(mean / DRAWS));
    assert_near(square, mean, 5 * sqrt((mean + 2 * mean * mean) / DRAWS));
    double sixth = mean + 25 * mean * mean + 15 * mean * mean * mean;  // central moment
    assert_near(cube, mean, 5 * sqrt(sixth / DRAWS));
}

// Pearson's test of whole frequencies, on both sides of the change of method at 10.
static void test_poisson_frequencies(void **state)
{
    double mean = *(double *)*state, count[64] = {0}, p = exp(-mean), chi2 = 0;
    struct random random = sam_random_at(11, 2, (uint64_t)(mean * 1000));
    for (int i = 0; i < DRAWS; i++) {
        int k = (int)sam_poisson(&random, mean);
        if (k < 64)
            count[k]++;
    }
    int cells = 0;
    for (int k = 0; k < 64; k++) {
        if (p * DRAWS > 20) {
            chi2 += (count[k] - p * DRAWS) * (count[k] - p * DRAWS) / (p * DRAWS);
            cells++;
        }
        p *= mean / (k + 1);
    }
    assert_near(chi2, cells, 5 * sqrt(2.0 * cells) + 5);
}

static void test_poisson_of_nothing_is_nothing(void **state)
{
    (void)state;
    struct random random = sam_random_at(1, 2, 3);
    for (int i = 0; i < 100; i++)
        assert_near(sam_poisson(&random, 0), 0, 0);
}

int main(void)
{
    struct CMUnitTest tests[4 + 2 * MEANS] = {
        cmocka_unit_test(test_philox_is_the_published_one),
        cmocka_unit_test(test_places_have_streams_of_their_own),
        cmocka_unit_test(test_normal_has_its_moments),
        cmocka_unit_test(test_poisson_of_nothing_is_nothing),
    };
    size_t count = 4;
    for (int i = 0; i < MEANS; i++) {
        tests[count++] =
            (struct CMUnitTest){"poisson moments", test_poisson_moments, NULL, NULL, &means[i]};
        if (means[i] > 2 && means[i] < 32)
            tests[count++] = (struct CMUnitTest){"poisson frequencies", test_poisson_frequencies,
                                                 NULL, NULL, &means[i]};
    }
    return _cmocka_run_group_tests("random", tests, count, NULL, NULL);
}
