/* The merge: as good as the Cramer-Rao bound, unbiased, and right about its own variance. */
#include "response.h"
#include "merge.h"
#include "synthetic.h"

enum { WIDTH = 40000, COUNT = 3 * WIDTH, FRAMES = 5 };

static const struct chip chip = {128, 12.6, 5, 48000, 4095};
static const double times[FRAMES] = {1.0 / 1024, 1.0 / 256, 1.0 / 64, 1.0 / 16, 1.0 / 4};
static float dn[FRAMES][COUNT];
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
        sensor.relative[c] = 0;
    }
    return sensor;
}

/* Expose COUNT photosites at a rate of electrons a second, and merge them. */
static void merge_rate(double rate, uint64_t seed)
{
    const struct sensor sensor = chip_sensor();
    const float *frames[FRAMES];
    struct merge_row row = {0};
    for (int f = 0; f < FRAMES; f++) {
        frames[f] = dn[f];
        for (int i = 0; i < COUNT; i++)
            dn[f][i] = chip_expose(&chip, rate * times[f], &seed);
    }
    assert_int_equal(merge_row_make(&row, &sensor, WIDTH, NULL, 0, NULL), STATUS_OK);
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

/* What becomes of the estimate where the fourth frame is on the verge of saturation, in theory.
 *
 * Let x4 be the estimate of four frames and x3 = x4 + e that of three, with s4 and s3 standard
 * deviations; e is independent of x4. Taken is x4 where it lies below a threshold, else x3. So the
 * mean error is 0, the mean square s4^2 + P(x4 above) (s3^2 - s4^2), and the share within one
 * stated deviation an integral over x4. */
struct theory {
    double best, rms, within_1;
};

/* Electrons in the frame at which it is predicted to be two conditional deviations below what is
 * usable: var(d | sum) = v m / (1 + m), m = the shorter frames' variances over its own. */
static double threshold(int frame)
{
    const double read2 = chip.read_noise * chip.read_noise + chip.gain * chip.gain / 12;
    const double usable = chip.full_well - 4 * chip.read_noise, own = read2 + usable;
    double m = 0;
    for (int f = 0; f < frame; f++)
        m += (read2 + usable * times[f] / times[frame]) / own;
    return usable - 2 * sqrt(own * m / (1 + m));
}

static double below(double deviations)  // share of a normal distribution
{
    return 0.5 * erfc(-deviations / sqrt(2));
}

static struct theory theory_of(double rate)
{
    enum { STEPS = 4000 };
    const double before = times[0] + times[1] + times[2], all = before + times[3];
    const double best = 1 / sqrt(rate * all), least = 1 / sqrt(rate * before);
    const double s3 = least / best, e = sqrt(s3 * s3 - 1);  // in parts of s4
    const double end = (threshold(3) / (rate * times[3]) - 1) / best;
    double within = 0;
    for (int k = 0; k < STEPS; k++) {
        const double u = 16 * (k + 0.5) / STEPS - 8;
        const double share = u < end ? fabs(u) < 1 : below((s3 - u) / e) - below((-s3 - u) / e);
        within += share * exp(-u * u / 2) / sqrt(2 * acos(-1)) * 16 / STEPS;
    }
    return (struct theory){best, best * sqrt(1 + (1 - below(end)) * e * e), within};
}

/* Where a frame is on the verge of saturation its own noise must not decide. */
static void test_no_bias_at_the_verge_of_saturation(void **state)
{
    (void)state;
    double within = 0, levels = 0;
    for (double level = 0.9; level < 1.03; level += 0.004) {
        const double rate = level * chip.full_well / times[3];
        merge_rate(rate, 17);
        const struct moments m = measure(rate / chip.full_well);
        const struct theory due = theory_of(rate);
        // Four standard deviations of COUNT photosites. Besides, values that reach the pile though
        // predicted 2 deviations below it, once in 44 times at the worst, are not taken; and shares
        // feel the lattice of whole DN, a fifteenth of a deviation apart, by 0.24 of 1 / 15.
        assert_near(m.mean, 0, 4 * due.rms / sqrt(COUNT) + 0.02 * due.best);
        assert_near(m.rms, due.rms, 4 * due.rms / sqrt(2.0 * COUNT) + 0.02 * due.rms);
        assert_near(m.within_1, due.within_1, 4 * sqrt(0.2166 / COUNT) + 0.24 / 15);
        within += m.within_1;
        levels++;
    }
    // True over all radiances: what lies outside at one lies within at others.
    assert_near(within / levels, 0.6827, 0.01);
}

/* A frame serves up to 3 standard deviations of its own noise, 0.46 %, below saturation. */
static void test_no_frame_is_lost_below_saturation(void **state)
{
    (void)state;
    const double rate = 0.986 * chip.full_well / times[3];
    merge_rate(rate, 23);
    struct moments m = measure(rate / chip.full_well);
    double best = 1 / sqrt(rate * (times[0] + times[1] + times[2] + times[3]));
    assert_near(m.rms, best, 0.03 * best);
    assert_near(m.mean, 0, 0.02 * best);
    assert_near(m.within_1, 0.6827, 0.01);
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

static void test_no_bias_where_it_is_dark(void **state)
{
    (void)state;
    enum { SEEDS = 6 };
    // 20 electrons in the longest frame: one round of weights would make 0.5 % more of them.
    const double rate = 20 / times[FRAMES - 1];
    double mean = 0;
    for (int k = 0; k < SEEDS; k++) {
        merge_rate(rate, 77 + (uint64_t)k);
        mean += measure(rate / chip.full_well).mean / SEEDS;
    }
    assert_near(mean, 0, 4 * bound(rate) / sqrt(SEEDS * COUNT));
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
    float one[3 * NARROW], *frame = one;
    float v[3 * NARROW], s[3 * NARROW];
    struct merge_row row = {0};
    for (int i = 0; i < 3 * NARROW; i++)
        one[i] = 1128;
    assert_int_equal(merge_row_make(&row, &sensor, NARROW, NULL, 0, NULL), STATUS_OK);
    merge_row_scale(&row, flat);
    merge_row(v, s, &row, (const float *const[]){frame}, (const double[]){0.5}, 1);
    merge_row_free(&row);
    assert_near(v[0], 1000 / (chip.full_well / chip.gain) / 0.5, 1e-6);
    assert_near(v[3], 2 * (double)v[0], 1e-6);
    assert_near(s[3], 4 * (double)s[0], 1e-6 * (double)s[3]);
}

static void test_unequal_photosites_add_to_the_variance(void **state)
{
    (void)state;
    struct sensor sensor = chip_sensor();
    float v[2][3], s[2][3], bright[3] = {3128, 3128, 3128};
    for (int k = 0; k < 2; k++) {
        struct merge_row row = {0};
        for (int c = 0; c < 3; c++)
            sensor.relative[c] = 0.02 * k;
        assert_int_equal(merge_row_make(&row, &sensor, 1, NULL, 0, NULL), STATUS_OK);
        merge_row(v[k], s[k], &row, (const float *const[]){bright}, (const double[]){1}, 1);
        merge_row_free(&row);
    }
    assert_near(v[0][0], v[1][0], 0);
    // 2 % of the signal, in quadrature.
    double more = pow(0.02 * (double)v[0][0], 2);
    assert_near((double)s[1][0] - (double)s[0][0], more, 1e-5 * more);
}

/* A photosite that shows the same in every frame is stuck: its frames disagree. */
static void test_frames_that_disagree_are_not_trusted(void **state)
{
    (void)state;
    const struct sensor sensor = chip_sensor();
    float frame[FRAMES][3], v[3], s[3];
    const float *frames[FRAMES];
    struct merge_row row = {0};
    for (int f = 0; f < FRAMES; f++) {
        frames[f] = frame[f];
        frame[f][0] = 900;                                               // stuck
        frame[f][1] = (float)(chip.black + 2000 * times[f] / times[4]);  // in proportion
        frame[f][2] = frame[f][1];
    }
    frame[2][2] += 500;  // a cosmic ray: 6 times the signal, in one frame
    assert_int_equal(merge_row_make(&row, &sensor, 1, NULL, 0, NULL), STATUS_OK);
    merge_row(v, s, &row, frames, times, FRAMES);
    merge_row_free(&row);
    assert_true((double)s[0] > 100 * (double)s[1]);
    assert_true((double)s[2] > 10 * (double)s[1]);
}

/* Photosites of a mosaic take the numbers of their own channel. */
static void test_a_mosaic_row_alternates(void **state)
{
    (void)state;
    struct sensor sensor = chip_sensor();
    sensor.black[0] = 100;
    sensor.black[1] = 200;
    sensor.black[2] = 300;
    static const double expected[2][4] = {{100, 200, 100, 200}, {200, 300, 200, 300}};
    for (int y = 0; y < 2; y++) {
        struct merge_row row = {0};
        assert_int_equal(merge_row_make(&row, &sensor, 4, "RGGB", y, NULL), STATUS_OK);
        assert_int_equal(row.count, 4);
        for (int x = 0; x < 4; x++)
            assert_near(row.black[x], expected[y][x], 0);
        merge_row_free(&row);
    }
}

static void test_srgb_codes(void **state)
{
    (void)state;
    struct curve curve;
    response_known(&curve, RESPONSE_SRGB);
    assert_near(curve.dn[0][0], 0, 0);
    assert_near(curve.dn[2][255], 65535, 0.01);
    // IEC 61966-2-1: code 10 is on the straight piece, 10 / 255 / 12.92; 188 is half of white
    // (0.5029), 118 the photographer's grey (0.1812).
    assert_near(curve.dn[1][10], 65535 * 10 / 255.0 / 12.92, 0.01);
    assert_near((double)curve.dn[0][188] / 65535, 0.5029, 0.0001);
    assert_near((double)curve.dn[0][118] / 65535, 0.1812, 0.0001);
    response_known(&curve, RESPONSE_LINEAR);
    for (int code = 0; code < 256; code++)
        assert_near(curve.dn[1][code], 257 * code, 0.01);
}

int main(void)
{
    struct CMUnitTest tests[RATES + 10];
    for (int i = 0; i < RATES; i++)
        tests[i] = (struct CMUnitTest){"error at the bound", test_error_is_at_the_bound, NULL, NULL,
                                       &rates[i]};
    struct CMUnitTest *more = tests + RATES;
    more[0] = (struct CMUnitTest)cmocka_unit_test(test_no_bias_at_the_verge_of_saturation);
    more[1] = (struct CMUnitTest)cmocka_unit_test(test_darkness_is_zero_on_average);
    more[2] = (struct CMUnitTest)cmocka_unit_test(test_saturated_in_all_frames_is_marked);
    more[3] = (struct CMUnitTest)cmocka_unit_test(test_the_flat_divides);
    more[5] = (struct CMUnitTest)cmocka_unit_test(test_unequal_photosites_add_to_the_variance);
    more[6] = (struct CMUnitTest)cmocka_unit_test(test_frames_that_disagree_are_not_trusted);
    more[7] = (struct CMUnitTest)cmocka_unit_test(test_a_mosaic_row_alternates);
    more[4] = (struct CMUnitTest)cmocka_unit_test(test_srgb_codes);
    more[8] = (struct CMUnitTest)cmocka_unit_test(test_no_bias_where_it_is_dark);
    more[9] = (struct CMUnitTest)cmocka_unit_test(test_no_frame_is_lost_below_saturation);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
