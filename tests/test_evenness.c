/* The unequal response of photosites comes out of a flat frame, noise taken off; dead and bright
 * ones are found, their neighbours are not blamed. */
#include "evenness.h"
#include "synthetic.h"

enum { WIDTH = 600, HEIGHT = 400 };

static const struct chip chip = {512, 3.3, 3, 45000, 14000};

static struct sensor chip_sensor(void)
{
    struct sensor sensor;
    for (int c = 0; c < 3; c++) {
        sensor.black[c] = chip.black;
        sensor.white[c] = chip.black + chip.full_well / chip.gain;
        sensor.usable[c] = sensor.white[c] - 20;
        sensor.gain[c] = chip.gain;
        sensor.read_noise[c] = hypot(chip.read_noise / chip.gain, sqrt(1.0 / 12));
        sensor.relative[c] = 0;
    }
    return sensor;
}

/* Electrons at a photosite of a lens that leaves 80 % in the corners. */
static double light(int x, int y)
{
    double u = 2.0 * x / WIDTH - 1, v = 2.0 * y / HEIGHT - 1;
    return 25000 * (1 - 0.1 * (u * u + v * v));
}

static bool is_dead(int x, int y)
{
    return (x == 100 && y == 50) || (x == 301 && y == 50);
}

static bool is_bright(int x, int y)
{
    return x == 411 && y == 333;
}

static struct evenness measure(const char *cfa, double unequal, uint64_t seed)
{
    const struct sensor sensor = chip_sensor();
    const int samples = *cfa ? 1 : 3;
    struct evenness e = {0};
    struct evenness_sums sums = {{0}, {0}};
    static float row[3 * WIDTH];
    for (int y = 0; y < HEIGHT; y++) {
        for (int i = 0; i < samples * WIDTH; i++) {
            int x = i / samples;
            double electrons = light(x, y) * (1 + unequal * random_normal(&seed));
            electrons *= is_dead(x, y) ? 0.3 : is_bright(x, y) ? 1.4 : 1;
            row[i] = (float)(chip_expose(&chip, electrons, &seed) - chip.black);
        }
        assert_int_equal(evenness_add(&e, &sums, row, samples * WIDTH, y, cfa, &sensor, NULL),
                         STATUS_OK);
    }
    evenness_end(&e, &sums);
    return e;
}

static void test_unequal_response_is_measured(void **state)
{
    (void)state;
    const char *const cfas[] = {"", "GRBG"};
    for (int k = 0; k < 2; k++) {
        struct evenness e = measure(cfas[k], 0.005, 3);
        // Of s = 0.8 % and at least 60000 photosites: 4e-7 of 2.5e-5 in the square.
        for (int c = 0; c < 3; c++)
            assert_near(e.relative[c], 0.005, 0.0002);
        evenness_free(&e);
    }
}

static void test_noise_alone_is_none(void **state)
{
    (void)state;
    struct evenness e = measure("", 0, 4);
    for (int c = 0; c < 3; c++)
        assert_true(e.relative[c] < 0.001);
    evenness_free(&e);
}

static void test_defects_are_found_and_marked(void **state)
{
    (void)state;
    struct evenness e = measure("RGGB", 0.005, 5);
    static float variance[WIDTH];
    int marked = 0;
    assert_int_equal(e.defects, 3);
    for (int y = 0; y < HEIGHT; y++) {
        memset(variance, 0, sizeof variance);
        evenness_mark(&e, y, WIDTH, variance);
        for (int x = 0; x < WIDTH; x++) {
            assert_true((variance[x] == INFINITY) == (is_dead(x, y) || is_bright(x, y)));
            marked += variance[x] == INFINITY;
        }
    }
    assert_int_equal(marked, 3);
    evenness_free(&e);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_unequal_response_is_measured),
        cmocka_unit_test(test_noise_alone_is_none),
        cmocka_unit_test(test_defects_are_found_and_marked),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
