/* Raw photographs: LibRaw, which reads real cameras' files, finds every value and setting. */
#include "near.h"
#include "random.h"
#include "tiff_write.h"

#include <libraw/libraw.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { WIDTH = 130, HEIGHT = 94 };

static const struct exif exif = {4, 800, 35, "Maker", "Model 1"};

static struct row {
    const char *name;
    const char *cfa;
} rows[] = {
    {"rggb", "RGGB"},
    {"bggr", "BGGR"},
    {"grbg", "GRBG"},
    {"gbrg", "GBRG"},
    {"xtrans", "GBGGRGRGRBGBGBGGRGGRGGBGBGBRGRGRGGBG"},
};
enum { ROWS = sizeof rows / sizeof *rows };

static void check(libraw_data_t *raw, const uint16_t *dn, const char *cfa)
{
    assert_int_equal(raw->sizes.raw_width, WIDTH);
    assert_int_equal(raw->sizes.raw_height, HEIGHT);
    for (int y = 0; y < HEIGHT; y++)
        assert_memory_equal(&raw->rawdata.raw_image[y * raw->sizes.raw_pitch / 2], &dn[y * WIDTH],
                            WIDTH * 2);
    for (int i = 0; i < 36; i++) {  // LibRaw tells Bayer's second green apart as 3
        int colour = libraw_COLOR(raw, i / 6, i % 6);
        assert_int_equal(colour == 3 ? 1 : colour, cap_cfa_channel(cfa, i % 6, i / 6));
    }
    assert_near(raw->other.shutter, 1.0 / 64, 1e-9);
    assert_near(raw->other.iso_speed, 800, 0);
    assert_near(raw->other.aperture, 4, 1e-6);
    assert_near(raw->other.focal_len, 35, 1e-6);
    assert_int_equal(raw->color.black + raw->color.cblack[0], 512);
    assert_int_equal(raw->color.maximum, 16000);
    assert_string_equal(raw->idata.make, "Maker");
    assert_string_equal(raw->idata.model, "Model 1");
}

static void test_libraw_reads_it(void **state)
{
    const struct row *r = *state;
    struct sensor_model sensor = {
        .black_level = 512, .adc_max = 16000, .channel_gain = {0.5, 1, 0.7}, .mosaic = true};
    snprintf(sensor.cfa, sizeof sensor.cfa, "%s", r->cfa);
    char path[] = "/tmp/test_dng_XXXXXX.dng";
    assert_int_equal(close(mkstemps(path, 4)), 0);
    static uint16_t dn[WIDTH * HEIGHT], used[WIDTH * HEIGHT];
    struct random random = sam_random_at(4, 5, 6);
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        dn[i] = used[i] = (uint16_t)(sam_uniform(&random) * 16001);
    struct error err = {0};
    assert_int_equal(sam_dng_write(path, used, WIDTH, HEIGHT, &exif, 1.0 / 64, &sensor, &err), 0);
    libraw_data_t *raw = libraw_init(0);
    assert_int_equal(libraw_open_file(raw, path), LIBRAW_SUCCESS);
    assert_int_equal(libraw_unpack(raw), LIBRAW_SUCCESS);
    check(raw, dn, r->cfa);
    libraw_close(raw);
    remove(path);
}

int main(void)
{
    struct CMUnitTest tests[ROWS];
    for (int i = 0; i < ROWS; i++)
        tests[i] = (struct CMUnitTest){rows[i].name, test_libraw_reads_it, NULL, NULL, &rows[i]};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
