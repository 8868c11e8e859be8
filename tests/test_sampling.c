/* test_sampling.c -- directions come as often as their density says, for every model. */
#include "made_models.h"
#include "made_table.h"
#include "near.h"

enum { RINGS = 12, SECTORS = 12, CELLS = RINGS * SECTORS, DRAWN = 20000, FINE = 12 };

static vec3 direction(double theta, double phi)
{
    return (vec3){sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
}

// Cells of equal solid angle: rings of cos theta, sectors of phi.
static int cell_of(vec3 w)
{
    int ring = (int)(w.z * RINGS);
    int sector = (int)((atan2(w.y, w.x) / (2 * CAP_PI) + 0.5) * SECTORS);
    return (ring < RINGS ? ring : RINGS - 1) * SECTORS + (sector < SECTORS ? sector : SECTORS - 1);
}

/** Integral of the density over each cell by midpoints. */
static void expect(const struct brdf *brdf, vec3 wi, double expected[CELLS])
{
    const double part = 2 * CAP_PI / (CELLS * FINE * FINE);
    for (int k = 0; k < CELLS; k++)
        expected[k] = 0;
    for (int i = 0; i < RINGS * FINE; i++)
        for (int j = 0; j < SECTORS * FINE; j++) {
            double z = (i + 0.5) / (RINGS * FINE);
            double phi = 2 * CAP_PI * ((j + 0.5) / (SECTORS * FINE) - 0.5);
            vec3 wo = direction(acos(z), phi);
            expected[cell_of(wo)] += part * rec_brdf_pdf(brdf, wi, wo);
        }
}

// Pearson's chi^2 over cells that expect ten at least, the rest and what falls below the horizon
// as one more. Its mean is the number of cells, its variance twice that: five sigmas are allowed,
// and 1 % of the count for the midpoints of narrow lobes.
static void check_frequencies(const struct brdf *brdf, vec3 wi, struct random *random)
{
    double expected[CELLS], found[CELLS] = {0}, chi2 = 0, rest = DRAWN, found_rest = DRAWN;
    int n = 1;
    expect(brdf, wi, expected);
    for (int i = 0; i < DRAWN; i++) {
        double u[3] = {sam_uniform(random), sam_uniform(random), sam_uniform(random)};
        vec3 wo;
        double density = rec_brdf_sample(brdf, wi, u, &wo);
        if (density == 0)
            continue;
        assert_true(wo.z > 0);
        assert_near(vec3_length(wo), 1, 1e-9);
        assert_near(rec_brdf_pdf(brdf, wi, wo), density, 1e-9 * density);
        found[cell_of(wo)]++;
    }
    for (int k = 0; k < CELLS; k++) {
        double e = expected[k] * DRAWN;
        if (e < 10)
            continue;
        chi2 += (found[k] - e) * (found[k] - e) / (e + 1e-4 * e * e);
        rest -= e;
        found_rest -= found[k];
        n++;
    }
    assert_true(rest > -0.01 * DRAWN);
    if (rest > 10)
        chi2 += (found_rest - rest) * (found_rest - rest) / (rest + 1e-4 * DRAWN * DRAWN);
    if (chi2 > n + 5 * sqrt(2.0 * n))
        print_error("%s: chi^2 is %.1f over %d cells\n", brdf->model ? brdf->model->name : "table",
                    chi2, n);
    assert_true(chi2 <= n + 5 * sqrt(2.0 * n));
}

static void test_frequencies_of(void **state)
{
    const struct model *model = *state;
    struct random random = sam_random_at(5, 0, 0);
    for (int i = 0; i < 3; i++) {
        struct brdf brdf = {.model = model};
        draw_all(model, &random, brdf.value);
        for (double theta = 0; theta < 1.5; theta += 0.45)
            check_frequencies(&brdf, direction(theta, 1 + theta), &random);
    }
}

static void test_frequencies_of_a_table(void **state)
{
    (void)state;
    const double value[] = {0.3, 0.2, 0.1, 0.25, 1.5};
    struct random random = sam_random_at(6, 0, 0);
    struct brdf brdf = {.table = made_table(rec_model_find("ggx"), value)};
    assert_int_equal(rec_brdf_prepare(&brdf, NULL), STATUS_OK);
    for (double theta = 0; theta < 1.57; theta += 0.26)
        check_frequencies(&brdf, direction(theta, 1 + theta), &random);
    rec_brdf_free(&brdf);
}

// Mean and variance of f cos_o / density, of all channels together.
static void estimate(const struct brdf *table, const struct brdf *by, vec3 wi, double *mean,
                     double *variance)
{
    struct random random = sam_random_at(7, 0, 0);
    double sum = 0, sum2 = 0;
    for (int i = 0; i < DRAWN; i++) {
        double u[3] = {sam_uniform(&random), sam_uniform(&random), sam_uniform(&random)}, f[3];
        vec3 wo;
        double density = rec_brdf_sample(by, wi, u, &wo);
        if (density == 0)
            continue;
        rec_brdf_eval(table, wi, wo, f);
        double x = (f[0] + f[1] + f[2]) / 3 * wo.z / density;
        sum += x;
        sum2 += x * x;
    }
    *mean = sum / DRAWN;
    *variance = sum2 / DRAWN - *mean * *mean;
}

// A table's own cells estimate its albedo with less noise than the lobes of the model that it was
// made from, and without bias.
static void test_a_table_samples_itself_best(void **state)
{
    (void)state;
    const double value[] = {0.05, 0.05, 0.05, 0.5, 0.4, 0.3, 0.15, 1};
    struct brdf lobes = {.model = rec_model_find("ggx_schlick")};
    memcpy(lobes.value, value, sizeof value);
    struct brdf table = {.table = made_table(lobes.model, value)};
    assert_int_equal(rec_brdf_prepare(&table, NULL), STATUS_OK);
    for (double theta = 0; theta < 1.5; theta += 0.35) {
        double mean[2], variance[2];
        estimate(&table, &table, direction(theta, 2), &mean[0], &variance[0]);
        estimate(&table, &lobes, direction(theta, 2), &mean[1], &variance[1]);
        assert_near(mean[0], mean[1], 4 * sqrt((variance[0] + variance[1]) / DRAWN));
        assert_true(variance[0] <= 1.5 * variance[1]);
    }
    rec_brdf_free(&table);
}

int main(void)
{
    struct CMUnitTest tests[64];
    int n = 0;
    for (const struct model *const *m = rec_models_all; *m; m++)
        tests[n++] =
            (struct CMUnitTest){(*m)->name, test_frequencies_of, NULL, NULL, (void *)(uintptr_t)*m};
    tests[n++] = (struct CMUnitTest)cmocka_unit_test(test_frequencies_of_a_table);
    tests[n++] = (struct CMUnitTest)cmocka_unit_test(test_a_table_samples_itself_best);
    return _cmocka_run_group_tests("sampling", tests, (size_t)n, NULL, NULL);
}
