/* Photographs: every layout of a TIFF gives the same values, and damage is an error. */
#include "photo.h"
#include "synthetic.h"

#include <unistd.h>

#include <jpeglib.h>

enum { WIDTH = 45, HEIGHT = 37, COUNT = WIDTH * HEIGHT * 3 };

static char path[] = "/tmp/test_photo_XXXXXX";

static int make_file(void **state)
{
    (void)state;
    int file = mkstemp(path);
    return file < 0 ? -1 : close(file);
}

static int remove_file(void **state)
{
    (void)state;
    return remove(path);
}

static void fill_image(uint16_t *rgb, int bits)
{
    for (int i = 0; i < COUNT; i++)
        rgb[i] = (uint16_t)((i * 40503u) & (bits == 8 ? 0xFF : 0xFFFF));
}

static struct row {
    const char *name;
    struct tiff_form form;
} rows[] = {
    {"16 bits, deflate", {16, 3, COMPRESSION_ADOBE_DEFLATE, 0, false, 0.125}},
    {"16 bits, LZW", {16, 3, COMPRESSION_LZW, 0, false, 0.125}},
    {"16 bits, uncompressed", {16, 3, COMPRESSION_NONE, 0, false, 0.125}},
    {"16 bits and alpha", {16, 4, COMPRESSION_LZW, 0, false, 0.125}},
    {"16 bits in tiles", {16, 3, COMPRESSION_ADOBE_DEFLATE, 16, false, 0.125}},
    {"16 bits in planes", {16, 3, COMPRESSION_LZW, 0, true, 0.125}},
    {"16 bits in tiles of planes", {16, 3, COMPRESSION_NONE, 32, true, 0.125}},
    {"8 bits", {8, 3, COMPRESSION_ADOBE_DEFLATE, 0, false, 0.125}},
    {"8 bits and alpha in tiles", {8, 4, COMPRESSION_LZW, 16, false, 0.125}},
    {"8 bits in planes", {8, 3, COMPRESSION_NONE, 0, true, 0.125}},
};
enum { ROWS = sizeof rows / sizeof *rows };

static void test_layout(void **state)
{
    const struct row *r = *state;
    static uint16_t rgb[COUNT], back[COUNT];
    struct photo_file *file = NULL;
    struct error err = {0};
    fill_image(rgb, r->form.bits);
    write_tiff(path, rgb, WIDTH, HEIGHT, &r->form);
    assert_int_equal(photo_open(&file, path, &err), STATUS_OK);
    assert_int_equal(file->info.width, WIDTH);
    assert_int_equal(file->info.height, HEIGHT);
    assert_int_equal(file->info.encoded, r->form.bits == 8);
    assert_near(file->info.exposure_time, 0.125, 1e-9);
    assert_near(file->info.aperture, 8, 1e-6);
    assert_near(file->info.focal_length, 50, 1e-6);
    assert_near(file->info.iso, 100, 0);
    assert_int_equal(photo_read(file, back, HEIGHT, &err), STATUS_OK);
    assert_memory_equal(rgb, back, sizeof rgb);
    photo_close(file);
}

/* Rows 21..29 after a jump over strips, tiles and the beginning of one. */
static void test_skipping_changes_nothing(void **state)
{
    const struct row *r = *state;
    enum { TOP = 21, SOME = 9, LINE = 3 * WIDTH };
    static uint16_t rgb[COUNT], back[SOME * LINE];
    struct photo_file *file = NULL;
    fill_image(rgb, r->form.bits);
    write_tiff(path, rgb, WIDTH, HEIGHT, &r->form);
    assert_int_equal(photo_open(&file, path, NULL), STATUS_OK);
    assert_int_equal(photo_skip(file, 3, NULL), STATUS_OK);
    assert_int_equal(photo_skip(file, TOP - 3, NULL), STATUS_OK);
    assert_int_equal(photo_read(file, back, SOME, NULL), STATUS_OK);
    assert_memory_equal(rgb + TOP * LINE, back, sizeof back);
    assert_int_equal(photo_skip(file, HEIGHT - TOP - SOME, NULL), STATUS_OK);
    photo_close(file);
}

/* Opens and reads; the first failure's status. */
static enum status read_all(struct error *err)
{
    static uint16_t back[COUNT];
    struct photo_file *file = NULL;
    enum status status = photo_open(&file, path, err);
    if (!status)
        status = photo_read(file, back, file->info.height, err);
    photo_close(file);
    return status;
}

static void put_bytes(const void *bytes, size_t size)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

static void write_jpeg(void)
{
    static unsigned char line[3 * WIDTH];
    struct jpeg_compress_struct jpeg;
    struct jpeg_error_mgr errors;
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_compress(&jpeg);
    jpeg_stdio_dest(&jpeg, file);
    jpeg.image_width = WIDTH;
    jpeg.image_height = HEIGHT;
    jpeg.input_components = 3;
    jpeg.in_color_space = JCS_RGB;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, 100, TRUE);
    jpeg_start_compress(&jpeg, TRUE);
    JSAMPLE *rows_of_one[] = {line};
    for (int y = 0; y < HEIGHT; y++) {
        for (int x = 0; x < 3 * WIDTH; x++)
            line[x] = (unsigned char)(50 + 3 * y);
        jpeg_write_scanlines(&jpeg, rows_of_one, 1);
    }
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    assert_int_equal(fclose(file), 0);
}

static void test_jpeg(void **state)
{
    (void)state;
    static uint16_t back[COUNT];
    struct photo_file *file = NULL;
    struct error err = {0};
    write_jpeg();
    assert_int_equal(photo_open(&file, path, &err), STATUS_OK);
    assert_int_equal(file->info.width, WIDTH);
    assert_true(file->info.encoded);
    assert_near(file->info.exposure_time, 0, 0);  // it has no EXIF
    assert_int_equal(photo_skip(file, 5, &err), STATUS_OK);
    assert_int_equal(photo_read(file, back, HEIGHT - 5, &err), STATUS_OK);
    for (int y = 0; y < HEIGHT - 5; y++)
        assert_near(back[y * 3 * WIDTH], 50 + 3 * (y + 5), 2);  // rounding of the DCT
    photo_close(file);
}

static long file_size(void)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    long size = ftell(file);
    fclose(file);
    return size;
}

static void expect_refused(enum status expected, const char *story)
{
    struct error err = {0};
    assert_int_equal(read_all(&err), expected);
    assert_non_null(strstr(err.text, path));
    assert_non_null(strstr(err.text, story));
}

static void test_truncation_is_an_error(void **state)
{
    (void)state;
    static uint16_t rgb[COUNT];
    struct tiff_form form = {16, 3, COMPRESSION_NONE, 0, false, 0};
    struct error err = {0};
    fill_image(rgb, 16);
    write_tiff(path, rgb, WIDTH, HEIGHT, &form);
    long size = file_size();
    for (long left = size - 1; left > 8; left -= size / 7) {
        write_tiff(path, rgb, WIDTH, HEIGHT, &form);
        assert_int_equal(truncate(path, left), 0);
        assert_int_equal(read_all(&err), STATUS_FORMAT);
    }
    write_jpeg();
    size = file_size();
    for (long left = size - 20; left > 8; left -= size / 7) {
        write_jpeg();
        assert_int_equal(truncate(path, left), 0);
        assert_int_equal(read_all(&err), STATUS_FORMAT);
    }
}

static void test_damage_is_an_error(void **state)
{
    (void)state;
    static uint16_t rgb[COUNT];
    struct tiff_form form = {16, 3, COMPRESSION_ADOBE_DEFLATE, 0, false, 0};
    fill_image(rgb, 16);
    write_tiff(path, rgb, WIDTH, HEIGHT, &form);
    FILE *file = fopen(path, "r+b");
    assert_non_null(file);
    fseek(file, 1000, SEEK_SET);  // within the first strips
    for (int i = 0; i < 200; i++)
        fputc(0xA5, file);
    fclose(file);
    struct error err = {0};
    assert_int_equal(read_all(&err), STATUS_FORMAT);
}

static void test_what_is_no_photograph_is_refused(void **state)
{
    (void)state;
    static uint16_t rgb[COUNT];
    struct tiff_form grey = {16, 1, COMPRESSION_NONE, 0, false, 0};
    put_bytes("", 0);
    expect_refused(STATUS_FORMAT, "empty");
    put_bytes("just some text", 14);
    expect_refused(STATUS_FORMAT, "neither a TIFF nor a JPEG");
    put_bytes("II*\0garbage and more", 20);
    expect_refused(STATUS_FORMAT, path);
    write_tiff(path, rgb, WIDTH, HEIGHT, &grey);
    expect_refused(STATUS_FORMAT, "not an RGB image");
    struct error err = {0};
    struct photo_file *file = NULL;
    assert_int_equal(photo_open(&file, "/tmp", &err), STATUS_IO);
    assert_int_equal(photo_open(&file, "/nowhere/a.tif", &err), STATUS_IO);
    assert_non_null(strstr(err.text, "/nowhere/a.tif"));
}

int main(void)
{
    const struct CMUnitTest more[] = {
        cmocka_unit_test(test_jpeg),
        cmocka_unit_test(test_truncation_is_an_error),
        cmocka_unit_test(test_damage_is_an_error),
        cmocka_unit_test(test_what_is_no_photograph_is_refused),
    };
    enum { MORE = sizeof more / sizeof *more };
    struct CMUnitTest tests[2 * ROWS + MORE];
    for (int i = 0; i < ROWS; i++) {
        tests[2 * i] = (struct CMUnitTest){rows[i].name, test_layout, NULL, NULL, &rows[i]};
        tests[2 * i + 1] =
            (struct CMUnitTest){rows[i].name, test_skipping_changes_nothing, NULL, NULL, &rows[i]};
    }
    memcpy(tests + 2 * ROWS, more, sizeof more);
    return cmocka_run_group_tests(tests, make_file, remove_file);
}
