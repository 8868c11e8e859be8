/* test_fit_cost.c -- what fits make small: derivatives, and pictures as people look at them. */
#include "fit_model.h"
#include "made_table.h"
#include "near.h"

static void test_derivatives_are_those_of_the_residuals(void **state)
{
    (void)state;
    const struct fit_value v = {0.4, rec_fit_log(0.4, 0.5), 0.03, 0.5, 0.8, 1.2,
                                25};  // the last: a near fit is known
    const double fitted[] = {1e-3, 0.1, 0.39, 0.4, 0.5, 2, 40}, step = 1e-6;
    for (int cost = FIT_STATISTICAL; cost <= FIT_PICTURE; cost++)
        for (int k = 0; k < 7; k++) {
            double r[2][2], by_f[2], unused[2];
            rec_fit_miss(cost, &v, fitted[k], r[0], by_f);
            rec_fit_miss(cost, &v, fitted[k] * (1 - step), r[0], unused);
            rec_fit_miss(cost, &v, fitted[k] * (1 + step), r[1], unused);
            for (int j = 0; j < rec_fit_residuals(cost); j++) {
                double slope = (r[1][j] - r[0][j]) / (2 * step * fitted[k]);
                assert_near(by_f[j], slope, 1e-5 * fabs(slope));
            }
        }
}

// Two ways in which a sphere may differ, of about this size: in its highlight, and towards its
// edge.
static double differs(int way, vec3 wi, vec3 wo)
{
    half_diff at = rec_half_diff(wi, wo);
    return way ? 0.1 * exp(-10 * at.theta_h * at.theta_h) : 0.1 * (1 - wi.z * wo.z);
}

// Evenly spread numbers in [0, 1): multiples of powers of the root of x^5 = x + 1 (M. Roberts,
// 2018).
static double even(int i, int axis)
{
    return fmod(0.5 + i * pow(1.1673039782614187, -(axis + 1)), 1);
}

// Squared differences of pictures: a pixel anywhere on the sphere, a lamp anywhere before it.
static void drawn(double square[2])
{
    square[0] = square[1] = 0;
    for (int i = 0; i < 200000; i++) {
        double turn = 2 * CAP_PI * even(i, 0), off = even(i, 1);
        double around = 2 * CAP_PI * even(i, 2), out = even(i, 3);
        vec3 n = {sqrt(out) * cos(around), sqrt(out) * sin(around), sqrt(1 - out)};
        vec3 lamp = {sqrt(off) * cos(turn), sqrt(off) * sin(turn), sqrt(1 - off)};
        vec3 t = vec3_normalize(vec3_cross(n, (vec3){1, 0, 0})), b = vec3_cross(n, t);
        vec3 wi = {vec3_dot(lamp, t), vec3_dot(lamp, b), vec3_dot(lamp, n)}, wo = {t.z, b.z, n.z};
        for (int way = 0; way < 2 && wi.z > 0; way++)
            square[way] += pow(CAP_PI * wi.z * differs(way, wi, wo), 2);
    }
}

// The cost's sum over bins resembles the mean over lamps: the two differences weigh as they do
// there. The cost leaves out the last 5 degrees, and counts some lamps that stand aside.
static void test_bins_stand_for_lit_spheres(void **state)
{
    (void)state;
    const double grey[] = {0.3, 0.3, 0.3};
    struct merl table = made_table(rec_model_find("lambert"), grey);
    struct bins bins = {0};
    struct fit_point *points;
    int count;
    double square[2] = {0}, expected[2];
    assert_int_equal(rec_bins_of_table(&bins, &table, NULL), STATUS_OK);
    assert_int_equal(rec_fit_points(&points, &count, &bins, 20000, NULL), STATUS_OK);
    for (int i = 0; i < count; i++)
        for (int way = 0; way < 2; way++) {
            const struct fit_point *p = &points[i];
            double bright = CAP_PI * fmax(p->wi.z, p->wo.z) * differs(way, p->wi, p->wo);
            square[way] += p->shown * p->shown * bright * bright;
        }
    drawn(expected);
    assert_near(square[1] / square[0], expected[1] / expected[0], 0.1 * expected[1] / expected[0]);
    free(points);
    rec_bins_free(&bins);
    rec_merl_free(&table);
}

// Aluminium bronze of the published parameters, which two lobes do not fit: what people see of it
// is as good as of any model of its kind.
static void test_two_lobes_look_like_a_metal(void **state)
{
    (void)state;
    const double bronze[] = {0.0478786, 0.0313514, 0.0200638, 0.0364976,   0.664975,    0.268836,
                             0.014832,  0.0300126, 0.0490339, 0.459076,    0.450056,    0.529272,
                             6.05524,   0.235756,  0.580647,  5.05524,     0.182842,    0.476088,
                             2.60672,   2.97371,   2.7827,    1.12717e-07, 1.06401e-07, 5.27952e-08,
                             47.783,    36.2767,   31.6066,   0.205635,    0.066289,    -0.0661091};
    const struct model *model = rec_model_find("ggx2");
    struct brdf table = {.table = made_table(rec_model_find("sgd"), bronze)};
    struct bins bins = {0};
    struct fits fits = {0};
    struct run run;
    cap_run_begin(&run, 2, true);
    assert_int_equal(rec_brdf_prepare(&table, NULL), STATUS_OK);
    assert_int_equal(rec_bins_of_table(&bins, &table.table, NULL), STATUS_OK);
    assert_int_equal(rec_fit_by(&fits, &bins, FIT_PICTURE, &model, 1, &run, NULL), STATUS_OK);
    assert_int_equal(rec_fit_pictures(&fits, &table, &run, NULL), STATUS_OK);
    assert_true(fits.fit[0].psnr[0] >= 38);
    cap_run_end(&run);
    rec_fits_free(&fits);
    rec_bins_free(&bins);
    rec_brdf_free(&table);
}

// A logarithm that is rounded must not put a parameter beside its range: nobody could read the fit.
static void test_rounding_keeps_the_ranges(void **state)
{
    (void)state;
    const struct model *sgd = rec_model_find("sgd");
    double value[MODEL_PARAMETERS_MAX];
    int n = 0;
    for (const struct parameter *p = sgd->parameter; p->name; p++)
        for (int c = 0; c < p->size; c++)
            value[n++] = c == 0 ? nextafter(p->low, -INFINITY) : nextafter(p->high, INFINITY);
    rec_fit_confine(sgd, value);
    n = 0;
    for (const struct parameter *p = sgd->parameter; p->name; p++)
        for (int c = 0; c < p->size; c++, n++)
            assert_true(value[n] >= p->low && value[n] <= p->high);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rounding_keeps_the_ranges),
        cmocka_unit_test(test_derivatives_are_those_of_the_residuals),
        cmocka_unit_test(test_bins_stand_for_lit_spheres),
        cmocka_unit_test(test_two_lobes_look_like_a_metal),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
