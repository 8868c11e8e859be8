/* JPEG photographs: the tone curve, and EXIF as libexif reads it back. */
#include "jpeg_write.h"
#include "near.h"

#include <libexif/exif-data.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <jpeglib.h>

enum { WIDTH = 64, HEIGHT = 64 };

static struct scene plain_scene(void)
{
    return (struct scene){
        .camera = {.width = WIDTH, .height = HEIGHT},
        .sensor = {.black_level = 100, .adc_max = 4100, .channel_gain = {0.5, 1, 0.8}},
        .exif = {2.8, 200, 50, "Maker", "Model 1"},
    };
}

static char path[] = "/tmp/test_jpeg_XXXXXX";

static void write_even(const struct scene *scene, uint16_t r, uint16_t g, uint16_t b,
                       double seconds)
{
    static uint16_t dn[WIDTH * HEIGHT * 3];
    struct error err = {0};
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        dn[3 * i] = r;
        dn[3 * i + 1] = g;
        dn[3 * i + 2] = b;
    }
    assert_int_equal(sam_jpeg_write(path, dn, scene, seconds, &err), STATUS_OK);
}

static void read_middle(unsigned char rgb[3])
{
    struct jpeg_decompress_struct jpeg;
    struct jpeg_error_mgr manager;
    unsigned char row[WIDTH * 3], *rows = row;
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    jpeg.err = jpeg_std_error(&manager);
    jpeg_create_decompress(&jpeg);
    jpeg_stdio_src(&jpeg, file);
    jpeg_read_header(&jpeg, TRUE);
    jpeg_start_decompress(&jpeg);
    for (int y = 0; y <= HEIGHT / 2; y++)
        jpeg_read_scanlines(&jpeg, &rows, 1);
    memcpy(rgb, &row[3 * (WIDTH / 2)], 3);
    jpeg_destroy_decompress(&jpeg);
    fclose(file);
}

// A grey of 21.4 % is 127 or 128 in sRGB; white balance undoes the channels' gains.
static void test_middle_grey(void **state)
{
    (void)state;
    struct scene scene = plain_scene();
    unsigned char rgb[3];
    write_even(&scene, 100 + 428, 100 + 856, 100 + 685, 0.01);
    read_middle(rgb);
    for (int c = 0; c < 3; c++)
        assert_near(rgb[c], 127.5, 1.5);  // JPEG's own rounding of an even picture: 1
}

// A quarter of full light: 0.5 under a power of 1/2; 0.4 by a table that climbs to 0.8 at one half.
static void test_other_curves(void **state)
{
    (void)state;
    struct scene scene = plain_scene();
    unsigned char rgb[3];
    scene.tone.gamma = 2;
    write_even(&scene, 100 + 500, 100 + 1000, 100 + 800, 0.01);
    read_middle(rgb);
    assert_near(rgb[1], 127.5, 1.5);
    scene.tone = (struct tone_curve){.value = {0, 0.8, 1}, .values = 3};
    write_even(&scene, 100 + 500, 100 + 1000, 100 + 800, 0.01);
    read_middle(rgb);
    assert_near(rgb[1], 102, 1);
}

static void test_ends_of_the_curve(void **state)
{
    (void)state;
    struct scene scene = plain_scene();
    unsigned char rgb[3];
    write_even(&scene, 90, 100, 95, 0.01);  // read noise goes below black
    read_middle(rgb);
    assert_near(rgb[1], 0, 1);
    write_even(&scene, 4100, 4100, 4100, 0.01);
    read_middle(rgb);
    assert_near(rgb[0], 255, 1);
    assert_near(rgb[1], 255, 1);
}

static double times[] = {1.0 / 2000, 1.0 / 30, 0.4, 4};
enum { TIMES = sizeof times / sizeof *times };

static ExifRational ratio(ExifData *data, ExifTag tag)
{
    ExifEntry *entry = exif_content_get_entry(data->ifd[EXIF_IFD_EXIF], tag);
    assert_non_null(entry);
    return exif_get_rational(entry->data, exif_data_get_byte_order(data));
}

static void test_exif(void **state)
{
    double seconds = *(double *)*state;
    struct scene scene = plain_scene();
    char text[32];
    write_even(&scene, 500, 500, 500, seconds);
    ExifData *data = exif_data_new_from_file(path);
    assert_non_null(data);
    ExifRational t = ratio(data, EXIF_TAG_EXPOSURE_TIME), f = ratio(data, EXIF_TAG_FNUMBER);
    assert_near((double)t.numerator / t.denominator, seconds, 1e-12);
    assert_near((double)f.numerator / f.denominator, 2.8, 1e-6);
    ExifEntry *model = exif_content_get_entry(data->ifd[EXIF_IFD_0], EXIF_TAG_MODEL);
    assert_non_null(model);
    assert_string_equal(exif_entry_get_value(model, text, sizeof text), "Model 1");
    exif_data_unref(data);
}

static int make_file(void **state)
{
    (void)state;
    return close(mkstemp(path));
}

static int remove_file(void **state)
{
    (void)state;
    return remove(path);
}

int main(void)
{
    struct CMUnitTest tests[TIMES + 3] = {
        cmocka_unit_test(test_middle_grey),
        cmocka_unit_test(test_ends_of_the_curve),
        cmocka_unit_test(test_other_curves),
    };
    for (int i = 0; i < TIMES; i++)
        tests[3 + i] = (struct CMUnitTest){"exif", test_exif, NULL, NULL, &times[i]};
    return cmocka_run_group_tests(tests, make_file, remove_file);
}
