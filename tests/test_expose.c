/* Photographs: mean and noise of DN are what the sensor's model says. */
#include "expose.h"
#include "near.h"

enum { WIDTH = 200, HEIGHT = 100, PIXELS = WIDTH * HEIGHT };

static uint16_t dn[PIXELS * 3];
static float value[PIXELS * 3];

static struct scene plain_scene(void)
{
    return (struct scene){
        .seed = 21,
        .camera = {.width = WIDTH, .height = HEIGHT, .center = {99.5, 49.5}},
        .sensor = {.electrons = 1e6,
                   .dn_per_electron = 0.2,
                   .full_well = 20000,
                   .read_noise = 6,
                   .black_level = 300,
                   .adc_max = 4095,
                   .channel_gain = {1, 0.5, 2}},
    };
}

static void fill(float radiance)
{
    for (int i = 0; i < PIXELS * 3; i++)
        value[i] = radiance;
}

static void moments(int channel, double *mean, double *variance)
{
    double sum = 0, square = 0;
    for (int i = 0; i < PIXELS; i++) {
        sum += dn[3 * i + channel];
        square += (double)dn[3 * i + channel] * dn[3 * i + channel];
    }
    *mean = sum / PIXELS;
    *variance = square / PIXELS - *mean * *mean;
}

// DN = black + e g, variance = (e + read^2) g^2 + 1/12: photons, read noise, rounding.
static void test_mean_and_variance(void **state)
{
    (void)state;
    struct scene scene = plain_scene();
    fill(0.25f);
    sam_sensor_expose(&scene, value, 0.01, 7, dn);
    for (int c = 0; c < 3; c++) {
        double e = 0.25 * 1e6 * 0.01 * scene.sensor.channel_gain[c], mean, variance;
        double expected = (e + 36) * 0.04 + 1.0 / 12;
        moments(c, &mean, &variance);
        assert_near(mean, 300 + 0.2 * e, 5 * sqrt(expected / PIXELS));
        assert_near(variance, expected, 5 * expected * sqrt(2.0 / PIXELS));
    }
}

static void test_darkness_is_the_black_level(void **state)
{
    (void)state;
    struct scene scene = plain_scene();
    double mean, variance, expected = 36 * 0.04 + 1.0 / 12;
    fill(0);
    sam_sensor_expose(&scene, value, 1, 8, dn);
    moments(0, &mean, &variance);
    assert_near(mean, 300, 5 * sqrt(expected / PIXELS));
    assert_near(variance, expected, 5 * expected * sqrt(2.0 / PIXELS));
}

// The converter ends at adc_max, or the well before it, where read noise is still seen.
static void test_saturation(void **state)
{
    (void)state;
    struct scene scene = plain_scene();
    double mean, variance;
    fill(10);
    sam_sensor_expose(&scene, value, 1, 9, dn);
    moments(0, &mean, &variance);
    assert_near(mean, 4095, 0);
    scene.sensor.full_well = 10000;
    sam_sensor_expose(&scene, value, 1, 10, dn);
    moments(0, &mean, &variance);
    assert_near(mean, 300 + 2000, 5 * sqrt((36 * 0.04 + 1.0 / 12) / PIXELS));
    assert_near(variance, 36 * 0.04 + 1.0 / 12, 0.1);
}

// What belongs to the sensor is the same in every photograph: two frames share their deviations.
static void test_sensitivities_stay(void **state)
{
    (void)state;
    static uint16_t first[PIXELS * 3];
    struct scene scene = plain_scene();
    scene.sensor.prnu = 0.02;
    scene.sensor.full_well = 1e8;  // photon noise of 4e6 electrons: 5e-4, little beside 0.02
    scene.sensor.dn_per_electron = 1e-3;
    scene.sensor.adc_max = 65535;
    fill(0.4f);
    sam_sensor_expose(&scene, value, 10, 1, first);
    sam_sensor_expose(&scene, value, 10, 2, dn);
    double mean, variance, product = 0;
    moments(0, &mean, &variance);
    double signal = 4e6 * 1e-3;
    assert_near(mean, 300 + signal, 5 * 0.02 * signal / sqrt(PIXELS));
    for (int i = 0; i < PIXELS; i++)
        product += (first[3 * i] - mean) * (dn[3 * i] - mean) / PIXELS;
    assert_near(sqrt(product), 0.02 * signal, 5 * 0.02 * signal / sqrt(2.0 * PIXELS));
}

// Of the photosites, a share leaks; the leaks add up to share x rate x time.
static void test_hot_photosites(void **state)
{
    (void)state;
    struct scene scene = plain_scene();
    scene.sensor.hot_fraction = 0.01;
    scene.sensor.hot_rate = 2000;
    scene.sensor.read_noise = 0;
    sam_sensor_expose(&scene, NULL, 2, 1, dn);
    double sum = 0;
    int hot = 0;
    for (int i = 0; i < PIXELS * 3; i++) {
        hot += dn[i] > 300 + 2;  // 10 electrons: all but 1 in 400 of the hot ones
        sum += (dn[i] - 300) / 0.2;
    }
    double expected = 0.01 * PIXELS * 3;
    assert_near(hot, expected, 5 * sqrt(expected) + expected / 200);
    assert_near(sum, expected * 4000, 5 * 4000 * sqrt(2 * expected));
}

static void test_times_err_as_told(void **state)
{
    (void)state;
    struct scene scene = plain_scene();
    double square = 0;
    scene.sensor.time_error = 0.01;
    for (uint32_t i = 0; i < 4000; i++)
        square += pow(sam_true_time(&scene, 0.5, i) / 0.5 - 1, 2) / 4000;
    assert_near(sqrt(square), 0.01, 5 * 0.01 / sqrt(8000));
    scene.sensor.time_error = 0;
    assert_near(sam_true_time(&scene, 0.5, 3), 0.5, 0);
}

// Red light through a mosaic: only the red filters' photosites see it.
static void test_a_mosaic_sees_one_channel(void **state)
{
    (void)state;
    struct scene scene = plain_scene();
    scene.sensor.mosaic = true;
    strcpy(scene.sensor.cfa, "GRBG");
    for (int i = 0; i < PIXELS; i++) {
        value[3 * i] = 0.5f;
        value[3 * i + 1] = value[3 * i + 2] = 0;
    }
    assert_int_equal(sam_channels(&scene), 1);
    sam_sensor_expose(&scene, value, 0.01, 1, dn);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            double noise = 6 * 0.2 * sqrt(36 + 5000);  // six sigma, lit; more than that, dark
            bool red = y % 2 == 0 && x % 2 == 1;
            assert_near(dn[y * WIDTH + x], red ? 300 + 0.2 * 5000 : 300, noise);
        }
}

static double correlation_with(const uint16_t *other)
{
    double ma = 0, mb = 0, ab = 0, aa = 0, bb = 0;
    for (int i = 0; i < PIXELS * 3; i++) {
        ma += dn[i] / (PIXELS * 3.0);
        mb += other[i] / (PIXELS * 3.0);
    }
    for (int i = 0; i < PIXELS * 3; i++) {
        ab += (dn[i] - ma) * (other[i] - mb);
        aa += (dn[i] - ma) * (dn[i] - ma);
        bb += (other[i] - mb) * (other[i] - mb);
    }
    return ab / sqrt(aa * bb);
}

static void test_frames_have_noise_of_their_own(void **state)
{
    (void)state;
    static uint16_t first[PIXELS * 3];
    struct scene scene = plain_scene();
    scene.sensor.channel_gain[1] = scene.sensor.channel_gain[2] = 1;  // else colours correlate
    fill(0.1f);
    sam_sensor_expose(&scene, value, 0.01, 1, first);
    sam_sensor_expose(&scene, value, 0.01, 2, dn);
    assert_near(correlation_with(first), 0, 5 / sqrt(PIXELS * 3));
    sam_sensor_expose(&scene, value, 0.01, 1, dn);
    assert_memory_equal(dn, first, sizeof first);
}

// At the end of the horizontal axis, q = (w/2)^2 / ((w/2)^2 + (h/2)^2) = 4/5 for 2:1.
static void test_vignetting(void **state)
{
    (void)state;
    struct scene scene = plain_scene();
    scene.sensor.vignetting[0] = -0.1;
    scene.sensor.vignetting[1] = -0.05;
    assert_near(sam_vignetting(&scene, 99.5, 49.5), 1, 0);
    assert_near(sam_vignetting(&scene, 199.5, 49.5), 1 - 0.08 - 0.05 * 0.64, 1e-15);
}

static void test_the_wall_is_exposed_safely(void **state)
{
    (void)state;
    struct scene scene = plain_scene();
    double mean, variance;
    sam_sensor_flat(&scene, 0.7, 3, dn);
    moments(2, &mean, &variance);  // the channel of the highest gain
    double electrons = 0.7 * (4095 - 300) / 0.2;
    assert_near(mean, 300 + 0.2 * electrons, 5 * sqrt(electrons * 0.04 / PIXELS) + 0.05);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_mean_and_variance),
        cmocka_unit_test(test_darkness_is_the_black_level),
        cmocka_unit_test(test_saturation),
        cmocka_unit_test(test_frames_have_noise_of_their_own),
        cmocka_unit_test(test_sensitivities_stay),
        cmocka_unit_test(test_hot_photosites),
        cmocka_unit_test(test_times_err_as_told),
        cmocka_unit_test(test_a_mosaic_sees_one_channel),
        cmocka_unit_test(test_vignetting),
        cmocka_unit_test(test_the_wall_is_exposed_safely),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
