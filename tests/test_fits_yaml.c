/* test_fits_yaml.c -- fits.yaml, there and back, by hand, and broken; any BRDF from a file. */
#include "near.h"
#include "reconstruct.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char path[] = "test_fits.yaml";

static void put(const char *text)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
}

static void test_round_trip(void **state)
{
    (void)state;
    struct fit fit[2] = {
        {.model = rec_model_find("ggx"),
         .log_rms = 0.012,
         .relative_median = 1.0 / 3,
         .chi = 1.1,
         .bins = 8000},
        {.model = rec_model_find("lambert"), .log_rms = 0.5, .relative_median = 0.1, .chi = 30},
    };
    const double value[] = {0.3, 1.0 / 7, 0.06, 0.12, 1.5};
    for (int k = 0; k < 5; k++) {
        fit[0].value[k] = value[k];
        fit[0].sigma[k] = value[k] / 300;
    }
    struct fits a = {fit, 2}, b = {0};
    assert_int_equal(rec_fits_write(&a, path, NULL), STATUS_OK);
    assert_int_equal(rec_fits_read(&b, path, NULL), STATUS_OK);
    assert_int_equal(b.count, 2);
    for (int i = 0; i < 2; i++) {
        assert_ptr_equal(b.fit[i].model, fit[i].model);
        assert_memory_equal(b.fit[i].value, fit[i].value, sizeof fit[i].value);
        assert_memory_equal(b.fit[i].sigma, fit[i].sigma, sizeof fit[i].sigma);
        assert_true(b.fit[i].log_rms == fit[i].log_rms && b.fit[i].chi == fit[i].chi);
        assert_int_equal(b.fit[i].bins, fit[i].bins);
    }
    rec_fits_free(&b);
    unlink(path);
}

// A person may write plain numbers, and one number for a colour.
static void test_by_hand(void **state)
{
    (void)state;
    struct brdf brdf = {0};
    double f[3];
    vec3 up = {0, 0, 1}, below = {0, 0.6, -0.8};
    put("models: [{name: lambert, parameters: {albedo: 0.5}}]\n");
    assert_int_equal(rec_brdf_read(&brdf, path, NULL), STATUS_OK);
    rec_brdf_eval(&brdf, up, up, f);
    for (int c = 0; c < 3; c++)
        assert_near(f[c], 0.5 / CAP_PI, 1e-15);
    rec_brdf_eval(&brdf, up, below, f);
    assert_near(f[1], 0, 0);
    rec_brdf_free(&brdf);
    unlink(path);
}

static struct row {
    const char *name, *text, *told;
} rows[] = {
    {"empty", "", "not a fits.yaml"},
    {"not YAML", "models: [{name: ggx", "line"},
    {"another file", "cameras: []\n", "not a fits.yaml"},
    {"no models", "models: []\n", "not a fits.yaml"},
    {"unknown model", "models:\n- name: magic\n  parameters: {}\n", "line 2: magic"},
    {"no name", "models:\n- parameters: {albedo: 1}\n", "no name"},
    {"no parameters", "models:\n- name: lambert\n", "lambert: no parameters"},
    {"missing parameter", "models:\n- name: ggx\n  parameters: {albedo: 0.5}\n", "alpha"},
    {"two numbers for a colour", "models:\n- name: lambert\n  parameters: {albedo: [1, 1]}\n",
     "albedo: three numbers"},
    {"a word for a number", "models:\n- name: lambert\n  parameters: {albedo: white}\n", "line 3"},
    {"out of range", "models:\n- name: lambert\n  parameters: {albedo: 1.5}\n",
     "albedo is not in [0, 1]"},
};
enum { ROWS = sizeof rows / sizeof *rows };

static void test_broken(void **state)
{
    const struct row *r = *state;
    struct fits fits = {0};
    struct error err = {0};
    put(r->text);
    assert_int_equal(rec_fits_read(&fits, path, &err), STATUS_FORMAT);
    assert_null(fits.fit);
    assert_non_null(strstr(err.text, path));
    if (!strstr(err.text, r->told))
        print_error("\"%s\" does not tell \"%s\"\n", err.text, r->told);
    assert_non_null(strstr(err.text, r->told));
    unlink(path);
}

static void test_a_table_from_a_file_or_its_folder(void **state)
{
    (void)state;
    struct merl m = {malloc(3 * (size_t)MERL_BINS * sizeof(double))};
    struct brdf file = {0}, folder = {0};
    double f[3];
    const int bin = 731851;
    vec3 wi, wo;
    rec_directions(rec_merl_center(bin), &wi, &wo);
    for (size_t i = 0; i < 3 * (size_t)MERL_BINS; i++)
        m.value[i] = 1e-6 * (double)(i % MERL_BINS);
    mkdir("test_out", 0777);
    assert_int_equal(rec_merl_write(&m, "test_out/brdf.binary", NULL), STATUS_OK);
    assert_int_equal(rec_brdf_read(&file, "test_out/brdf.binary", NULL), STATUS_OK);
    assert_int_equal(rec_brdf_read(&folder, "test_out", NULL), STATUS_OK);
    rec_brdf_eval(&file, wi, wo, f);
    assert_near(f[2], 1e-6 * bin, 3e-6);  // places to 2e-8 rad among 260,000 bins of theta_d
    rec_brdf_eval(&folder, wo, wi, f);    // reciprocity
    assert_near(f[2], 1e-6 * bin, 3e-6);  // places to 2e-8 rad among 260,000 bins of theta_d
    rec_brdf_free(&file);
    rec_brdf_free(&folder);
    rec_merl_free(&m);
    unlink("test_out/brdf.binary");
    rmdir("test_out");
}

static void test_no_brdf_in_a_file(void **state)
{
    (void)state;
    struct brdf brdf = {0};
    struct error err = {0};
    assert_int_equal(rec_brdf_read(&brdf, "no_such_brdf", &err), STATUS_IO);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fwrite("\0\1\2\3", 1, 4, file);
    fclose(file);
    assert_int_equal(rec_brdf_read(&brdf, path, &err), STATUS_FORMAT);
    unlink(path);
}

int main(void)
{
    struct CMUnitTest tests[ROWS + 4];
    for (int i = 0; i < ROWS; i++)
        tests[i] = (struct CMUnitTest){rows[i].name, test_broken, NULL, NULL, &rows[i]};
    tests[ROWS] = (struct CMUnitTest)cmocka_unit_test(test_round_trip);
    tests[ROWS + 1] = (struct CMUnitTest)cmocka_unit_test(test_by_hand);
    tests[ROWS + 2] = (struct CMUnitTest)cmocka_unit_test(test_a_table_from_a_file_or_its_folder);
    tests[ROWS + 3] = (struct CMUnitTest)cmocka_unit_test(test_no_brdf_in_a_file);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
