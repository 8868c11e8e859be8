/* test_reflectance.c -- models of rendered materials: values by hand, independent forms, and
 * reciprocity and energy over random physical parameters. */
#include "made_models.h"
#include "near.h"
#include "sgd.h"

#include <complex.h>
#include <string.h>

static vec3 direction(double theta, double phi)
{
    return (vec3){sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
}

static void evaluate(const char *name, const double *value, vec3 wi, vec3 wo, double f[3])
{
    const struct model *model = rec_model_find(name);
    assert_non_null(model);
    model->eval(value, wi, wo, f);
}

// ---- values by hand

// sigma = 0 is Lambert; straight down a rough surface has lost A alone.
static void test_oren_nayar_by_hand(void **state)
{
    (void)state;
    double f[3];
    vec3 n = {0, 0, 1}, w = direction(0.9, 0.4);
    evaluate("oren_nayar", (const double[]){0.3, 0.6, 0.9, 0}, w, n, f);
    assert_near(f[1], 0.6 / CAP_PI, 1e-15);
    double s2 = 0.25, a = 1 - 0.5 * s2 / (s2 + 0.33), b = 0.45 * s2 / (s2 + 0.09);
    evaluate("oren_nayar", (const double[]){0.3, 0.6, 0.9, 0.5}, n, n, f);
    assert_near(f[0], 0.3 / CAP_PI * a, 1e-15);
    // Back to the lamp at 60 degrees: sin a tan b = 3/2. To the other side of it: nothing more.
    vec3 back = direction(CAP_PI / 3, 1), away = direction(CAP_PI / 3, 1 + CAP_PI);
    evaluate("oren_nayar", (const double[]){0.3, 0.6, 0.9, 0.5}, back, back, f);
    assert_near(f[0], 0.3 / CAP_PI * (a + b * 1.5), 1e-15);
    evaluate("oren_nayar", (const double[]){0.3, 0.6, 0.9, 0.5}, back, away, f);
    assert_near(f[0], 0.3 / CAP_PI * a, 1e-15);
}

// Mirror pairs have n.h = 1; with the light at 60 degrees from n and the camera at it, n.h =
// cos 30.
static void test_blinn_phong_by_hand(void **state)
{
    (void)state;
    const double value[] = {0.1, 0.2, 0.3, 2, 3, 4, 10, 20, 4};
    double f[3];
    evaluate("blinn_phong", value, direction(0.8, 0), direction(0.8, CAP_PI), f);
    assert_near(f[0], 2.1, 1e-14);
    evaluate("blinn_phong", value, direction(CAP_PI / 3, 0), (vec3){0, 0, 1}, f);
    assert_near(f[2], 0.3 + 4 * 9.0 / 16, 1e-14);  // cos^4 30 = 9/16
}

static void test_lafortune_by_hand(void **state)
{
    (void)state;
    const double value[] = {0, 0, 0, -1, -1, 1, 1, 2, 1, 20, 3, 20};
    double f[3];
    evaluate("lafortune", value, direction(0.7, 0), direction(0.7, CAP_PI), f);
    assert_near(f[0], 1, 1e-13);  // the mirror direction of a Phong lobe
    evaluate("lafortune", value, direction(0.7, 0.3), direction(0.7, 0.3), f);
    assert_near(f[2], 1, 1e-13);  // retro-reflection
    vec3 n = {0, 0, 1};
    evaluate("lafortune", value, n, n, f);
    assert_near(f[1], 8, 1e-14);
}

static void test_ward_by_hand(void **state)
{
    (void)state;
    const double value[] = {0.1, 0.2, 0.3, 0.5, 0.5, 0.5, 0.2};
    double f[3];
    vec3 n = {0, 0, 1}, w = direction(atan(0.2), 0.5);
    evaluate("ward", value, n, n, f);
    assert_near(f[0], 0.1 / CAP_PI + 0.5 / (4 * CAP_PI * 0.04), 1e-13);
    evaluate("ward", value, w, w, f);  // tan theta_h = alpha, cos^2 = 1/1.04
    assert_near(f[0], 0.1 / CAP_PI + 0.5 * 1.04 * exp(-1) / (4 * CAP_PI * 0.04), 1e-13);
}

// Straight down all dielectric facets reflect ((n-1)/(n+1))^2 / (4 pi alpha^2).
static void test_beckmann_by_hand(void **state)
{
    (void)state;
    const double value[] = {0.3, 0.3, 0.3, 0.15, 1.5};
    double f[3], g[3], expected = 0.3 / CAP_PI + 0.04 / (4 * CAP_PI * 0.0225);
    vec3 n = {0, 0, 1};
    evaluate("beckmann", value, n, n, f);
    evaluate("cook_torrance", value, n, n, g);
    assert_near(f[0], expected, 1e-13);
    assert_near(g[0], expected, 1e-13);
    // A mirror pair at 80 degrees: grooves hide all but 2 n.h cos / (wi.h) = 2, that is nothing.
    vec3 wi = direction(80 * CAP_PI / 180, 0), wo = direction(80 * CAP_PI / 180, CAP_PI);
    double cosine = wi.z, s = sqrt(1.25 + cosine * cosine);
    double rs = pow((cosine - s) / (cosine + s), 2), t = 2.25 * cosine;
    double rp = pow((t - s) / (t + s), 2);
    evaluate("cook_torrance", value, wi, wo, g);
    expected = 0.3 / CAP_PI + (rs + rp) / 2 / (CAP_PI * 0.0225) / (4 * cosine * cosine);
    assert_near(g[0], expected, 1e-12 * expected);
}

// Fresnel's equations in complex numbers: rs = (c - q)/(c + q), rp = (m c - q)/(m c + q) with
// m = (eta - i k)^2 and q^2 = m - sin^2.
static void test_conductor_against_complex_numbers(void **state)
{
    (void)state;
    const double value[] = {0.2, 1.5, 3, 3.9, 0, 4, 0.3};
    for (double theta = 0.01; theta < 1.5; theta += 0.1) {
        vec3 wi = direction(theta, 0), wo = direction(theta, CAP_PI);
        double f[3], white[3], c = cos(theta);
        const double mirror[] = {0, 0, 0, 1, 1, 1, 0.3, 0};  // the same lobe without Fresnel
        evaluate("ggx_schlick", mirror, wi, wo, white);
        evaluate("ggx_conductor", value, wi, wo, f);
        for (int k = 0; k < 3; k++) {
            double complex m = cpow(value[k] - I * value[3 + k], 2), q = csqrt(m - 1 + c * c);
            double rs = cabs((c - q) / (c + q)), rp = cabs((m * c - q) / (m * c + q));
            double expected = 0.5 * (rs * rs + rp * rp);
            assert_near(f[k] / white[k], expected, 1e-12);
        }
    }
}

// Straight down: body 28/(23 pi) (1 - 2^-5)^2, gloss (n + 1)/(8 pi) rs.
static void test_ashikhmin_shirley_by_hand(void **state)
{
    (void)state;
    const double value[] = {0.5, 0.5, 0.5, 0.1, 0.2, 0, 99};
    double f[3], body = 28 * 0.5 / (23 * CAP_PI) * pow(31.0 / 32, 2);
    vec3 n = {0, 0, 1};
    evaluate("ashikhmin_shirley", value, n, n, f);
    assert_near(f[0], 0.9 * body + 100 * 0.1 / (8 * CAP_PI), 1e-14);
    assert_near(f[2], body, 1e-14);
}

// Straight down n.h = 1: kD/pi + F A / pi. Retro-reflection at 60 degrees: 1 - n.h = 1/2, G = 1/2.
static void test_abc_by_hand(void **state)
{
    (void)state;
    const double value[] = {0.1, 0.2, 0.3, 5, 6, 7, 100, 1.5, 1.5};
    double f[3];
    vec3 n = {0, 0, 1}, w = direction(CAP_PI / 3, 2);
    evaluate("abc", value, n, n, f);
    assert_near(f[1], (0.2 + 0.04 * 6) / CAP_PI, 1e-14);
    evaluate("abc", value, w, w, f);
    assert_near(f[1], (0.2 + 0.04 * 6 * 0.5 / pow(51, 1.5) * 4) / CAP_PI, 1e-14);
}

// Gamma(1, x) = exp(-x); Gamma(1/2, x) = sqrt(pi) erfc(sqrt x); Gamma(a + 1, x) = a Gamma(a, x) +
// x^a exp(-x); Gamma(0, 1) = E1(1) (Abramowitz and Stegun, table 5.1).
static void test_upper_gamma(void **state)
{
    (void)state;
    for (double x = 1e-5; x < 5; x *= 1.7) {
        assert_near(rec_upper_gamma(1, x), exp(-x), 1e-13);
        double root = sqrt(CAP_PI) * erfc(sqrt(x));
        assert_near(rec_upper_gamma(0.5, x), root, 1e-13 * fmax(root, 1));
        for (double a = -0.9; a < 1; a += 0.15) {
            double next = rec_upper_gamma(a + 1, x), tail = pow(x, a) * exp(-x);
            assert_near(a * rec_upper_gamma(a, x) + tail, next, 1e-12 * (next + tail));
        }
    }
    assert_near(rec_upper_gamma(0, 1), 0.219383934, 5e-10);
}

// kap of published materials: aluminium's red and green, beige fabric's red, alum-bronze's blue.
// Theirs have six digits, and so have alpha and p.
static void test_sgd_normalisation_is_the_published_one(void **state)
{
    (void)state;
    static const double rows[][3] = {{0.0012241, 0.537669, 449.321},
                                     {0.000926487, 0.474562, 658.044},
                                     {0.39455, 0.474725, 3.8249},
                                     {0.0490339, 0.529272, 14.8261}};
    for (int i = 0; i < 4; i++) {
        double alpha = rows[i][0], kap = 1 / (alpha * rec_upper_gamma(1 - rows[i][1], alpha));
        assert_near(kap / rows[i][2], 1, 1e-5);
    }
}

// p = 0 and small alpha: D falls as a Beckmann lobe of width sqrt(alpha), 1/(pi alpha) straight
// down.
static void test_sgd_without_p_is_beckmann(void **state)
{
    (void)state;
    double value[30] = {0};
    for (int c = 0; c < 3; c++) {
        value[c] = 0.2;
        value[3 + c] = 0.5;
        value[6 + c] = 0.04;
        value[12 + c] = 1;  // F0 = 1, F1 = 0: F = 1
        value[24 + c] = 1;
    }
    for (double theta = 0; theta < 0.6; theta += 0.1) {
        vec3 w = direction(theta, 0.3);
        double t2 = tan(theta) * tan(theta), cos2 = w.z * w.z, f[3];
        double d = exp(-t2 / 0.04) / (CAP_PI * 0.04 * cos2 * cos2);
        evaluate("sgd", value, w, w, f);
        double expected = (0.2 + 0.5 * d / cos2) / CAP_PI;
        assert_near(f[0], expected, 1e-12 * expected);
    }
}

// Straight down, base 0.5, roughness r: matt 0.5/pi; gloss 0.08 specular / (4 pi r^4).
static void test_disney_by_hand(void **state)
{
    (void)state;
    double value[] = {0.5, 0.4, 0.3, 0, 0.5, 0.5, 0, 1, 0, 0, 0, 0};
    double f[3];
    vec3 n = {0, 0, 1};
    evaluate("disney", value, n, n, f);  // sheen is 0 there
    assert_near(f[0], 0.5 / CAP_PI + 0.04 / (4 * CAP_PI * 0.0625), 1e-13);
    value[3] = 1;  // all metal: base is its colour
    evaluate("disney", value, n, n, f);
    assert_near(f[1], 0.4 / (4 * CAP_PI * 0.0625), 1e-13);
    // Retro-reflection near grazing, where the matt part has risen to (1/2 + 2 r)^2.
    const double chalk[] = {0.5, 0.5, 0.5, 0, 1, 0, 0, 0, 0, 0, 0, 0};
    vec3 w = direction(CAP_PI / 2 - 1e-7, 0);
    evaluate("disney", chalk, w, w, f);  // alpha = 1: D = 1/pi, and F = 0 straight onto a facet
    assert_near(f[0], 0.5 / CAP_PI * 6.25, 1e-5);
}

// ---- properties over random physical parameters

static void test_reciprocity(void **state)
{
    (void)state;
    for (const struct model *const *m = rec_models_all; *m; m++) {
        struct random random = sam_random_at(1, 0, 0);
        for (int i = 0; i < 3000; i++) {
            double value[MODEL_PARAMETERS_MAX], f[3], g[3];
            draw_all(*m, &random, value);
            vec3 wi = direction(between(&random, 0, 1.55), between(&random, 0, 6.28));
            vec3 wo = direction(between(&random, 0, 1.55), between(&random, 0, 6.28));
            (*m)->eval(value, wi, wo, f);
            (*m)->eval(value, wo, wi, g);
            for (int c = 0; c < 3; c++) {
                assert_true(f[c] >= 0);
                assert_near(f[c], g[c], 1e-12 * f[c]);
            }
        }
    }
}

// Isotropic: turning both directions about the normal changes nothing but roundings, of which a
// narrow lobe makes the most: 1e-16 in h by theta_h / alpha^2.
static void test_isotropy(void **state)
{
    (void)state;
    for (const struct model *const *m = rec_models_all; *m; m++) {
        struct random random = sam_random_at(2, 0, 0);
        for (int i = 0; i < 1000; i++) {
            double value[MODEL_PARAMETERS_MAX], f[3], g[3], turn = between(&random, 0, 6);
            double theta_i = between(&random, 0, 1.5), theta_o = between(&random, 0, 1.5);
            double phi = between(&random, 0, 6);
            draw_all(*m, &random, value);
            (*m)->eval(value, direction(theta_i, 0), direction(theta_o, phi), f);
            (*m)->eval(value, direction(theta_i, turn), direction(theta_o, phi + turn), g);
            for (int c = 0; c < 3; c++)
                assert_near(f[c], g[c], 1e-9 * f[c]);
        }
    }
}

/** Integral of f cos_o over the hemisphere, for three channels: midpoints in cos^2 and azimuth. */
static void albedo(const struct model *model, const double *value, double theta_i, double sum[3])
{
    enum { N = 64 };
    vec3 wi = direction(theta_i, 0);
    sum[0] = sum[1] = sum[2] = 0;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            double cos2 = (i + 0.5) / N, f[3];
            model->eval(value, wi, direction(acos(sqrt(cos2)), CAP_PI * (j + 0.5) / N), f);
            for (int c = 0; c < 3; c++)
                sum[c] += f[c] * CAP_PI / (N * N);
        }
}

// Ward's lobe has no bounded albedo: it is asked up to 60 degrees only. 1 % for the quadrature.
static void test_energy_is_conserved(void **state)
{
    (void)state;
    for (const struct model *const *m = rec_models_all; *m; m++) {
        struct random random = sam_random_at(3, 0, 0);
        double steepest = strcmp((*m)->name, "ward") == 0 ? 1.05 : 1.4;
        for (int i = 0; i < 12; i++) {
            double value[MODEL_PARAMETERS_MAX], sum[3];
            draw_all(*m, &random, value);
            for (double theta = 0; theta <= steepest; theta += 0.35) {
                albedo(*m, value, theta, sum);
                for (int c = 0; c < 3; c++)
                    assert_true(sum[c] > 0 && sum[c] <= 1.01);
            }
        }
    }
}

// The models' own derivatives against central differences: they err by a third derivative times
// 1e-8, and by rounding over 1e-4.
static void test_slopes(void **state)
{
    (void)state;
    int met = 0;
    for (const struct model *const *m = rec_models_all; *m; m++) {
        struct random random = sam_random_at(4, 0, 0);
        const int size = rec_model_size(*m);
        for (int i = 0; (*m)->slopes && i < 200; i++) {
            double value[MODEL_PARAMETERS_MAX], slope[3 * MODEL_PARAMETERS_MAX], f[3], g[3], h[3];
            draw_all(*m, &random, value);
            vec3 wi = direction(between(&random, 0, 1.5), between(&random, 0, 6.28));
            vec3 wo = direction(between(&random, 0, 1.5), between(&random, 0, 6.28));
            (*m)->slopes(value, wi, wo, f, slope);
            (*m)->eval(value, wi, wo, g);
            for (int c = 0; c < 3; c++)
                assert_near(f[c], g[c], 1e-12 * g[c]);
            for (int k = 0; k < size; k++) {
                double kept = value[k], step = 1e-4 * fmax(0.01, kept);
                value[k] = kept + step;
                (*m)->eval(value, wi, wo, g);
                value[k] = kept - step;
                (*m)->eval(value, wi, wo, h);
                value[k] = kept;
                for (int c = 0; c < 3; c++) {
                    double s = slope[c * size + k];
                    bool kink = fabs(g[c] - 2 * f[c] + h[c]) > 1e-2 * fabs(g[c] - h[c]);
                    if (kink)  // Walter's approximation of G1 has a step of 6e-5
                        continue;
                    assert_near((g[c] - h[c]) / (2 * step), s, 1e-5 * fabs(s) + 1e-7 * f[c] / step);
                }
                met++;
            }
        }
    }
    assert_true(met > 1000);
}

static void test_names(void **state)
{
    (void)state;
    for (const struct model *const *m = rec_models_all; *m; m++) {
        assert_ptr_equal(rec_model_find((*m)->name), *m);
        assert_true(rec_model_size(*m) <= MODEL_PARAMETERS_MAX);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_oren_nayar_by_hand),
        cmocka_unit_test(test_blinn_phong_by_hand),
        cmocka_unit_test(test_lafortune_by_hand),
        cmocka_unit_test(test_ward_by_hand),
        cmocka_unit_test(test_beckmann_by_hand),
        cmocka_unit_test(test_conductor_against_complex_numbers),
        cmocka_unit_test(test_ashikhmin_shirley_by_hand),
        cmocka_unit_test(test_abc_by_hand),
        cmocka_unit_test(test_upper_gamma),
        cmocka_unit_test(test_sgd_normalisation_is_the_published_one),
        cmocka_unit_test(test_sgd_without_p_is_beckmann),
        cmocka_unit_test(test_disney_by_hand),
        cmocka_unit_test(test_reciprocity),
        cmocka_unit_test(test_isotropy),
        cmocka_unit_test(test_energy_is_conserved),
        cmocka_unit_test(test_slopes),
        cmocka_unit_test(test_names),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
