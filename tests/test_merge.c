/* The merge: as good as the Cramer-Rao bound, unbiased, and right about its own variance. */
#include "bracket.h"
#include "merge.h"
#include "synthetic.h"

enum { WIDTH = 40000, COUNT = 3 * WIDTH, FRAMES = 5 };

static const struct chip chip = {128, 12.6, 5, 48000, 4095};
static const double times[FRAMES] = {1.0 / 1024, 1.0 / 256, 1.0 / 64, 1.0 / 16, 1.0 / 4};
static uint16_t dn[FRAMES][COUNT];
static float value[COUNT], variance[COUNT];

/* What chip is, as the sensor that merge is told. */
static struct sensor chip_sensor(void)
{
    struct sensor sensor;
    for (int c = 0; c < 3; c++) {
        double read = chip.read_noise / chip.gain;
        sensor.black[c] = chip.black;
        sensor.white[c] = chip.black + chip.full_well / chip.gain;
        sensor.usable[c] = sensor.white[c] - 4 * read;
        sensor.gain[c] = chip.gain;
        sensor.read_noise[c] = hypot(read, sqrt(1.0 / 12));
    }
    return sensor;
}

/* Expose COUNT photosites at a rate of electrons a second, and merge them. */
static void merge_rate(double rate, uint64_t seed)
{
    const struct sensor sensor = chip_sensor();
    const uint16_t *frames[FRAMES];
    struct merge_row row = {0};
    for (int f = 0; f < FRAMES; f++) {
        frames[f] = dn[f];
        for (int i = 0; i < COUNT; i++)
            dn[f][i] = chip_expose(&chip, rate * times[f], &seed);
    }
    assert_int_equal(merge_row_make(&row, &sensor, WIDTH, NULL), STATUS_OK);
    merge_row(value, variance, &row, frames, times, FRAMES);
    merge_row_free(&row);
}

/* Standard deviation, relative, of the best estimate from frames that cannot saturate. */
static double bound(double rate)
{
    double read2 = chip.read_noise * chip.read_noise + chip.gain * chip.gain / 12, information = 0;
    for (int f = 0; f < FRAMES; f++)
        if (rate * times[f] + 8 * sqrt(rate * times[f]) < chip.full_well)
            information += times[f] * times[f] / (read2 + rate * times[f]);
    return 1 / (sqrt(information) * rate);
}

struct moments {
    double mean, rms, within_1, within_2;
};

/* Of value / truth - 1, and the shares within 1 and 2 stated standard deviations. */
static struct moments measure(double truth)
{
    struct moments m = {0};
    for (int i = 0; i < COUNT; i++) {
        double error = (double)value[i] / truth - 1, sigma = sqrt((double)variance[i]) / truth;
        m.mean += error / COUNT;
        m.rms += error * error / COUNT;
        m.within_1 += (fabs(error) < sigma) / (double)COUNT;
        m.within_2 += (fabs(error) < 2 * sigma) / (double)COUNT;
    }
    m.rms = sqrt(m.rms);
    return m;
}

// Electrons a second, from 100 in the longest frame to 40000 in the shortest.
static double rates[] = {400, 3e3, 3e4, 1e5, 4e5, 2e6, 4e7};
enum { RATES = sizeof rates / sizeof *rates };

static void test_error_is_at_the_bound(void **state)
{
    double rate = *(const double *)*state, best = bound(rate);
    merge_rate(rate, (uint64_t)rate);
    // Radiance is in full scales a second.
    struct moments m = measure(rate / chip.full_well);
    assert_near(m.rms, best, 0.02 * best);
    assert_near(m.mean, 0, 5 * best / sqrt(COUNT) + 1e-5);
    // Below 2 DN of noise the lattice of values shows in the shares.
    double lattice = best * rate * times[FRAMES - 1] < 2 * chip.gain ? 0.03 : 0;
    assert_near(m.within_1, 0.6827, 0.01 + lattice);
    assert_near(m.within_2, 0.9545, 0.005 + lattice);
}

/* Where a frame is on the verge of saturation its own noise must not decide. */
static void test_no_bias_at_the_verge_of_saturation(void **state)
{
    (void)state;
    for (double level = 0.9; level < 1.05; level += 0.01) {
        double rate = level * chip.full_well / times[3];
        merge_rate(rate, 17);
        struct moments m = measure(rate / chip.full_well);
        // One of two frames decides now and then: the error lies between both bounds.
        double best = 1 / sqrt(rate * (times[0] + times[1] + times[2] + times[3]));
        double least = 1 / sqrt(rate * (times[0] + times[1] + times[2]));
        assert_true(m.rms > 0.97 * best && m.rms < 1.05 * least);
        assert_near(m.mean, 0, 0.05 * best);
        // Of two estimates the stated variance is that of the one taken.
        assert_near(m.within_1, 0.6827, 0.04);
    }
}

static void test_darkness_is_zero_on_average(void **state)
{
    (void)state;
    merge_rate(0, 5);
    double mean = 0, negative = 0, sigma = sqrt((double)variance[0]);
    for (int i = 0; i < COUNT; i++) {
        mean += (double)value[i] / COUNT;
        negative += (value[i] < 0) / (double)COUNT;
    }
    assert_near(mean, 0, 0.03 * sigma);
    assert_true(negative > 0.3);
}

static void test_saturated_in_all_frames_is_marked(void **state)
{
    (void)state;
    merge_rate(2 * chip.full_well / times[0], 3);
    for (int i = 0; i < COUNT; i++) {
        assert_true(isinf(variance[i]));
        // A lower bound of the truth, 2 full scales, and within 1 % of 1.
        assert_near(value[i] * times[0], 1, 0.01);
    }
}

static void test_the_flat_divides(void **state)
{
    (void)state;
    enum { NARROW = 2 };
    const struct sensor sensor = chip_sensor();
    const float flat[3 * NARROW] = {1, 1, 1, 0.5f, 0.5f, 0.5f};
    uint16_t one[3 * NARROW], *frame = one;
    float v[3 * NARROW], s[3 * NARROW];
    struct merge_row row = {0};
    for (int i = 0; i < 3 * NARROW; i++)
        one[i] = 1128;
    assert_int_equal(merge_row_make(&row, &sensor, NARROW, NULL), STATUS_OK);
    merge_row_scale(&row, &sensor, flat);
    merge_row(v, s, &row, (const uint16_t *const[]){frame}, (const double[]){0.5}, 1);
    merge_row_free(&row);
    assert_near(v[0], 1000 / (chip.full_well / chip.gain) / 0.5, 1e-6);
    assert_near(v[3], 2 * (double)v[0], 1e-6);
    assert_near(s[3], 4 * (double)s[0], 1e-6 * (double)s[3]);
}

static void test_srgb_codes(void **state)
{
    (void)state;
    uint16_t table[256];
    response_table(table, RESPONSE_SRGB);
    assert_int_equal(table[0], 0);
    assert_int_equal(table[255], 65535);
    // IEC 61966-2-1: code 10 is on the straight piece, 10 / 255 / 12.92; 188 is half of white
    // (0.5029), 118 the photographer's grey (0.1812).
    assert_near(table[10], 65535 * 10 / 255.0 / 12.92, 0.5);
    assert_near(table[188] / 65535.0, 0.5029, 0.0001);
    assert_near(table[118] / 65535.0, 0.1812, 0.0001);
    response_table(table, RESPONSE_LINEAR);
    for (int code = 0; code < 256; code++)
        assert_int_equal(table[code], 257 * code);
}

int main(void)
{
    struct CMUnitTest tests[RATES + 5];
    for (int i = 0; i < RATES; i++)
        tests[i] = (struct CMUnitTest){"error at the bound", test_error_is_at_the_bound, NULL, NULL,
                                       &rates[i]};
    struct CMUnitTest *more = tests + RATES;
    more[0] = (struct CMUnitTest)cmocka_unit_test(test_no_bias_at_the_verge_of_saturation);
    more[1] = (struct CMUnitTest)cmocka_unit_test(test_darkness_is_zero_on_average);
    more[2] = (struct CMUnitTest)cmocka_unit_test(test_saturated_in_all_frames_is_marked);
    more[3] = (struct CMUnitTest)cmocka_unit_test(test_the_flat_divides);
    more[4] = (struct CMUnitTest)cmocka_unit_test(test_srgb_codes);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
