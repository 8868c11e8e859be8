/* test_fill.c -- the complete table: complete, positive, true to what was measured. */
#include "made_bins.h"
#include "near.h"
#include "smooth.h"

static const double plastic[] = {0.3, 0.09, 0.06, 0.12, 1.5};
static struct run run;

static struct fit fit_of(const double *value)
{
    struct fit fit = {.model = rec_model_find("ggx")};
    for (int k = 0; k < 5; k++)
        fit.value[k] = value[k];
    return fit;
}

static double at(const struct merl *m, int c, int bin)
{
    return m->value[(size_t)c * MERL_BINS + (size_t)bin];
}

struct table {
    struct merl merl;
    uint8_t status[MERL_BINS];
};

// A table filled from bins of the plastic, by a fit that may be wrong.
static struct table *filled(const struct bins *bins, const double *fitted)
{
    struct table *t = calloc(1, sizeof *t);
    struct fit fit = fit_of(fitted);
    assert_int_equal(rec_fill(&t->merl, t->status, bins, &fit, &run, NULL), STATUS_OK);
    return t;
}

static void free_table(struct table *t)
{
    rec_merl_free(&t->merl);
    free(t);
}

static void test_every_bin_above_the_horizon_has_a_value(void **state)
{
    (void)state;
    struct bins bins = made_bins(rec_model_find("ggx"), plastic, 37, 0.3);
    bins.bin[5].mean[1] = -0.01;  // noise in the dark
    struct table *t = filled(&bins, plastic);
    for (int i = 0; i < MERL_BINS; i++) {
        bool above = rec_merl_above(i);
        assert_true(above == (t->status[i] != BIN_IMPOSSIBLE));
        for (int c = 0; c < 3; c++)
            assert_true(above ? at(&t->merl, c, i) >= 0 && isfinite(at(&t->merl, c, i))
                              : at(&t->merl, c, i) == -1);
    }
    free_table(t);
    rec_bins_free(&bins);
}

static void test_measured_bins_are_moved_to_their_centers(void **state)
{
    (void)state;
    struct bins bins = made_bins(rec_model_find("ggx"), plastic, 37, 0);
    struct table *t = filled(&bins, plastic);
    for (int i = 0; i < bins.count; i++) {
        int bin = bins.bin[i].index;
        vec3 wi, wo;
        double f[3];
        rec_directions(rec_merl_center(bin), &wi, &wo);
        rec_model_find("ggx")->eval(plastic, wi, wo, f);
        assert_int_equal(t->status[bin], BIN_MEASURED);
        for (int c = 0; c < 3; c++)
            assert_near(at(&t->merl, c, bin), f[c], 1e-12 * f[c]);
    }
    free_table(t);
    rec_bins_free(&bins);
}

static void test_mirror_bins_take_the_measurement(void **state)
{
    (void)state;
    struct bins bins = made_bins(rec_model_find("ggx"), plastic, 37, 0.2);
    struct table *t = filled(&bins, plastic);
    int mirrored = 0;
    for (int i = 0; i < bins.count; i++) {
        int bin = bins.bin[i].index, other = rec_merl_mirror(bin);
        if (t->status[other] != BIN_INTERPOLATED)
            continue;
        assert_near(at(&t->merl, 0, other), at(&t->merl, 0, bin), 1e-12 * at(&t->merl, 0, bin));
        mirrored++;
    }
    assert_true(mirrored > bins.count / 2);
    free_table(t);
    rec_bins_free(&bins);
}

// A fit that is 10 % too dark everywhere: between measurements the table is right all the same.
static void test_the_correction_agrees_with_its_neighbours(void **state)
{
    (void)state;
    double dark[5] = {0.27, 0.081, 0.054, 0.12, 1.5};
    struct bins bins = made_bins(rec_model_find("ggx"), plastic, 37, 0);
    for (int i = 0; i < bins.count; i++)
        for (int c = 0; c < 3; c++)
            bins.bin[i].sigma[c] = 0.01 * bins.bin[i].mean[c];
    struct table *t = filled(&bins, dark);
    for (int i = 1; i < MERL_BINS; i += 1009) {
        vec3 wi, wo;
        double f[3];
        rec_directions(rec_merl_center(i), &wi, &wo);
        if (!rec_merl_above(i) || wi.z < 0.1 || wo.z < 0.1)
            continue;
        rec_model_find("ggx")->eval(plastic, wi, wo, f);
        assert_near(at(&t->merl, 0, i) / f[0], 1, 0.03);
    }
    free_table(t);
    rec_bins_free(&bins);
}

static void test_without_measurements_the_fit_stands(void **state)
{
    (void)state;
    struct bins none = {0};
    struct table *t = filled(&none, plastic);
    vec3 wi, wo;
    double f[3];
    int bin = rec_merl_index((half_diff){0.4, 0.6, 1});
    rec_directions(rec_merl_center(bin), &wi, &wo);
    rec_model_find("ggx")->eval(plastic, wi, wo, f);
    assert_int_equal(t->status[bin], BIN_EXTRAPOLATED);
    assert_near(at(&t->merl, 2, bin), f[2], 1e-12 * f[2]);
    free_table(t);
}

static void test_albedo_of_a_lambert_table(void **state)
{
    (void)state;
    struct merl m = {malloc(3 * (size_t)MERL_BINS * sizeof(double))};
    double albedo[3];
    for (size_t i = 0; i < 3 * (size_t)MERL_BINS; i++)
        m.value[i] = 0.5 / CAP_PI;
    rec_table_albedo(albedo, &m, 0.8);
    assert_near(albedo[1], 0.5, 1e-4);
    rec_merl_free(&m);
}

// One bin of 1, smoothed, is the product of three exponentials; around phi_d it closes.
static void test_smoothing_of_one_bin(void **state)
{
    (void)state;
    float *field = calloc(MERL_BINS, sizeof *field);
    const double length[3] = {3, 2, 5};
    int center = 2 + MERL_PHI_D * (40 + MERL_THETA_D * 30);
    field[center] = 1;
    rec_smooth(field, length);
    int row = MERL_PHI_D, slab = MERL_PHI_D * MERL_THETA_D;
    assert_near(field[center], 1, 1e-6);
    assert_near(field[center + 3], exp(-3.0 / 5), 1e-6);
    assert_near(field[center + 2 * row], exp(-2.0 / 2), 1e-6);
    assert_near(field[center - 4 * slab], exp(-4.0 / 3), 1e-6);
    assert_near(field[center + slab - row + 1], exp(-1.0 / 3 - 1.0 / 2 - 1.0 / 5), 1e-6);
    assert_near(field[center - 2 + 177], exp(-5.0 / 5), 1e-6);  // across phi_d = 0
    free(field);
}

// A fit that returns 140 % of the light, beside measurements that return 60 %: what is filled gives
// way, down to all light at most; what was measured stays.
static void test_filled_bins_do_not_make_light(void **state)
{
    (void)state;
    const double grey[] = {0.6, 0.6, 0.6};
    struct fit fit = {.model = rec_model_find("lambert"), .value = {1.4, 1.4, 0.6}};
    struct bins bins = made_bins(fit.model, grey, 31, 0);
    struct merl table = {0};
    uint8_t *status = malloc(MERL_BINS);
    assert_non_null(status);
    assert_int_equal(rec_fill(&table, status, &bins, &fit, &run, NULL), STATUS_OK);
    for (int degrees = 1; degrees < 85; degrees += 7) {
        double albedo[3];
        rec_table_albedo(albedo, &table, degrees * CAP_PI / 180);
        assert_true(albedo[0] <= 1.01 && albedo[1] <= 1.01);  // bins of a degree, sums of one too
        assert_near(albedo[2], 0.6, 0.01);
    }
    for (int i = 0; i < bins.count; i++)
        assert_near(table.value[bins.bin[i].index], 0.6 / CAP_PI, 1e-9);
    rec_merl_free(&table);
    rec_bins_free(&bins);
    free(status);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_bin_above_the_horizon_has_a_value),
        cmocka_unit_test(test_measured_bins_are_moved_to_their_centers),
        cmocka_unit_test(test_mirror_bins_take_the_measurement),
        cmocka_unit_test(test_the_correction_agrees_with_its_neighbours),
        cmocka_unit_test(test_without_measurements_the_fit_stands),
        cmocka_unit_test(test_albedo_of_a_lambert_table),
        cmocka_unit_test(test_smoothing_of_one_bin),
        cmocka_unit_test(test_filled_bins_do_not_make_light),
    };
    cap_run_begin(&run, 2, true);
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    cap_run_end(&run);
    return failed;
}
