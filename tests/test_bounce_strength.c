/* test_bounce_strength.c -- how much of the board's light is there: found again, with a true sigma.
 */
#include "bounce_strength.h"

#include "near.h"

static double uniform(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) * 0x1p-53;
}

static double normal(uint64_t *state)
{
    double u = uniform(state), v = uniform(state);
    return sqrt(-2 * log(u + 1e-300)) * cos(2 * CAP_PI * v);
}

/* 12 shots of 400 photosites with 3 % noise, whose bins lack `missing` of the board's light, and
 * whose shots are each wrong in their own way by 1 % of it. */
static struct bounce_trend shoot(double missing, int shots, uint64_t seed)
{
    struct bounce_trend all = {0};
    uint64_t state = seed * 0x9e3779b97f4a7c15u + 1;
    for (int k = 0; k < shots; k++) {
        struct shot_trend one = {0};
        double own = missing + 0.01 * normal(&state);
        for (int i = 0; i < 400; i++) {
            reflectance_sample s = {.weight = 0.5 + 0.5 * uniform(&state),
                                    .excess = uniform(&state) - 0.5};
            s.residual = own * s.excess + 0.03 * normal(&state);
            rec_trend_add(&one, &s);
        }
        const reflectance_sample unknown = {.weight = 1, .excess = 1e9, .residual = NAN};
        rec_trend_add(&one, &unknown);
        rec_trend_end_shot(&all, &one);
    }
    return all;
}

static void test_strength_is_found(void **state)
{
    (void)state;
    const int trials = 400;
    int within[2] = {0};
    for (int k = 0; k < trials; k++) {
        struct bounce_trend trend = shoot(-0.6, 12, (uint64_t)k);
        bounce_strength seen;
        assert_true(rec_trend_strength(&trend, 1, &seen));
        for (int n = 0; n < 2; n++)
            within[n] += fabs(seen.strength - 0.4) < (n + 1) * seen.sigma;
        assert_in_range((int)(1e5 * seen.sigma), 100, 800);  // 0.004 of noise and shots
    }
    // Student's t of 11 degrees of freedom: 0.661 and 0.929; three standard errors of 400 trials.
    assert_near((double)within[0] / trials, 0.661, 0.071);
    assert_near((double)within[1] / trials, 0.929, 0.039);
}

static void test_few_shots_tell_nothing(void **state)
{
    (void)state;
    struct bounce_trend trend = shoot(-0.6, 3, 1), none = {0};
    bounce_strength seen;
    assert_false(rec_trend_strength(&trend, 1, &seen));
    assert_false(rec_trend_strength(&none, 1, &seen));
}

static void test_never_quite_none(void **state)
{
    (void)state;
    struct bounce_trend trend = shoot(-1.3, 12, 5);
    bounce_strength seen;
    assert_true(rec_trend_strength(&trend, 1, &seen));
    assert_true(seen.strength > 0 && seen.strength < 0.01);
}

// Shots err by 1 % of that light here: all of it, or none, is out of question wherever the other
// half is told. Where they err by as much as all of it, or are few, nothing is.
static void test_all_or_none(void **state)
{
    (void)state;
    struct bounce_trend all = shoot(0, 12, 1), most = shoot(-0.3, 12, 2), some = shoot(-0.7, 12, 3),
                        none = shoot(-1, 12, 4), few = shoot(-1, 3, 5), vague = {0};
    for (int k = 0; k < 12; k++) {
        struct bounce_trend one = shoot(-1 + (k % 2 ? 1 : -1), 1, (uint64_t)k);
        rec_trend_merge(&vague, &one);
    }
    assert_false(rec_trend_none(&all, 1));
    assert_false(rec_trend_none(&most, 1));
    assert_true(rec_trend_none(&some, 1));
    assert_true(rec_trend_none(&none, 1));
    assert_false(rec_trend_none(&few, 1));
    assert_false(rec_trend_none(&vague, 1));
}

// As much as is missing, and the model's 5 % of what was used: nothing where few shots tell.
static void test_sigma_of_what_was_used(void **state)
{
    (void)state;
    struct bounce_trend right = shoot(0, 12, 7), wrong = shoot(-0.2, 12, 8), few = shoot(0, 3, 1);
    assert_near(rec_trend_sigma(&right, 1), 0.05, 0.005);
    assert_near(rec_trend_sigma(&right, 0.5), 0.025, 0.01);
    assert_near(rec_trend_sigma(&wrong, 1), hypot(0.2, 0.05), 0.015);
    assert_true(isinf(rec_trend_sigma(&few, 1)));
}

static void test_order_does_not_matter(void **state)
{
    (void)state;
    struct bounce_trend a = shoot(0.2, 5, 2), b = shoot(0.1, 9, 3), ab = a, ba = b;
    rec_trend_merge(&ab, &b);
    rec_trend_merge(&ba, &a);
    assert_memory_equal(&ab, &ba, sizeof ab);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_strength_is_found),     cmocka_unit_test(test_few_shots_tell_nothing),
        cmocka_unit_test(test_never_quite_none),      cmocka_unit_test(test_sigma_of_what_was_used),
        cmocka_unit_test(test_order_does_not_matter), cmocka_unit_test(test_all_or_none),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
