/* test_models.c -- reflectance models: values by hand, reciprocity, energy. */
#include "microfacet.h"
#include "near.h"

#include <string.h>

static vec3 direction(double theta, double phi)
{
    return (vec3){sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
}

// Parameters of a physical material for any model, by name.
static void typical(const struct model *model, double *value)
{
    for (const struct parameter *p = model->parameter; p->name; p++)
        for (int c = 0; c < p->size; c++)
            *value++ = strcmp(p->name, "albedo") == 0  ? 0.1 + 0.2 * c
                       : strcmp(p->name, "alpha") == 0 ? 0.3
                       : strcmp(p->name, "ior") == 0   ? 1.5
                       : strcmp(p->name, "f0") == 0    ? 0.04 + 0.01 * c
                                                       : 0.5 * (p->low + p->high);
}

static void test_fresnel_by_hand(void **state)
{
    (void)state;
    assert_near(rec_fresnel_dielectric(1, 1.5), 0.04, 1e-15);  // ((n-1)/(n+1))^2
    assert_near(rec_fresnel_dielectric(0, 1.5), 1, 1e-15);
    assert_near(rec_fresnel_dielectric(0.3, 1), 0, 1e-15);
    // At Brewster's angle, tan = n, only s is reflected: F = ((n^2-1)/(n^2+1))^2 / 2.
    double n = 1.5, brewster = cos(atan(n)), s = (n * n - 1) / (n * n + 1);
    assert_near(rec_fresnel_dielectric(brewster, n), s * s / 2, 1e-14);
}

// Straight down D = 1/(pi a^2) for both distributions, and G = 1: the lobe is 1/(4 pi a^2).
static void test_lobes_at_normal_incidence(void **state)
{
    (void)state;
    vec3 n = {0, 0, 1};
    for (double alpha = 0.01; alpha < 1; alpha *= 3) {
        double expected = 1 / (4 * CAP_PI * alpha * alpha);
        assert_near(rec_lobe_ggx(rec_facet(n, n), alpha), expected, 1e-12 * expected);
        assert_near(rec_lobe_beckmann(rec_facet(n, n), alpha), expected, 1e-12 * expected);
    }
}

// Where tan theta_h = alpha, GGX has fallen to 1/4 (times cos^-4), Beckmann to 1/e.
static void test_lobes_at_their_width(void **state)
{
    (void)state;
    double alpha = 0.2, theta = atan(alpha), cos4 = pow(cos(theta), 4);
    vec3 w = direction(theta, 0);  // retro-reflection: theta_h = theta
    double g = 2 / (1 + sqrt(1 + pow(alpha * tan(theta), 2)));
    double expected = g * g / (4 * CAP_PI * alpha * alpha * cos4) / (4 * w.z * w.z);
    assert_near(rec_lobe_ggx(rec_facet(w, w), alpha), expected, 1e-12 * expected);
    expected = exp(-1) / (CAP_PI * alpha * alpha * cos4) / (4 * w.z * w.z);  // 1/(a tan) > 1.6
    assert_near(rec_lobe_beckmann(rec_facet(w, w), alpha), expected, 1e-12 * expected);
}

static void test_ggx_straight_down(void **state)
{
    (void)state;
    const double parameters[] = {0.3, 0.09, 0.06, 0.12, 1.5};
    double f[3];
    vec3 n = {0, 0, 1};
    rec_model_find("ggx")->eval(parameters, n, n, f);
    double gloss = 0.04 / (4 * CAP_PI * 0.12 * 0.12);
    for (int c = 0; c < 3; c++)
        assert_near(f[c], parameters[c] / CAP_PI + gloss, 1e-13);
}

static void test_schlick_reaches_one_at_grazing(void **state)
{
    (void)state;
    const double parameters[] = {0, 0, 0, 0.9, 0.5, 0.1, 0.3, 1};
    double f[3];
    vec3 wi = direction(1.5707, 0), wo = direction(1.5707, CAP_PI);  // c = wi.h -> 0
    rec_model_find("ggx_schlick")->eval(parameters, wi, wo, f);
    assert_near(f[0] / f[2], 1, 1e-3);  // white, whatever f0
    vec3 n = {0, 0, 1};
    rec_model_find("ggx_schlick")->eval(parameters, n, n, f);
    assert_near(f[0] / f[2], 9, 1e-12);  // f0
}

static void test_reciprocity(void **state)
{
    (void)state;
    for (const struct model *const *m = rec_models; *m; m++) {
        double value[MODEL_PARAMETERS_MAX], f[3], g[3];
        typical(*m, value);
        for (int i = 0; i < 500; i++) {
            vec3 wi = direction(1.55 * (i % 23) / 22, 0.1 * i);
            vec3 wo = direction(1.55 * (i % 19) / 18, 0.37 * i);
            (*m)->eval(value, wi, wo, f);
            (*m)->eval(value, wo, wi, g);
            for (int c = 0; c < 3; c++)
                assert_near(f[c], g[c], 1e-12 * f[c]);
        }
    }
}

// Integral of f cos_o over the hemisphere by the midpoint rule.
static double albedo(const struct model *model, const double *value, double theta_i, int channel)
{
    enum { N = 200 };
    double sum = 0, f[3];
    vec3 wi = direction(theta_i, 0);
    for (int t = 0; t < N; t++)
        for (int p = 0; p < 2 * N; p++) {
            double theta = (t + 0.5) / N * CAP_PI / 2;
            vec3 wo = direction(theta, (p + 0.5) / N * CAP_PI);
            model->eval(value, wi, wo, f);
            sum += f[channel] * cos(theta) * sin(theta);
        }
    return sum * (CAP_PI / 2 / N) * (CAP_PI / N);
}

static void test_albedo_of_lambert_is_its_parameter(void **state)
{
    (void)state;
    const double value[] = {0.2, 0.5, 0.8};
    for (int c = 0; c < 3; c++)
        assert_near(albedo(rec_model_find("lambert"), value, 0.7, c), value[c], 1e-4);
}

static void test_energy_is_conserved(void **state)
{
    (void)state;
    for (const struct model *const *m = rec_models; *m; m++) {
        double value[MODEL_PARAMETERS_MAX];
        typical(*m, value);
        for (double theta = 0; theta < 1.4; theta += 0.2)
            assert_true(albedo(*m, value, theta, 0) <= 1);
    }
}

// A perfect mirror's microfacets lose only what Smith's separable shadowing takes.
static void test_white_lobe_integrates_to_nearly_one(void **state)
{
    (void)state;
    const double white[] = {0, 0, 0, 1, 1, 1, 0.1, 1};
    double ggx = albedo(rec_model_find("ggx_schlick"), white, 0.3, 0);
    double beckmann = albedo(rec_model_find("beckmann_schlick"), white, 0.3, 0);
    assert_true(ggx > 0.97 && ggx < 1);
    assert_true(beckmann > 0.97 && beckmann < 1.004);  // its G1 is an approximation to 0.35 %
}

static void test_names(void **state)
{
    (void)state;
    assert_null(rec_model_find("no such"));
    for (const struct model *const *m = rec_models; *m; m++)
        assert_ptr_equal(rec_model_find((*m)->name), *m);
    assert_int_equal(rec_model_size(rec_model_find("lambert")), 3);
    assert_int_equal(rec_model_size(rec_model_find("ggx")), 5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fresnel_by_hand),
        cmocka_unit_test(test_lobes_at_normal_incidence),
        cmocka_unit_test(test_lobes_at_their_width),
        cmocka_unit_test(test_ggx_straight_down),
        cmocka_unit_test(test_schlick_reaches_one_at_grazing),
        cmocka_unit_test(test_reciprocity),
        cmocka_unit_test(test_albedo_of_lambert_is_its_parameter),
        cmocka_unit_test(test_energy_is_conserved),
        cmocka_unit_test(test_white_lobe_integrates_to_nearly_one),
        cmocka_unit_test(test_names),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
