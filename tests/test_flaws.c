/* test_flaws.c -- what stains and grain make of a sample's reflectance. */
#include "flaws.h"
#include "near.h"

static const struct sample_place ball = {.shape = SHAPE_SPHERE, .radius = 20, .center = {1, 2, 60}};

static vec3 direction(double theta, double phi)
{
    return (vec3){sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
}

static double flawed_at(const struct flaws *flaws, vec3 n, vec3 wi, vec3 wo)
{
    return sam_flawed(flaws, &ball, vec3_add(ball.center, vec3_scale(n, ball.radius)), n, wi, wo);
}

static void test_none_changes_nothing(void **state)
{
    (void)state;
    const struct flaws none = {0};
    vec3 n = direction(0.7, 0.3);
    assert_near(flawed_at(&none, n, n, direction(0.2, 0)), 1, 0);
}

// 20 caps of cosine 0.97 cover 20 (1 - 0.97)/2 of the ball, 0.3, less their soft edges: about a
// sixth of the light's range each way.
static void test_stains_cover_their_part(void **state)
{
    (void)state;
    const struct flaws spots = {.spots = 0.5};
    double sum = 0;
    enum { N = 200 };
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            vec3 n = direction(acos(1 - 2 * (i + 0.5) / N), 2 * CAP_PI * (j + 0.5) / N);
            double f = flawed_at(&spots, n, n, n);
            assert_true(f >= 0.5 && f <= 1);
            sum += 1 - f;
        }
    // A soft edge of 0.01 in cosine: the mean of a cap is (0.03 - 0.005)/2 of the ball.
    assert_near(sum / (N * N), 0.5 * 20 * 0.025 / 2, 0.01);
}

// h along the grain's parallel: 1 + g; along the meridian: 1 - g; swapped: the same.
static void test_grain_turns_with_h(void **state)
{
    (void)state;
    const struct flaws grain = {.grain = 0.2};
    vec3 n = {1, 0, 0}, east = vec3_normalize((vec3){1, 0.4, 0});
    vec3 up = vec3_normalize((vec3){1, 0, 0.4}), any = vec3_normalize((vec3){1, -0.7, 0.2});
    assert_near(flawed_at(&grain, n, east, n), 1.2, 1e-12);
    assert_near(flawed_at(&grain, n, n, up), 0.8, 1e-12);
    assert_near(flawed_at(&grain, n, up, any), flawed_at(&grain, n, any, up), 1e-15);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_none_changes_nothing),
        cmocka_unit_test(test_stains_cover_their_part),
        cmocka_unit_test(test_grain_turns_with_h),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
