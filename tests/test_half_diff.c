/* test_half_diff.c -- half/difference angles that a reader can check by hand. */
#include "near.h"
#include "reconstruct.h"

#define DEG (CAP_PI / 180)

static vec3 direction(double theta, double phi)
{
    return (vec3){sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
}

static struct row {
    const char *name;
    double theta_i, phi_i, theta_o, phi_o;  // degrees
    half_diff expected;                     // degrees
} rows[] = {
    {"both along the normal", 0, 0, 0, 0, {0, 0, 0}},
    {"mirror pair", 45, 0, 45, 180, {0, 45, 0}},
    {"mirror pair at grazing", 89, 70, 89, 250, {0, 89, 0}},
    {"retro-reflection", 60, 20, 60, 20, {60, 0, 0}},
    {"light lower than the camera", 70, 0, 10, 0, {40, 30, 0}},
    {"light higher than the camera", 10, 0, 70, 0, {40, 30, 180}},
    // Across: h = (1, 1, 2 sqrt(2)) / ..., tan theta_h = 1/2, cos of wi and wo is 1/2.
    {"at right angles in azimuth", 45, 0, 45, 90, {35.264389682754654, 30, -90}},
};
enum { ROWS = sizeof rows / sizeof *rows };

static void test_row(void **state)
{
    const struct row *r = *state;
    half_diff a = rec_half_diff(direction(r->theta_i * DEG, r->phi_i * DEG),
                                direction(r->theta_o * DEG, r->phi_o * DEG));
    assert_near(a.theta_h, r->expected.theta_h * DEG, 1e-12);
    assert_near(a.theta_d, r->expected.theta_d * DEG, 1e-12);
    if (r->expected.theta_h > 0 && r->expected.theta_d > 0)  // else phi_d is arbitrary
        assert_near(cos(a.phi_d - r->expected.phi_d * DEG), 1, 1e-12);
}

// Pairs of directions all over the hemisphere, none of them special.
static void pair(int i, vec3 *wi, vec3 *wo)
{
    double golden = 2.399963229728653;
    *wi = direction(acos(1 - (i + 0.5) / 1001), golden * i);
    *wo = direction(acos(1 - ((i * 7 + 3) % 1000 + 0.5) / 1001), golden * 31 * i + 1);
}

static void test_swapping_directions_turns_phi_d_by_pi(void **state)
{
    (void)state;
    for (int i = 0; i < 1000; i++) {
        vec3 wi, wo;
        pair(i, &wi, &wo);
        half_diff a = rec_half_diff(wi, wo), b = rec_half_diff(wo, wi);
        assert_near(a.theta_h, b.theta_h, 1e-12);
        assert_near(a.theta_d, b.theta_d, 1e-12);
        assert_near(fabs(a.phi_d - b.phi_d), CAP_PI, 1e-9);
    }
}

static void test_turning_about_the_normal_changes_nothing(void **state)
{
    (void)state;
    for (int i = 0; i < 1000; i++) {
        vec3 wi, wo;
        double c = cos(0.01 * i), s = sin(0.01 * i);
        pair(i, &wi, &wo);
        half_diff a = rec_half_diff(wi, wo);
        half_diff b = rec_half_diff((vec3){c * wi.x - s * wi.y, s * wi.x + c * wi.y, wi.z},
                                    (vec3){c * wo.x - s * wo.y, s * wo.x + c * wo.y, wo.z});
        assert_near(a.theta_h, b.theta_h, 1e-12);
        assert_near(a.theta_d, b.theta_d, 1e-12);
        assert_near(a.phi_d, b.phi_d, 1e-9);
    }
}

static void test_directions_is_the_inverse(void **state)
{
    (void)state;
    for (int i = 0; i < 1000; i++) {
        vec3 wi, wo, wi2, wo2;
        pair(i, &wi, &wo);
        half_diff a = rec_half_diff(wi, wo);
        rec_directions(a, &wi2, &wo2);
        assert_near(wi2.z, wi.z, 1e-12);
        assert_near(wo2.z, wo.z, 1e-12);
        assert_near(vec3_dot(wi2, wo2), vec3_dot(wi, wo), 1e-12);
    }
}

// In a highlight of 1e-9 rad an acos would answer 0 or 1.5e-8.
static void test_tiny_theta_h_keeps_its_digits(void **state)
{
    (void)state;
    double e = 1e-9;
    half_diff a = rec_half_diff(direction(0.5 + e, 0), direction(0.5 - e, CAP_PI));
    assert_near(a.theta_h, e, 1e-15);
}

int main(void)
{
    struct CMUnitTest tests[ROWS + 4];
    for (int i = 0; i < ROWS; i++)
        tests[i] = (struct CMUnitTest){rows[i].name, test_row, NULL, NULL, &rows[i]};
    tests[ROWS] = (struct CMUnitTest)cmocka_unit_test(test_swapping_directions_turns_phi_d_by_pi);
    tests[ROWS + 1] =
        (struct CMUnitTest)cmocka_unit_test(test_turning_about_the_normal_changes_nothing);
    tests[ROWS + 2] = (struct CMUnitTest)cmocka_unit_test(test_directions_is_the_inverse);
    tests[ROWS + 3] = (struct CMUnitTest)cmocka_unit_test(test_tiny_theta_h_keeps_its_digits);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
