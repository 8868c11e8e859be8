/* test_hemisphere.c -- sums over a hemisphere: known albedos, and estimates by sampling. */
#include "albedo.h"
#include "hemisphere.h"
#include "near.h"

static void test_lambert_is_its_parameter(void **state)
{
    (void)state;
    struct brdf chalk = {.model = rec_model_find("lambert"), .value = {0.2, 0.5, 0.8}};
    double albedo[3];
    for (int degrees = 0; degrees < 90; degrees += 1) {
        rec_brdf_albedo(albedo, &chalk, degrees * CAP_PI / 180);
        assert_near(albedo[0], 0.2, 4e-5);
        assert_near(albedo[2], 0.8, 1.6e-4);
    }
}

static void test_a_mirror_loses_nothing(void **state)
{
    (void)state;
    struct brdf mirror = {.model = rec_model_find("ggx_schlick"),
                          .value = {0, 0, 0, 1, 1, 1, 0.002, 1}};
    double albedo[3];
    for (double theta = 0; theta < 1.4; theta += 0.1) {
        rec_brdf_albedo(albedo, &mirror, theta);
        assert_near(albedo[1], 1, 2e-3);
    }
}

// The mean of f cos(theta_o) / pdf over even numbers (Halton's), which share nothing with the sum.
static double sampled(const struct brdf *brdf, double theta_i, int count)
{
    const vec3 wi = {sin(theta_i), 0, cos(theta_i)};
    const int base[3] = {2, 3, 5};
    double sum = 0;
    for (int n = 1; n <= count; n++) {
        double u[3] = {0}, f[3];
        vec3 wo;
        for (int k = 0; k < 3; k++)
            for (double i = n, part = 1.0 / base[k]; i >= 1;
                 i = floor(i / base[k]), part /= base[k])
                u[k] += part * fmod(i, base[k]);
        double pdf = rec_brdf_sample(brdf, wi, u, &wo);
        if (!(pdf > 0))
            continue;
        rec_brdf_eval(brdf, wi, wo, f);
        sum += f[1] * wo.z / pdf / count;
    }
    return sum;
}

static void test_plastic_as_sampled(void **state)
{
    (void)state;
    struct brdf plastic = {.model = rec_model_find("ggx"), .value = {0.03, 0.08, 0.05, 0.07, 1.55}};
    double albedo[3];
    for (double degrees = 0; degrees < 89; degrees += 12.5) {
        rec_brdf_albedo(albedo, &plastic, degrees * CAP_PI / 180);
        assert_near(albedo[1], sampled(&plastic, degrees * CAP_PI / 180, 60000), 2e-3 * albedo[1]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_lambert_is_its_parameter),
        cmocka_unit_test(test_a_mirror_loses_nothing),
        cmocka_unit_test(test_plastic_as_sampled),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
