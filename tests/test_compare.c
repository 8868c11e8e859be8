/* test_compare.c -- errors between two BRDFs, and checks of one, on BRDFs made good and bad. */
#include "check.h"
#include "compare.h"
#include "near.h"

#include <stdlib.h>
#include <string.h>

static struct run run;

static struct brdf chalk(double albedo)
{
    return (struct brdf){.model = rec_model_find("lambert"), .value = {albedo, albedo, albedo}};
}

// A mean of g(theta_i) over even angles, by the midpoint rule.
static double mean_over_angles(double (*g)(double theta))
{
    double sum = 0;
    for (int i = 0; i < 1000; i++)
        sum += g((i + 0.5) / 1000 * CAP_PI / 2) / 1000;
    return sum;
}

static double low_of_chalk(double theta)
{
    double d = log((1 + 0.5 / CAP_PI * cos(theta)) / (1 + 0.25 / CAP_PI * cos(theta)));
    return d * d * sin(theta);
}

// f = 0.5/pi and 0.25/pi: every measure in closed form. The grid's sums are within 1 % of
// integrals.
static void test_chalk_of_two_kinds(void **state)
{
    (void)state;
    struct brdf a = chalk(0.5), b = chalk(0.25);
    struct comparison c;
    assert_int_equal(rec_compare(&c, &a, &b, NULL, &run, NULL), STATUS_OK);
    const struct brdf_errors *all = &c.channel[COMPARE_ALL];
    double d = 0.25 / CAP_PI;
    assert_int_equal(all->bins, 1096216);
    assert_near(all->relative_median, 0.5, 1e-12);
    assert_near(all->relative_95, 0.5, 1e-12);
    assert_near(all->signed_median, -0.5, 1e-12);
    assert_near(all->ngan, d * 2 / CAP_PI / sqrt(3), 0.01 * d);  // <cos^2 sin> <sin> = 4 / (3 pi^2)
    double low = sqrt(mean_over_angles(low_of_chalk));
    assert_near(all->low, low, 0.01 * low);
    double root = pow(d, 2.0 / 3) * 0.36;  // of cos^(2/3) over a hemisphere the mean is 3/5
    assert_near(all->cube_root, root, 0.01 * root);
    assert_near(c.channel[1].log_rms, all->log_rms, 1e-12);
    int sum = 0;
    for (int band = 0; band < COMPARE_BANDS; band++)
        sum += c.by_angle[COMPARE_ALL][band].bins;
    assert_int_equal(sum, all->bins);
}

// Half the difference is a quarter of its square: 6.02 dB.
static void test_picture_errors_follow_the_difference(void **state)
{
    (void)state;
    enum { SIZE = 3 * SPHERE_SIZE * SPHERE_SIZE };
    const double albedo[3] = {0.5, 0.25, 0.375};
    float *picture = malloc(3 * SIZE * sizeof *picture);
    struct picture_errors far, near;
    assert_non_null(picture);
    for (int i = 0; i < 3; i++) {
        struct brdf brdf = chalk(albedo[i]);
        rec_lit_sphere(picture + i * SIZE, &brdf, 2);
    }
    assert_int_equal(rec_sphere_compare(&far, picture, picture + SIZE, NULL), STATUS_OK);
    assert_int_equal(rec_sphere_compare(&near, picture, picture + 2 * SIZE, NULL), STATUS_OK);
    assert_near(near.psnr - far.psnr, 20 * log10(2), 1e-4);  // pictures are float
    assert_true(near.delta_e > 1 && near.delta_e < far.delta_e);
    free(picture);
}

static void test_only_measured_bins_count(void **state)
{
    (void)state;
    struct brdf a = chalk(0.5), b = chalk(0.4);
    struct comparison c;
    struct error err = {0};
    uint8_t *mask = calloc(MERL_BINS, 1);
    assert_non_null(mask);
    assert_int_equal(rec_compare(&c, &a, &b, mask, &run, &err), STATUS_DATA);
    int wanted = 0;
    for (int i = 0; i < MERL_BINS; i += 1001)
        if (rec_merl_above(i)) {
            mask[i] = BIN_MEASURED;
            wanted++;
        }
    assert_int_equal(rec_compare(&c, &a, &b, mask, &run, NULL), STATUS_OK);
    assert_int_equal(c.channel[COMPARE_ALL].bins, wanted);
    free(mask);
}

/* ---- checks -------------------------------------------------------------------------------------
 */

static const double matt = 0.5 / CAP_PI;

static double spoil_nothing(half_diff a, double steepest)
{
    (void)a;
    (void)steepest;
    return matt;
}
static double spoil_energy(half_diff a, double steepest)
{
    (void)a;
    return steepest > 60 ? 4 * matt : matt;
}
// As MERL's: down to nothing from 70 degrees on.
static double spoil_grazing(half_diff a, double steepest)
{
    (void)a;
    return steepest > 70 ? matt * (90 - steepest) / 20 : matt;
}
static double spoil_symmetry(half_diff a, double steepest)
{
    (void)steepest;
    return matt * (1 + 0.2 * cos(a.phi_d));
}
static double leave_out(half_diff a, double steepest)
{
    return a.theta_d > 1.3 && steepest > 70 ? -1 : matt;
}
static double below_zero(half_diff a, double steepest)
{
    return a.theta_d > 1.3 && steepest > 70 ? -1e-5 : matt;
}

static struct check_row {
    const char *name;
    double (*f)(half_diff a, double steepest_deg);
    unsigned verdict;
} rows[] = {
    {"a sound table", spoil_nothing, 0},
    {"more leaves than arrives", spoil_energy, CHECK_ALBEDO},
    {"MERL's weakness", spoil_grazing, CHECK_GRAZING},
    {"grain", spoil_symmetry, CHECK_MIRROR},
    {"holes", leave_out, CHECK_MISSING},
    {"negative values", below_zero, CHECK_NEGATIVE},
};
enum { ROWS = sizeof rows / sizeof *rows };

static void test_table(void **state)
{
    const struct check_row *row = *state;
    struct brdf brdf = {.table = {malloc(3 * (size_t)MERL_BINS * sizeof(double))}};
    assert_non_null(brdf.table.value);
    for (int bin = 0; bin < MERL_BINS; bin++) {
        half_diff a = rec_merl_center(bin);
        vec3 wi, wo;
        rec_directions(a, &wi, &wo);
        double steepest = acos(fmin(wi.z, wo.z)) * 180 / CAP_PI;
        for (size_t c = 0; c < 3; c++)
            brdf.table.value[c * MERL_BINS + (size_t)bin] =
                rec_merl_above(bin) ? row->f(a, steepest) : -1;
    }
    struct check check;
    assert_int_equal(rec_check(&check, &brdf, &run, NULL), STATUS_OK);
    unsigned verdict = rec_check_verdict(&check);
    if (row->verdict & (CHECK_MISSING | CHECK_NEGATIVE))  // they may darken grazing angles too
        verdict &= (unsigned)~CHECK_GRAZING;
    assert_int_equal(verdict, row->verdict);
    assert_int_equal(check.bins, 1096216);
    rec_brdf_free(&brdf);
}

static void one_way(const void *data, vec3 wi, vec3 wo, double f[3])
{
    (void)data;
    f[0] = f[1] = f[2] = 0.2 + 0.1 * wi.z - 0.05 * wo.z;
}
static void nothing(void *data)
{
    (void)data;
}

static void test_what_is_not_reciprocal_is_found(void **state)
{
    (void)state;
    static const struct brdf_kind kind = {"one way", one_way, nothing};
    struct brdf brdf = {.kind = &kind};
    struct check check;
    assert_int_equal(rec_check(&check, &brdf, &run, NULL), STATUS_OK);
    assert_true(rec_check_verdict(&check) & CHECK_RECIPROCITY);
}

static int begin(void **state)
{
    (void)state;
    cap_run_begin(&run, 2, true);
    return 0;
}
static int end(void **state)
{
    (void)state;
    cap_run_end(&run);
    return 0;
}

int main(void)
{
    const struct CMUnitTest others[] = {
        cmocka_unit_test(test_chalk_of_two_kinds),
        cmocka_unit_test(test_picture_errors_follow_the_difference),
        cmocka_unit_test(test_only_measured_bins_count),
        cmocka_unit_test(test_what_is_not_reciprocal_is_found),
    };
    struct CMUnitTest tests[ROWS + sizeof others / sizeof *others];
    for (int i = 0; i < ROWS; i++)
        tests[i] = (struct CMUnitTest){rows[i].name, test_table, NULL, NULL, &rows[i]};
    memcpy(tests + ROWS, others, sizeof others);
    return cmocka_run_group_tests(tests, begin, end);
}
