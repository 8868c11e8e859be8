/* Noise block by block: where the frames of a bracket disagree more, the variance is larger, and it
 * is the right one in smooth blocks and in textured ones. */
#include "blocks.h"
#include "synthetic.h"

enum { COLUMNS = 40, ROWS = 16, FRAMES = 3, COUNT = 3 * COLUMNS };

static const double times[FRAMES] = {0.01, 0.04, 0.16};
static const double rate = 2.5e5;  // DN a second: the longest frame is well exposed

static float dn[FRAMES][ROWS * COUNT], value[ROWS * COUNT], variance[ROWS * COUNT];
static float chi2[ROWS * COUNT], freedom[ROWS * COUNT];

static struct sensor encoded(double relative)
{
    struct sensor sensor;
    for (int c = 0; c < 3; c++) {
        sensor.black[c] = 0;
        sensor.white[c] = 65535;
        sensor.usable[c] = 60000;
        sensor.gain[c] = 0.05;
        sensor.read_noise[c] = 100;
        sensor.relative[c] = relative;
    }
    return sensor;
}

/* Blocks in a chessboard: noise of `smooth` and of `rough` times what the sensor says. */
static double factor_at(int x, int y, double smooth, double rough)
{
    return (x / BLOCK_SIDE + y / BLOCK_SIDE) % 2 ? rough : smooth;
}

/* Noise of a frame as the sensor states it. */
static double stated(const struct sensor *s, double time)
{
    return sqrt(pow(s->read_noise[0], 2) + rate * time / s->gain[0]);
}

/* Frames of an unknown encoder. */
static struct encoded_row encoded_row(const struct merge_row *row, const float *const *frames)
{
    static const float *const unknown[FRAMES];
    static const struct code_steps steps;
    return (struct encoded_row){row, frames, times, unknown, unknown, &steps, FRAMES};
}

static void merge(const struct sensor *sensor, double smooth, double rough, uint64_t seed)
{
    struct merge_row row = {0};
    assert_int_equal(merge_row_make(&row, sensor, COLUMNS, NULL, 0, NULL), STATUS_OK);
    for (int f = 0; f < FRAMES; f++)
        for (int i = 0; i < ROWS * COUNT; i++) {
            double factor = factor_at(i % COUNT / 3, i / COUNT, smooth, rough);
            dn[f][i] =
                (float)(rate * times[f] + factor * stated(sensor, times[f]) * random_normal(&seed));
        }
    for (int y = 0; y < ROWS; y++) {
        const float *frames[FRAMES];
        int at = y * COUNT;
        for (int f = 0; f < FRAMES; f++)
            frames[f] = dn[f] + at;
        merge_row(value + at, variance + at, &row, frames, times, FRAMES);
        const struct encoded_row one = encoded_row(&row, frames);
        blocks_disagreement(chi2 + at, freedom + at, variance + at, value + at, &one);
    }
    blocks_apply(variance, value, chi2, freedom, &row, false, ROWS);
    merge_row_free(&row);
}

static void test_each_block_has_its_own_noise(void **state)
{
    (void)state;
    const struct sensor sensor = encoded(0);
    merge(&sensor, 0.4, 3, 7);
    for (int y = 0; y < ROWS; y++)
        for (int i = 0; i < COUNT; i++) {
            double information = 0, factor = factor_at(i / 3, y, 0.4, 3);
            for (int f = 0; f < FRAMES; f++)
                information += pow(times[f] / stated(&sensor, times[f]), 2);
            double all = 1 / sqrt(information) / 65535;  // of all frames, as the sensor states it
            double prior = 4.0 / (4 + 128);              // of a block's degrees of freedom
            // 128 degrees of freedom know a deviation to 1/16.
            assert_near(sqrt((double)variance[y * COUNT + i]), factor * all,
                        factor * all / 4 + prior * all);
        }
}

static void test_what_frames_share_stays(void **state)
{
    (void)state;
    const struct sensor sensor = encoded(0.01);
    merge(&sensor, 0, 0, 8);
    for (int i = 0; i < ROWS * COUNT; i++) {
        double shared = 0.01 * (double)value[i];
        assert_true(variance[i] >= (float)(0.999 * shared * shared));
        assert_true(variance[i] < (float)(1.3 * shared * shared));
    }
}

static void test_saturated_ones_stay_so(void **state)
{
    (void)state;
    const struct sensor sensor = encoded(0);
    struct merge_row row = {0};
    assert_int_equal(merge_row_make(&row, &sensor, COLUMNS, NULL, 0, NULL), STATUS_OK);
    const float *frames[FRAMES] = {dn[0], dn[0], dn[0]};
    for (int i = 0; i < COUNT; i++)
        dn[0][i] = 65000;
    merge_row(value, variance, &row, frames, times, FRAMES);
    const struct encoded_row one = encoded_row(&row, frames);
    blocks_disagreement(chi2, freedom, variance, value, &one);
    blocks_apply(variance, value, chi2, freedom, &row, false, 1);
    for (int i = 0; i < COUNT; i++)
        assert_true(variance[i] == INFINITY && freedom[i] == 0);
    merge_row_free(&row);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_each_block_has_its_own_noise),
        cmocka_unit_test(test_what_frames_share_stays),
        cmocka_unit_test(test_saturated_ones_stay_so),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
