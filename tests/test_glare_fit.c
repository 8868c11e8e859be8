/* Glare from ink beside paper: shares that were put in come out, with sigmas that hold; ink that
 * mirrors the lamp, uneven print and clean lenses do not mislead. */
#include "glare_ink.h"
#include "near.h"

#include <stdlib.h>
#include <string.h>

enum { VIEWS = 12, TAGS = 16, CELLS = 20 };
static const double INK[3] = {0.05, 0.06, 0.045};

static uint64_t seed;
static double noise(void)  // of variance 1
{
    double sum = -6;
    for (int i = 0; i < 12; i++) {
        seed = seed * 6364136223846793005u + 1442695040888963407u;
        sum += (double)(seed >> 11) / 9007199254740992.0;
    }
    return sum;
}

/* What is wrong with the board and the lens. */
struct fault {
    double share[GLARE_TERMS];
    double noise, uneven, per_view;  // relative, of the ink's radiance
    int mirrors;                     // tags of each view that mirror the lamp
    bool few;                        // every other tag only
};

static float cell[VIEWS][3 * CELLS * CELLS];
static struct glare_field seen[VIEWS];
static struct ink clean[VIEWS * TAGS], ink[VIEWS * TAGS];  // before and after the faults

/* Fields of photographs of 640 x 640: darker to the right, with a black ball in the middle; the
 * brighter view has more of it. */
static void make_fields(const struct fault *fault)
{
    for (int v = 0; v < VIEWS; v++) {
        struct glare_field truth = {
            .width = CELLS, .height = CELLS, .side = 32, .last = {1, 1}, .value = cell[v]};
        for (int i = 0; i < CELLS * CELLS; i++) {
            int x = i % CELLS, y = i / CELLS;
            bool ball = hypot(x - 10, y - 10) < 4;
            for (int c = 0; c < 3; c++)
                cell[v][3 * i + c] = (float)(ball ? 0.02 : (0.3 + 0.03 * v) * (1 - 0.02 * x));
        }
        double total = 0;
        float *sum = calloc(3 * CELLS * CELLS, sizeof *sum);
        for (int k = 0; k < GLARE_TERMS; k++) {
            struct glare_field spread;
            total += fault->share[k];
            assert_int_equal(cap_glare_spread(&spread, &truth, k, NULL), STATUS_OK);
            for (int i = 0; i < 3 * CELLS * CELLS; i++)
                sum[i] += (float)fault->share[k] * spread.value[i];
            free(spread.value);
        }
        struct glare_field veil = truth;
        veil.value = sum;
        for (int t = 0; t < TAGS; t++) {
            struct ink *to = &clean[v * TAGS + t];
            double bring[3];
            *to =
                (struct ink){.view = v, .tag = t, .pixel = {40 * (t % 4) + 30, 150 * (t / 4) + 60}};
            cap_glare_at(&veil, to->pixel[0], to->pixel[1], bring);
            for (int c = 0; c < 3; c++) {
                double white = (1 - 0.0015 * to->pixel[0]) * (1 - 0.0004 * to->pixel[1]);
                to->white[c] = (1 - total) * white + bring[c];
                to->black[c] = (1 - total) * INK[c] * white + bring[c];
            }
        }
        for (int i = 0; i < 3 * CELLS * CELLS; i++)
            cell[v][i] = (float)((1 - total) * (double)cell[v][i] + (double)sum[i]);
        seen[v] = truth;
        free(sum);
    }
}

/* Of the fields that were made. */
static struct glare_estimate estimate_again(const struct fault *fault, uint64_t with_seed)
{
    seed = with_seed;
    memcpy(ink, clean, sizeof ink);
    double print[TAGS];
    for (int t = 0; t < TAGS; t++)
        print[t] = 1 + fault->uneven * noise();
    for (int v = 0; v < VIEWS; v++) {
        double view = 1 + fault->per_view * noise();
        for (int t = 0; t < TAGS; t++)
            for (int c = 0; c < 3; c++) {
                struct ink *one = &ink[v * TAGS + t];
                one->noise[c] = fault->noise * one->black[c];
                one->black[c] *= (1 + fault->noise * noise()) * print[t] * view;
                one->black[c] += t < fault->mirrors ? 0.3 * one->white[c] : 0;
            }
    }
    int count = 0;
    for (int i = 0; i < VIEWS * TAGS; i++)
        if (!fault->few || i % 2 == 0)
            ink[count++] = ink[i];
    const struct inks inks = {ink, count, count};
    struct glare_estimate e;
    assert_int_equal(cal_glare_fit(&e, &inks, seen, VIEWS, NULL), STATUS_OK);
    return e;
}

static struct glare_estimate estimate(const struct fault *fault, uint64_t with_seed)
{
    make_fields(fault);
    return estimate_again(fault, with_seed);
}

static void test_two_per_cent_spread_evenly(void **state)
{
    (void)state;
    const struct fault fault = {.share = {0.02}, .noise = 0.002};
    struct glare_estimate e = estimate(&fault, 1);
    assert_near(e.total, 0.02, 0.0004);  // a fiftieth
    assert_near(e.share[0], e.total, 1e-12);
    assert_true(fabs(e.total - 0.02) < 3 * e.sigma);
    for (int c = 0; c < 3; c++)
        assert_near(e.ink[c], INK[c], 0.01 * INK[c]);
}

static void test_a_wide_halo_is_told_from_an_even_veil(void **state)
{
    (void)state;
    const struct fault fault = {.share = {0, 0.03, 0}, .noise = 0.001};
    struct glare_estimate e = estimate(&fault, 2);
    assert_near(e.share[1], 0.03, 0.001);
    assert_near(e.total, 0.03, 0.001);
}

static void test_a_clean_lens_is_left_alone(void **state)
{
    (void)state;
    const struct fault fault = {.noise = 0.003, .uneven = 0.03, .per_view = 0.003};
    for (uint64_t k = 10; k < 20; k++) {
        struct glare_estimate e = estimate(&fault, k);
        assert_true(e.share[0] + e.share[1] + e.share[2] == 0);
    }
}

static void test_ink_that_mirrors_the_lamp_is_no_meter(void **state)
{
    (void)state;
    const struct fault fault = {.share = {0.02}, .noise = 0.002, .mirrors = 2};
    struct glare_estimate e = estimate(&fault, 3);
    assert_near(e.total, 0.02, 0.0005);
}

/* Sigma holds the tags' scatter, which is told by n degrees of freedom, as many as there are tags,
 * less two, and what does not scatter. So errors over it lie between Student's t of n degrees,
 * whose squares have the mean n / (n - 2) and the variance 3 n^2 / ((n - 2) (n - 4)) - mean^2, and
 * a normal distribution; within three standard deviations of so many trials that those of t's rms
 * are 0.15. `student` is the share of t within 2. */
static void expect_sigma(const struct fault *fault, int n, double student)
{
    const double mean = n / (n - 2.0), rms = sqrt(mean), normal = 0.9545;
    const double variance = 3.0 * n * n / ((n - 2.0) * (n - 4)) - mean * mean;
    const int trials = (int)ceil(variance * pow(3 / (2 * rms * 0.15), 2));
    double within = 0, square = 0;
    make_fields(fault);
    for (int k = 0; k < trials; k++) {
        struct glare_estimate e = estimate_again(fault, 30 + (uint64_t)k);
        double z = (e.total - 0.02) / e.sigma;
        within += (fabs(z) < 2) / (double)trials;
        square += z * z / trials;
    }
    print_message("%d trials: rms %.3f, within 2 sigma %.3f\n", trials, sqrt(square), within);
    assert_true(sqrt(square) < rms + 0.15);
    assert_true(sqrt(square) > 1 - 3 / sqrt(2.0 * trials));
    assert_true(within > student - 3 * sqrt(student * (1 - student) / trials));
    assert_true(within < normal + 3 * sqrt(normal * (1 - normal) / trials));
}

static void test_errors_of_views_and_tags_are_in_sigma(void **state)
{
    (void)state;
    const struct fault fault = {.share = {0.02}, .noise = 0.002, .uneven = 0.02, .per_view = 0.003};
    expect_sigma(&fault, TAGS - 2, 0.9347);
}

static void test_uneven_print_of_few_tags_is_in_sigma(void **state)
{
    (void)state;
    const struct fault fault = {.share = {0.02}, .noise = 0.002, .uneven = 0.05, .few = true};
    expect_sigma(&fault, TAGS / 2 - 2, 0.9076);
}

static void test_too_little_ink_tells_nothing(void **state)
{
    (void)state;
    const struct fault fault = {.share = {0.02}, .noise = 0.002};
    make_fields(&fault);
    const struct inks inks = {clean, 5, 5};
    struct glare_estimate e;
    assert_int_equal(cal_glare_fit(&e, &inks, seen, VIEWS, NULL), STATUS_OK);
    assert_true(e.total == 0 && e.share[0] == 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_two_per_cent_spread_evenly),
        cmocka_unit_test(test_a_wide_halo_is_told_from_an_even_veil),
        cmocka_unit_test(test_a_clean_lens_is_left_alone),
        cmocka_unit_test(test_ink_that_mirrors_the_lamp_is_no_meter),
        cmocka_unit_test(test_errors_of_views_and_tags_are_in_sigma),
        cmocka_unit_test(test_uneven_print_of_few_tags_is_in_sigma),
        cmocka_unit_test(test_too_little_ink_tells_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
