/* test_bins.c -- sums per bin: exact in any order, means and errors by hand. */
#include "near.h"
#include "shot_bins.h"

#include <stdlib.h>
#include <string.h>

enum { SHOTS = 40, SAMPLES = 500 };   // of a shot
static const double single = 1.2e-7;  // strips round to 24 bits what is put in, relative

// A number in [0, 1) that looks like chance and is none.
static double chance(int i, int k)
{
    double x = sin(12.9898 * i + 78.233 * k) * 43758.5453;
    return x - floor(x);
}

static reflectance_sample made(int i)
{
    reflectance_sample s = {
        .angles = {0.3 * chance(i, 0), 0.4 + 0.3 * chance(i, 1), CAP_PI * (2 * chance(i, 2) - 1)},
        .channel = -1,
        .systematic = 0.01 * chance(i, 3),
        .tilt = 1e-3,
        .weight = pow(10, -6 * chance(i, 4)),
    };
    for (int c = 0; c < 3; c++) {
        s.f[c] = pow(10, 8 * chance(i, 5 + c) - 4);
        s.noise[c] = 1e-4 * s.f[c] * s.f[c];
    }
    return s;
}

// A shot's samples, one strip each, into a tally.
static void add_shot(struct tally *tally, const reflectance_sample *sample, int count, bool lends)
{
    struct shot_bins shot = {.grid = tally->grid};
    for (int i = 0; i < count; i++) {
        struct strip s = {.use = ALL_LANES};
        for (int k = 1; k < LANES; k++)
            s.fate[k] = FATE_DARK;
        s.theta_h[0] = (float)sample[i].angles.theta_h;
        s.theta_d[0] = (float)sample[i].angles.theta_d;
        s.phi_d[0] = (float)sample[i].angles.phi_d;
        s.bin[0] = rec_merl_index((half_diff){s.theta_h[0], s.theta_d[0], s.phi_d[0]});
        s.channel[0] = sample[i].channel;
        s.lends[0] = lends;
        s.systematic[0] = (float)sample[i].systematic;
        s.tilt[0] = (float)sample[i].tilt;
        s.weight[0] = (float)sample[i].weight;
        for (int c = 0; c < 3; c++) {
            s.f[c][0] = (float)sample[i].f[c];
            s.noise[c][0] = (float)sample[i].noise[c];
        }
        assert_int_equal(rec_shot_add(&shot, &s, NULL), STATUS_OK);
    }
    assert_int_equal(rec_shot_end(&shot, tally, NULL), STATUS_OK);
    rec_shot_free(&shot);
}

// All of another tally, as members of a team add theirs.
static void merge(struct tally *to, const struct tally *from)
{
    for (int bin = 0; bin < rec_grid_bins(from->grid); bin++)
        if (from->slot[bin])
            assert_int_equal(rec_tally_add_sums(to, bin, &from->sums[from->slot[bin] - 1],
                                                rec_tally_mosaic(from, bin), NULL),
                             STATUS_OK);
}

// Bins of shots in an order of their own, over several tallies that are merged.
static struct bins binned(int stride, int tallies)
{
    struct tally tally[4];
    struct bins bins = {0};
    for (int t = 0; t < tallies; t++)
        assert_int_equal(rec_tally_begin(&tally[t], rec_merl_grid, NULL), STATUS_OK);
    for (int i = 0; i < SHOTS; i++) {
        reflectance_sample s[SAMPLES];
        for (int k = 0; k < SAMPLES; k++)
            s[k] = made(i * stride % SHOTS * SAMPLES + k);
        add_shot(&tally[i % tallies], s, SAMPLES, false);
    }
    for (int t = 1; t < tallies; t++)
        merge(&tally[0], &tally[t]);
    assert_int_equal(rec_tally_finish(&bins, &tally[0], NULL), STATUS_OK);
    for (int t = 0; t < tallies; t++)
        rec_tally_free(&tally[t]);
    return bins;
}

static void test_any_order_and_any_split_give_the_same_bits(void **state)
{
    (void)state;
    struct bins a = binned(1, 1), b = binned(7, 1), c = binned(11, 4);
    assert_true(a.count > 1000);
    assert_int_equal(a.count, b.count);
    assert_int_equal(a.count, c.count);
    assert_memory_equal(a.bin, b.bin, (size_t)a.count * sizeof *a.bin);
    assert_memory_equal(a.bin, c.bin, (size_t)a.count * sizeof *a.bin);
    rec_bins_free(&a);
    rec_bins_free(&b);
    rec_bins_free(&c);
}

static void test_centroids_lie_in_their_bins(void **state)
{
    (void)state;
    struct bins a = binned(1, 1);
    for (int i = 0; i < a.count; i++)
        assert_int_equal(rec_merl_index(a.bin[i].centroid), a.bin[i].index);
    rec_bins_free(&a);
}

static struct bin bin_of(const reflectance_sample *sample, int count, bool lends)
{
    struct tally tally;
    struct bins bins;
    assert_int_equal(rec_tally_begin(&tally, rec_merl_grid, NULL), STATUS_OK);
    add_shot(&tally, sample, count, lends);
    assert_int_equal(rec_tally_finish(&bins, &tally, NULL), STATUS_OK);
    assert_int_equal(bins.count, 1);
    struct bin b = bins.bin[0];
    rec_bins_free(&bins);
    rec_tally_free(&tally);
    return b;
}

static struct bin one_bin(const reflectance_sample *sample, int count)
{
    return bin_of(sample, count, false);
}

static struct bin one_lending_bin(const reflectance_sample *sample, int count)
{
    return bin_of(sample, count, true);
}

// Weights 1 and 1/4, f of 1 and 2: the mean is (1 + 0.5) / 1.25, the noise of it
// sqrt(1 var + var / 16) / 1.25; the systematic parts average without getting smaller.
static void test_mean_and_errors_by_hand(void **state)
{
    (void)state;
    reflectance_sample s[2] = {
        {.angles = {0.5001, 0.7, 0.3001},
         .channel = -1,
         .f = {1, 1, 1},
         .noise = {0.01, 0.04, 0},
         .systematic = 0.02,
         .tilt = 0.001,
         .weight = 1},
        {.angles = {0.5005, 0.7, 0.3005},
         .channel = -1,
         .f = {2, 2, 2},
         .noise = {0.01, 0.04, 0},
         .systematic = 0.02,
         .tilt = 0.001,
         .weight = 0.25},
    };
    struct bin b = one_bin(s, 2);
    assert_int_equal(b.count, 2);
    for (int c = 0; c < 3; c++)
        assert_near(b.mean[c], 1.2, 1e-15);
    assert_near(b.centroid.theta_h, 0.50018, single);
    assert_near(b.noise[0], 0.1 * sqrt(1 + 1.0 / 16) / 1.25, 0.1 * single);
    assert_near(b.noise[1], 0.2 * sqrt(1 + 1.0 / 16) / 1.25, 0.2 * single);
    assert_near(b.sigma[2], 1.2 * 0.02, 0.02 * single);
    assert_near(b.scatter[0], 0.4, 1e-15);  // (1 0.04 + 0.25 0.64) / 1.25 = 0.16
    assert_true(isnan(b.swapped[0]));
}

// A pair and its swapped pair, phi_d and phi_d - pi, share a bin, and their difference is told.
static void test_reciprocity_is_kept_apart(void **state)
{
    (void)state;
    reflectance_sample s[2] = {
        {.angles = {0.5, 0.7, 0.3001},
         .channel = -1,
         .f = {1.0, 1, 1},
         .noise = {0, 0, 0},
         .systematic = 0,
         .tilt = 0,
         .weight = 0.5},
        {.angles = {0.5, 0.7, 0.3001 - CAP_PI},
         .channel = -1,
         .f = {1.1, 1, 1},
         .noise = {0, 0, 0},
         .systematic = 0,
         .tilt = 0,
         .weight = 0.5},
    };
    struct bin b = one_bin(s, 2);
    assert_near(b.mean[0], 1.05, single);
    assert_near(b.centroid.phi_d, 0.3001, 2 * single);
    assert_near(b.swapped[0], -0.1, single);
    assert_near(b.swapped[1], 0, 1e-14);
}

// Photosites of a mosaic: each channel has its own mean at its own centroid, the bin the shared
// one; without blue it is none.
static void test_a_mosaic_by_hand(void **state)
{
    (void)state;
    reflectance_sample s[4] = {
        {.angles = {0.5001, 0.7, 0.3001}, .channel = 0, .f = {1, 0, 0}, .weight = 0.5},
        {.angles = {0.5005, 0.7, 0.3003}, .channel = 1, .f = {0, 2, 0}, .weight = 0.5},
        {.angles = {0.5001, 0.7, 0.3001}, .channel = 1, .f = {0, 4, 0}, .weight = 0.5},
        {.angles = {0.5005, 0.7, 0.3005}, .channel = 2, .f = {0, 0, 8}, .weight = 0.5},
    };
    struct bin b = one_bin(s, 4);
    assert_int_equal(b.count, 4);
    assert_near(b.mean[0], 1, 1e-15);
    assert_near(b.mean[1], 3, 1e-15);
    assert_near(b.mean[2], 8, 1e-15);
    assert_near(b.centroid.theta_h, 0.5003, single);
    assert_near(b.own[0].theta_h, 0.5001, single);
    assert_near(b.own[1].phi_d, 0.3002, single);
    assert_near(b.own[2].phi_d, 0.3005, single);
    struct tally tally;
    struct bins bins;
    assert_int_equal(rec_tally_begin(&tally, rec_merl_grid, NULL), STATUS_OK);
    add_shot(&tally, s, 3, false);
    assert_int_equal(rec_tally_finish(&bins, &tally, NULL), STATUS_OK);
    assert_int_equal(bins.count, 0);
    rec_bins_free(&bins);
    rec_tally_free(&tally);
}

// A red photosite that knows green and blue from its neighbours makes a bin where it is alone;
// where they were measured what it lends does not count.
static void test_lent_channels_by_hand(void **state)
{
    (void)state;
    reflectance_sample s[3] = {
        {.angles = {0.5001, 0.7, 0.3001}, .channel = 0, .f = {1, 3, 5}, .weight = 0.5},
        {.angles = {0.5003, 0.7, 0.3001}, .channel = 1, .f = {9, 4, 5}, .weight = 0.5},
        {.angles = {0.5003, 0.7, 0.3001}, .channel = 0, .f = {1, 3, 7}, .weight = 0.25},
    };
    for (int i = 0; i < 3; i++)
        for (int c = 0; c < 3; c++)
            s[i].noise[c] = 0.04;
    struct bin b = one_lending_bin(s, 3);
    assert_near(b.mean[0], 1, 1e-15);
    assert_near(b.mean[1], 4, 1e-15);
    assert_near(b.mean[2], 5.4, 1e-14);    // (0.5 5 + 0.5 5 + 0.25 7) / 1.25
    assert_near(b.noise[2], 0.2, single);  // neighbours' noise does not average out
    assert_near(b.noise[0], 0.2 * sqrt(0.25 + 0.0625) / 0.75, single);
    assert_true(b.lent[2] && !b.lent[0] && !b.lent[1]);
    assert_near(b.own[2].theta_h, 0.50022, single);
}

// The documented range: 9e8 samples of the largest kind in a shot.
static void test_the_largest_sums_fit(void **state)
{
    (void)state;
    reflectance_sample s = {.angles = {0.5, 0.7, 0.3},
                            .channel = -1,
                            .f = {9.9e4, 9.9e4, 9.9e4},
                            .noise = {0, 0, 0},
                            .systematic = 0,
                            .tilt = 0,
                            .weight = 1};
    struct bin b = one_bin(&s, 1);
    assert_near(b.mean[0], 9.9e4, 1e-10);
    assert_true(1e5 * 1e5 * 9e8 < ldexp(1, 63));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_any_order_and_any_split_give_the_same_bits),
        cmocka_unit_test(test_centroids_lie_in_their_bins),
        cmocka_unit_test(test_mean_and_errors_by_hand),
        cmocka_unit_test(test_reciprocity_is_kept_apart),
        cmocka_unit_test(test_a_mosaic_by_hand),
        cmocka_unit_test(test_lent_channels_by_hand),
        cmocka_unit_test(test_the_largest_sums_fit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
