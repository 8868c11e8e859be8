/* test_goniometer.c -- the virtual gonioreflectometer against closed forms. */
#include "goniometer.h"
#include "microfacet.h"
#include "near.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static struct run run;
static const double degree = CAP_PI / 180;

static struct surface mirror(double alpha, int bounces, long long rays)
{
    return (struct surface){.kind = SURFACE_GAUSSIAN,
                            .alpha = alpha,
                            .nodes = 200,
                            .material = {.mirror = {1, 1, 0.5}},
                            .rays = rays,
                            .bounces = bounces,
                            .seed = 5};
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Where each ray is reflected once, Gaussian slopes are Beckmann's model. Over bins with theta_h
 * from 2 to 15 degrees (beyond the first step and before the lobe has fallen to a tenth) and both
 * angles up to 60 degrees: 300,000 rays are some 500 a step, 4.5 % each, of which the median over
 * steps hardly keeps any; the patch's middle has about 500 facets of its own slopes, 4.5 %;
 * Walter's G is within 0.4 %, and a step's bend within 1 %. */
static void test_gaussian_slopes_are_beckmanns(void **state)
{
    (void)state;
    struct surface surface = mirror(0.25, 1, 300000);
    struct merl table = {0};
    struct light_balance balance;
    assert_int_equal(sam_goniometer(&table, &balance, &surface, &run, NULL), STATUS_OK);
    double *ratio = malloc(MERL_BINS * sizeof *ratio);
    assert_non_null(ratio);
    int n = 0;
    for (int bin = 0; bin < MERL_BINS; bin += 41) {
        vec3 wi, wo;
        half_diff a = rec_merl_center(bin);
        rec_directions(a, &wi, &wo);
        if (a.theta_h < 2 * degree || a.theta_h > 15 * degree || fmin(wi.z, wo.z) < 0.5)
            continue;
        double lobe = rec_lobe_beckmann(rec_facet(wi, wo), 0.25);
        ratio[n++] = table.value[bin] / lobe;
        assert_near(table.value[2 * (size_t)MERL_BINS + (size_t)bin] / table.value[bin], 0.5, 1e-9);
    }
    qsort(ratio, (size_t)n, sizeof *ratio, by_size);
    assert_true(n > 1000);
    assert_near(ratio[n / 2], 1, 0.06);
    assert_near(ratio[n / 20], 1, 0.3);  // single steps: 4.5 % each way, and the lobe's foot
    assert_near(ratio[n - 1 - n / 20], 1, 0.3);
    free(ratio);
    rec_merl_free(&table);
}

// A mirror keeps all light: what does not leave is lost at the patch's ends. At most 1 of 100 is.
static void test_light_is_kept(void **state)
{
    (void)state;
    struct surface surface = mirror(0.4, 30, 20000);
    surface.material.mirror[2] = 1;
    struct merl table = {0};
    struct light_balance balance;
    assert_int_equal(sam_goniometer(&table, &balance, &surface, &run, NULL), STATUS_OK);
    assert_near(balance.out + balance.absorbed + balance.lost, 1, 1e-9);
    assert_near(balance.absorbed, 0, 1e-12);
    assert_true(balance.lost < 0.01);
    rec_merl_free(&table);
}

// Slopes of a thousandth: a plane. Half the light leaves, evenly.
static void test_flat_chalk_is_chalk(void **state)
{
    (void)state;
    struct surface surface = mirror(0.001, 4, 200000);
    const double half[3] = {0.5, 0.5, 0.5};
    surface.material = sam_material(rec_model_find("lambert"), half);
    struct merl table = {0};
    struct light_balance balance;
    double albedo[3];
    assert_int_equal(sam_goniometer(&table, &balance, &surface, &run, NULL), STATUS_OK);
    assert_near(balance.out, 0.5, 1e-3);
    for (double theta = 10; theta < 70; theta += 20) {
        rec_table_albedo(albedo, &table, theta * degree);
        assert_near(albedo[1], 0.5,
                    0.02);  // a hemisphere's steps get some 3000 rays: 2 %, and gaps
    }
    for (int bin = 0; bin < MERL_BINS; bin++)
        assert_true(rec_merl_above(bin) ? table.value[bin] >= 0 : table.value[bin] == -1);
    rec_merl_free(&table);
}

static void test_any_number_of_threads(void **state)
{
    (void)state;
    struct surface pile = {.kind = SURFACE_FIBRES,
                           .fibres = 500,
                           .radius = 0.004,
                           .length = 0.05,
                           .tilt = 0.4,
                           .rays = 20000,
                           .bounces = 8,
                           .seed = 2};
    const double red[3] = {0.6, 0.1, 0.1};
    pile.material = sam_material(rec_model_find("lambert"), red);
    struct merl table[2] = {{0}, {0}};
    struct light_balance balance[2];
    for (int k = 0; k < 2; k++) {
        struct run own;
        cap_run_begin(&own, 1 + 2 * k, true);
        assert_int_equal(sam_goniometer(&table[k], &balance[k], &pile, &own, NULL), STATUS_OK);
        cap_run_end(&own);
    }
    assert_memory_equal(table[0].value, table[1].value, 3 * sizeof(double) * MERL_BINS);
    assert_true(balance[0].out > 0.02
                && balance[0].out < 0.3);  // fibres darken what they are made of
    rec_merl_free(&table[0]);
    rec_merl_free(&table[1]);
}

static struct bad_row {
    const char *name, *text, *told;
} bad[] = {
    {"no such kind", "surface: {kind: foam}\nmaterial: {mirror: 1}\n", "gaussian or fibres"},
    {"no width", "surface: {kind: gaussian}\nmaterial: {mirror: 1}\n", "alpha"},
    {"no material", "surface: {kind: gaussian, alpha: 0.2}\n", "material"},
    {"a sum",
     "surface: {kind: gaussian, alpha: 0.2}\nmaterial: [{mirror: 1}, {model: lambert, albedo: "
     "0}]\n",
     "one model"},
    {"an unknown key", "surface: {kind: gaussian, alpha: 0.2, beta: 1}\nmaterial: {mirror: 1}\n",
     "beta"},
};
enum { BAD = sizeof bad / sizeof *bad };

static void test_bad_file(void **state)
{
    static const char path[] = "test_goniometer.yaml";
    const struct bad_row *row = *state;
    struct surface surface = {.nodes = 0};
    struct error err = {0};
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fprintf(file, "goniocam_surface: 1\n%s", row->text);
    fclose(file);
    assert_int_equal(sam_surface_read(&surface, path, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, row->told));
    unlink(path);
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
    struct CMUnitTest tests[BAD + 4];
    for (int i = 0; i < BAD; i++)
        tests[i] = (struct CMUnitTest){bad[i].name, test_bad_file, NULL, NULL, &bad[i]};
    const struct CMUnitTest others[] = {
        cmocka_unit_test(test_gaussian_slopes_are_beckmanns),
        cmocka_unit_test(test_light_is_kept),
        cmocka_unit_test(test_flat_chalk_is_chalk),
        cmocka_unit_test(test_any_number_of_threads),
    };
    memcpy(tests + BAD, others, sizeof others);
    return cmocka_run_group_tests(tests, begin, end);
}
