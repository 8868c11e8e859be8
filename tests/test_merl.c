/* test_merl.c -- MERL's bins and files. */
#include "near.h"
#include "reconstruct.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char path[] = "test_merl.binary";

static void test_every_bin_above_the_horizon_returns_to_itself(void **state)
{
    (void)state;
    int above = 0;
    for (int bin = 0; bin < MERL_BINS; bin++) {
        assert_int_equal(rec_merl_index(rec_merl_center(bin)), bin);
        if (!rec_merl_above(bin))
            continue;
        vec3 wi, wo;
        rec_directions(rec_merl_center(bin), &wi, &wo);
        assert_int_equal(rec_merl_index(rec_half_diff(wi, wo)), bin);
        above++;
    }
    assert_int_equal(above, 1096216);  // formulas.md
}

static void test_swapped_directions_share_a_bin(void **state)
{
    (void)state;
    for (int bin = 0; bin < MERL_BINS; bin += 97)
        if (rec_merl_above(bin)) {
            vec3 wi, wo;
            rec_directions(rec_merl_center(bin), &wi, &wo);
            assert_int_equal(rec_merl_index(rec_half_diff(wo, wi)), bin);
        }
}

static void test_mirror_bin_is_across_the_plane_of_incidence(void **state)
{
    (void)state;
    for (int bin = 0; bin < MERL_BINS; bin += 89) {
        half_diff a = rec_merl_center(bin);
        a.phi_d = -a.phi_d;
        assert_int_equal(rec_merl_index(a), rec_merl_mirror(bin));
        assert_int_equal(rec_merl_mirror(rec_merl_mirror(bin)), bin);
    }
}

static void test_edges_of_the_angles_stay_inside(void **state)
{
    (void)state;
    assert_int_equal(rec_merl_index((half_diff){0, 0, 0}), 0);
    assert_int_equal(rec_merl_index((half_diff){CAP_PI / 2, CAP_PI / 2, CAP_PI}), MERL_BINS - 1);
    assert_int_equal(rec_merl_index((half_diff){0, 0, -1e-300}), MERL_PHI_D - 1);
    // theta_h of 1 degree: sqrt(1/90) * 90 = 9.49.
    assert_int_equal(rec_merl_index((half_diff){CAP_PI / 180, 0, 0}),
                     9 * MERL_THETA_D * MERL_PHI_D);
}

static struct merl ramp(void)
{
    struct merl m = {.value = malloc(3 * (size_t)MERL_BINS * sizeof *m.value)};
    assert_non_null(m.value);
    for (size_t i = 0; i < 3 * (size_t)MERL_BINS; i++)
        m.value[i] = i % 5 == 4 ? -1 : 1e-3 * (double)i;
    return m;
}

static void test_file_round_trip(void **state)
{
    (void)state;
    struct merl a = ramp(), b = {0};
    assert_int_equal(rec_merl_write(&a, path, NULL), STATUS_OK);
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    assert_int_equal(ftell(file), 34992012);
    fclose(file);
    assert_int_equal(rec_merl_read(&b, path, NULL), STATUS_OK);
    for (size_t i = 0; i < 3 * (size_t)MERL_BINS; i++) {
        if (a.value[i] < 0)
            assert_true(b.value[i] < 0);
        else
            assert_near(b.value[i], a.value[i], 3e-16 * a.value[i]);  // two roundings
    }
    rec_merl_free(&a);
    rec_merl_free(&b);
    unlink(path);
}

static void test_stored_green_one_is_its_scale(void **state)
{
    (void)state;
    struct merl a = ramp();
    a.value[MERL_BINS] = 1.15 / 1500;
    assert_int_equal(rec_merl_write(&a, path, NULL), STATUS_OK);
    double stored;
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    fseek(file, 12 + 8 * (long)MERL_BINS, SEEK_SET);
    assert_int_equal(fread(&stored, sizeof stored, 1, file), 1);
    fclose(file);
    assert_near(stored, 1, 1e-15);
    rec_merl_free(&a);
    unlink(path);
}

// Write `size` bytes of header and zeros, and read them back.
static enum status read_made(const int32_t n[3], long size, struct error *err)
{
    struct merl merl = {0};
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fwrite(n, sizeof *n, 3, file);
    assert_int_equal(ftruncate(fileno(file), size), 0);
    fclose(file);
    enum status status = rec_merl_read(&merl, path, err);
    assert_true(!status == (merl.value != NULL));
    rec_merl_free(&merl);
    unlink(path);
    return status;
}

static void test_bad_files(void **state)
{
    (void)state;
    struct error err = {0};
    struct merl merl = {0};
    const int32_t good[3] = {90, 90, 180}, wrong[3] = {90, 90, 90};
    assert_int_equal(rec_merl_read(&merl, "no_such_file", &err), STATUS_IO);
    assert_non_null(strstr(err.text, "no_such_file"));
    assert_int_equal(read_made(wrong, 34992012, &err), STATUS_FORMAT);
    assert_int_equal(read_made(good, 8, &err), STATUS_FORMAT);
    assert_int_equal(read_made(good, 34992011, &err), STATUS_FORMAT);
    assert_int_equal(read_made(good, 34992013, &err), STATUS_FORMAT);
    assert_int_equal(read_made(good, 34992012, &err), STATUS_OK);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_bin_above_the_horizon_returns_to_itself),
        cmocka_unit_test(test_swapped_directions_share_a_bin),
        cmocka_unit_test(test_mirror_bin_is_across_the_plane_of_incidence),
        cmocka_unit_test(test_edges_of_the_angles_stay_inside),
        cmocka_unit_test(test_file_round_trip),
        cmocka_unit_test(test_stored_green_one_is_its_scale),
        cmocka_unit_test(test_bad_files),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
