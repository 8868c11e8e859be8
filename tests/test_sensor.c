/* Levels and noise, found on brackets of a chip whose levels and noise are known. */
#include "black.h"
#include "sensor.h"
#include "synthetic.h"

enum { PHOTOSITES = 60000, FRAMES = 5 };

static const struct sensor_known nothing = {{NAN, NAN, NAN}, NAN, NAN, NAN, NAN, false, false};

/* A bracket of radiances spread evenly in the logarithm over four decades, a tenth black. */
struct bracket {
    double time[FRAMES];
    float *dn[3][FRAMES];
    struct bracket_sample sample[3];
    struct bracket_sample *channel[3];
};

static void expose(struct bracket *bracket, const struct chip *chip, int frames, double ratio,
                   double brightest)
{
    static uint64_t seed;
    uint64_t state = ++seed;
    for (int f = 0; f < frames; f++) {
        bracket->time[f] = pow(ratio, f) / 1024;
        for (int c = 0; c < 3; c++) {
            bracket->dn[c][f] = malloc(PHOTOSITES * sizeof *bracket->dn[c][f]);
            assert_non_null(bracket->dn[c][f]);
        }
    }
    for (int i = 0; i < 3 * PHOTOSITES; i++) {
        double rate = brightest * pow(10, -4 * random_uniform(&state));
        if (random_uniform(&state) < 0.1)
            rate = 0;
        for (int f = 0; f < frames; f++)
            bracket->dn[i % 3][f][i / 3] = chip_expose(chip, rate * bracket->time[f], &state);
    }
    for (int c = 0; c < 3; c++) {
        bracket->sample[c] = (struct bracket_sample){.frames = frames,
                                                     .time = bracket->time,
                                                     .dn = bracket->dn[c],
                                                     .photosites = PHOTOSITES};
        bracket->channel[c] = &bracket->sample[c];
    }
}

static void release(struct bracket *bracket)
{
    for (int f = 0; f < bracket->sample[0].frames; f++)
        for (int c = 0; c < 3; c++)
            free(bracket->dn[c][f]);
}

static struct row {
    const char *name;
    struct chip chip;
    double ratio, brightest;  // electrons a second
    double cut_off;           // DN by which values cut off at 0 may raise black
    bool saturates;
} rows[] = {
    {"full well below the converter's end", {128, 12.6, 5, 48000, 4095}, 4, 3e7, 0, true},
    {"converter full first", {64, 2, 3, 1e9, 4095}, 2, 8e6, 0, true},
    {"14 bits", {512, 4, 8, 60000, 16383}, 4, 3e7, 0, true},
    {"noisy 16 bits", {1000.4, 1, 20, 60000, 65535}, 3, 2e7, 0, true},
    {"black cut off at 0", {0, 4, 3, 1e9, 4095}, 4, 2e7, 0.25, true},
    {"nothing saturates", {128, 4, 5, 1e9, 16383}, 2, 5e5, 0, false},
};
enum { ROWS = sizeof rows / sizeof *rows };

static void test_chip(void **state)
{
    const struct row *r = *state;
    const struct chip *chip = &r->chip;
    struct bracket bracket;
    struct sensor sensor;
    struct sensor_doubts doubts = {0};
    expose(&bracket, chip, FRAMES, r->ratio, r->brightest);
    sensor_from_samples(&sensor, bracket.channel, 1, &nothing, &doubts);
    release(&bracket);
    double saturation = fmin(chip->black + chip->full_well / chip->gain, chip->top);
    double read = hypot(chip->read_noise / chip->gain, sqrt(1.0 / 12));
    assert_false(doubts.black || doubts.noise);
    for (int c = 0; c < 3; c++) {
        // The darkest tenth, 4 standard deviations; intercepts are noisier than values.
        double black_sigma = 1.1 * read / sqrt(0.1 * PHOTOSITES);
        assert_near(sensor.black[c], chip->black, 4 * black_sigma + r->cut_off);
        assert_near(sensor.gain[c], chip->gain, 0.05 * chip->gain);
        assert_near(sensor.read_noise[c], read, 0.1 * read);
        if (r->saturates) {
            // Read noise is cut off where the converter ends: half of its mean deviation.
            assert_near(sensor.white[c], saturation, 0.4 * read + 0.1);
            assert_true(sensor.usable[c] < saturation - 3.5 * chip->read_noise / chip->gain
                        || chip->top == (int)saturation);
            assert_true(sensor.usable[c] > saturation - 8 * read - 5);
        } else {
            assert_true(sensor.white[c]
                        > chip->black + r->brightest * bracket.time[FRAMES - 1] / chip->gain);
        }
    }
}

/* Fisher's information on the black level in photosites of evenly spread logarithms of radiance, a
 * tenth black, as expose() makes them: of the frames but one, with x t_0 up to 25 DN. */
static double information(const struct chip *chip, const double *time, double brightest)
{
    enum { STEPS = 1000 };
    const double read2 = pow(chip->read_noise / chip->gain, 2) + 1.0 / 12;
    double sum = 0;
    for (int k = 0; k <= STEPS; k++) {
        double rate = k == STEPS ? 0 : brightest * pow(10, -4 * (k + 0.5) / STEPS) / chip->gain;
        double s0 = 0, s1 = 0, s2 = 0;
        if (rate * time[0] > 25 || rate * time[FRAMES - 2] > 0.95 * chip->top)
            continue;
        for (int f = 0; f < FRAMES; f++) {
            if (f == FRAMES - 2 || rate * time[f] > 0.95 * chip->top)
                continue;
            double w = 1 / (read2 + rate * time[f] / chip->gain);
            s0 += w;
            s1 += w * time[f];
            s2 += w * time[f] * time[f];
        }
        sum += (k == STEPS ? 0.1 : 0.9 / STEPS) * PHOTOSITES * (s0 - s1 * s1 / s2);
    }
    return sum;
}

/* Channels of one level serve each other; one that is its own stays so. */
static void test_black_is_as_good_as_photographs_tell(void **state)
{
    (void)state;
    enum { CAPTURES = 6 };
    const struct chip chip = {128, 5.3, 6, 1e9, 4095};
    const double brightest = 3e6;
    for (int k = 0; k < CAPTURES; k++) {
        const double apart = k < CAPTURES / 2 ? 0 : 3;
        struct bracket bracket;
        struct sensor sensor;
        struct sensor_doubts doubts = {0};
        expose(&bracket, &chip, FRAMES, 4, brightest);
        for (int f = 0; f < FRAMES; f++)
            for (int i = 0; i < PHOTOSITES; i++)
                bracket.dn[2][f][i] += (float)apart;
        sensor_from_samples(&sensor, bracket.channel, 1, &nothing, &doubts);
        sensor_refine_black(&sensor, bracket.channel, 1, &nothing, NULL);
        release(&bracket);
        double sigma = 1 / sqrt(information(&chip, bracket.time, brightest));
        for (int c = 0; c < 3; c++)
            assert_near(sensor.black[c], chip.black + (c == 2 ? apart : 0),
                        3.5 * sigma / (apart > 0 ? 1 : sqrt(3)));
    }
}

static void test_a_known_black_stays(void **state)
{
    (void)state;
    const struct chip chip = {128, 12.6, 5, 48000, 4095};
    const struct sensor_known known = {{100, 100, 100}, NAN, NAN, NAN, NAN, false, false};
    struct bracket bracket;
    struct sensor sensor;
    struct sensor_doubts doubts = {0};
    expose(&bracket, &chip, FRAMES, 4, 3e7);
    sensor_from_samples(&sensor, bracket.channel, 1, &known, &doubts);
    sensor_refine_black(&sensor, bracket.channel, 1, &known, NULL);
    release(&bracket);
    assert_near(sensor.black[1], 100, 0);
}

static void test_no_saturated_value_is_usable(void **state)
{
    (void)state;
    const struct chip chip = {128, 12.6, 40, 48000, 4095};  // 3 DN of read noise
    struct bracket bracket;
    struct sensor sensor;
    struct sensor_doubts doubts = {0};
    expose(&bracket, &chip, FRAMES, 4, 3e7);
    sensor_from_samples(&sensor, bracket.channel, 1, &nothing, &doubts);
    release(&bracket);
    uint64_t state_of_noise = 99;
    int let_through = 0;
    for (int i = 0; i < 100000; i++)
        let_through += chip_expose(&chip, 1e6, &state_of_noise) < sensor.usable[0];
    assert_in_range(let_through, 0, 20);  // 4 standard deviations: 3 of 100000
}

static void test_wrong_times_do_not_spoil_the_noise(void **state)
{
    (void)state;
    const struct chip chip = {128, 12.6, 5, 48000, 4095};
    struct bracket bracket;
    struct sensor sensor;
    struct sensor_doubts doubts = {0};
    expose(&bracket, &chip, FRAMES, 4, 3e7);
    for (int f = 0; f < FRAMES; f++)
        bracket.time[f] *= f % 2 ? 1.06 : 1;  // as 1/30 that is 1/32
    sensor_from_samples(&sensor, bracket.channel, 1, &nothing, &doubts);
    release(&bracket);
    assert_near(sensor.gain[1], 12.6, 0.07 * 12.6);
    assert_near(sensor.black[1], 128, 0.05);
}

static void test_what_is_given_is_taken(void **state)
{
    (void)state;
    const struct chip chip = {128, 12.6, 5, 48000, 4095};
    const struct sensor_known known = {{100, 100, 100}, 3000, 7, 14, NAN, false, false};
    struct bracket bracket;
    struct sensor sensor;
    struct sensor_doubts doubts = {0};
    expose(&bracket, &chip, FRAMES, 4, 3e7);
    sensor_from_samples(&sensor, bracket.channel, 1, &known, &doubts);
    release(&bracket);
    assert_near(sensor.black[2], 100, 0);
    assert_near(sensor.white[2], 3000, 0);
    assert_near(sensor.gain[2], 7, 0);
    assert_near(sensor.read_noise[2], sqrt(4 + 1.0 / 12), 1e-12);
}

static void test_a_single_exposure_is_doubtful(void **state)
{
    (void)state;
    const struct chip chip = {128, 12.6, 5, 48000, 4095};
    struct bracket bracket;
    struct sensor sensor;
    struct sensor_doubts doubts = {0};
    expose(&bracket, &chip, 1, 4, 3e6);
    sensor_from_samples(&sensor, bracket.channel, 1, &nothing, &doubts);
    release(&bracket);
    assert_true(doubts.black && doubts.noise);
    assert_true(sensor.white[0] > sensor.black[0] && sensor.gain[0] > 0);
}

int main(void)
{
    struct CMUnitTest tests[ROWS + 6];
    for (int i = 0; i < ROWS; i++)
        tests[i] = (struct CMUnitTest){rows[i].name, test_chip, NULL, NULL, &rows[i]};
    tests[ROWS] = (struct CMUnitTest)cmocka_unit_test(test_no_saturated_value_is_usable);
    tests[ROWS + 1] = (struct CMUnitTest)cmocka_unit_test(test_wrong_times_do_not_spoil_the_noise);
    tests[ROWS + 2] = (struct CMUnitTest)cmocka_unit_test(test_what_is_given_is_taken);
    tests[ROWS + 3] = (struct CMUnitTest)cmocka_unit_test(test_a_single_exposure_is_doubtful);
    tests[ROWS + 4] =
        (struct CMUnitTest)cmocka_unit_test(test_black_is_as_good_as_photographs_tell);
    tests[ROWS + 5] = (struct CMUnitTest)cmocka_unit_test(test_a_known_black_stays);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
