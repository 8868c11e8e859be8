/* test_bins_hdf5.c -- bins.h5, there and back, and broken. */
#include "bins_hdf5.h"
#include "made_bins.h"
#include "near.h"

#include <string.h>
#include <unistd.h>

static const char path[] = "test_bins.h5";
static uint8_t status[MERL_BINS];

static void write_bins(const struct bins *bins)
{
    const struct bins_about about = {
        .version = "test", .input_hash = "0", .reference_albedo = 0.99};
    memset(status, BIN_EXTRAPOLATED, sizeof status);
    for (int i = 0; i < bins->count; i++)
        status[bins->bin[i].index] = BIN_MEASURED;
    assert_int_equal(rec_bins_write(bins, status, &about, path, NULL), STATUS_OK);
}

static struct bins some_bins(void)
{
    const double value[] = {0.3, 0.09, 0.06, 0.12, 1.5};
    return made_bins(rec_model_find("ggx"), value, 101, 0.02);
}

static void test_round_trip(void **state)
{
    (void)state;
    struct bins a = some_bins(), b = {0};
    for (int i = 0; i < a.count; i++) {
        a.bin[i].systematic = 0.01;
        a.bin[i].tilt = 1e-4 * i;
    }
    write_bins(&a);
    assert_int_equal(rec_bins_read(&b, path, NULL), STATUS_OK);
    assert_int_equal(a.count, b.count);
    for (int i = 0; i < a.count; i++) {
        const struct bin *x = &a.bin[i], *y = &b.bin[i];
        assert_int_equal(x->index, y->index);
        assert_int_equal(x->count, y->count);
        assert_memory_equal(&x->centroid, &y->centroid, sizeof x->centroid);
        assert_near(x->systematic, y->systematic, 1e-9);
        assert_near(x->tilt, y->tilt, 6e-8 * x->tilt);
        for (int c = 0; c < 3; c++) {
            assert_near(x->mean[c], y->mean[c], 6e-8 * fabs(x->mean[c]));  // float's rounding
            assert_near(x->sigma[c], y->sigma[c], 6e-8 * x->sigma[c]);
        }
    }
    rec_bins_free(&a);
    rec_bins_free(&b);
    unlink(path);
}

static void test_no_file(void **state)
{
    (void)state;
    struct bins b = {0};
    struct error err = {0};
    assert_int_equal(rec_bins_read(&b, "no_such_bins.h5", &err), STATUS_IO);
    assert_non_null(strstr(err.text, "no_such_bins.h5"));
}

static void test_not_hdf5(void **state)
{
    (void)state;
    struct bins b = {0};
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fputs("this is no HDF5 file", file);
    fclose(file);
    assert_int_equal(rec_bins_read(&b, path, NULL), STATUS_FORMAT);
    assert_null(b.bin);
    unlink(path);
}

static void test_cut_short(void **state)
{
    (void)state;
    struct bins a = some_bins(), b = {0};
    write_bins(&a);
    assert_int_equal(truncate(path, 100000), 0);
    assert_int_equal(rec_bins_read(&b, path, NULL), STATUS_FORMAT);
    assert_null(b.bin);
    rec_bins_free(&a);
    unlink(path);
}

static void test_a_centroid_outside_its_bin_is_refused(void **state)
{
    (void)state;
    struct bins a = some_bins(), b = {0};
    a.bin[7].centroid.theta_d += 0.1;
    write_bins(&a);
    assert_int_equal(rec_bins_read(&b, path, NULL), STATUS_FORMAT);
    rec_bins_free(&a);
    unlink(path);
}

static void test_a_folder_that_is_not_there(void **state)
{
    (void)state;
    struct bins a = some_bins();
    const struct bins_about about = {0};
    assert_int_equal(rec_bins_write(&a, status, &about, "no/such/folder/bins.h5", NULL), STATUS_IO);
    rec_bins_free(&a);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_no_file),
        cmocka_unit_test(test_not_hdf5),
        cmocka_unit_test(test_cut_short),
        cmocka_unit_test(test_a_centroid_outside_its_bin_is_refused),
        cmocka_unit_test(test_a_folder_that_is_not_there),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
