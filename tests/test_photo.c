/* Photographs: every layout of a TIFF gives the same values, and damage is an error. */
#include "photo.h"
#include "synthetic.h"

#include <unistd.h>

#include <jpeglib.h>
#include <png.h>

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

static void assert_same(const float *dn, const uint16_t *expected, int count)
{
    for (int i = 0; i < count; i++)
        assert_int_equal((int)dn[i], expected[i]);
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
    static uint16_t rgb[COUNT];
    static float back[COUNT];
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
    assert_same(back, rgb, COUNT);
    photo_close(file);
}

/* Rows 21..29 after a jump over strips, tiles and the beginning of one. */
static void test_skipping_changes_nothing(void **state)
{
    const struct row *r = *state;
    enum { TOP = 21, SOME = 9, LINE = 3 * WIDTH };
    static uint16_t rgb[COUNT];
    static float back[SOME * LINE];
    struct photo_file *file = NULL;
    fill_image(rgb, r->form.bits);
    write_tiff(path, rgb, WIDTH, HEIGHT, &r->form);
    assert_int_equal(photo_open(&file, path, NULL), STATUS_OK);
    assert_int_equal(photo_skip(file, 3, NULL), STATUS_OK);
    assert_int_equal(photo_skip(file, TOP - 3, NULL), STATUS_OK);
    assert_int_equal(photo_read(file, back, SOME, NULL), STATUS_OK);
    assert_same(back, rgb + TOP * LINE, SOME * LINE);
    assert_int_equal(photo_skip(file, HEIGHT - TOP - SOME, NULL), STATUS_OK);
    photo_close(file);
}

/* Opens and reads; the first failure's status. */
static enum status read_all(struct error *err)
{
    static float back[COUNT];
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
    static float back[COUNT];
    struct photo_file *file = NULL;
    struct error err = {0};
    write_jpeg();
    assert_int_equal(photo_open(&file, path, &err), STATUS_OK);
    assert_int_equal(file->info.width, WIDTH);
    assert_true(file->info.encoded);
    assert_int_equal(file->info.chroma[0], 2);  // libjpeg's default: 4:2:0
    assert_int_equal(file->info.chroma[1], 2);
    assert_near(file->info.exposure_time, 0, 0);  // it has no EXIF
    assert_int_equal(photo_skip(file, 5, &err), STATUS_OK);
    assert_int_equal(photo_read(file, back, HEIGHT - 5, &err), STATUS_OK);
    for (int y = 0; y < HEIGHT - 5; y++)
        assert_near(back[y * 3 * WIDTH], 50 + 3 * (y + 5), 2);  // rounding of the DCT
    photo_close(file);
}

static void write_png(const uint16_t *rgb, int bits)
{
    FILE *file = fopen(path, "wb");
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
    png_infop info = png_create_info_struct(png);
    assert_non_null(file);
    assert_int_equal(setjmp(png_jmpbuf(png)), 0);
    png_init_io(png, file);
    png_set_IHDR(png, info, WIDTH, HEIGHT, bits, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    // Little-endian TIFF structure: IFD0 {EXIF IFD at 26}, EXIF IFD {exposure time 1/8 at 44}.
    static unsigned char exif[] = {'I', 'I', 42,   0,    8, 0, 0, 0,                     //
                                   1,   0,   0x69, 0x87, 4, 0, 1, 0, 0, 0, 26, 0, 0, 0,  //
                                   0,   0,   0,    0,                                    //
                                   1,   0,   0x9A, 0x82, 5, 0, 1, 0, 0, 0, 44, 0, 0, 0,  //
                                   0,   0,   0,    0,                                    //
                                   1,   0,   0,    0,    8, 0, 0, 0};
    png_set_eXIf_1(png, info, sizeof exif, exif);
    png_write_info(png, info);
    for (int y = 0; y < HEIGHT; y++) {
        unsigned char line[6 * WIDTH];
        for (int i = 0; i < 3 * WIDTH; i++) {
            uint16_t v = rgb[y * 3 * WIDTH + i];
            if (bits == 8)
                line[i] = (unsigned char)v;
            else {
                line[2 * i] = (unsigned char)(v >> 8);
                line[2 * i + 1] = (unsigned char)v;
            }
        }
        png_write_row(png, line);
    }
    png_write_end(png, NULL);
    png_destroy_write_struct(&png, &info);
    assert_int_equal(fclose(file), 0);
}

static void test_png(void **state)
{
    (void)state;
    static uint16_t rgb[COUNT];
    static float back[COUNT];
    for (int bits = 8; bits <= 16; bits += 8) {
        struct photo_file *file = NULL;
        struct error err = {0};
        fill_image(rgb, bits);
        write_png(rgb, bits);
        assert_int_equal(photo_open(&file, path, &err), STATUS_OK);
        assert_int_equal(file->info.encoded, bits == 8);
        assert_near(file->info.exposure_time, 0.125, 1e-9);
        assert_int_equal(photo_skip(file, 3, &err), STATUS_OK);
        assert_int_equal(photo_read(file, back, HEIGHT - 3, &err), STATUS_OK);
        assert_same(back, rgb + 9 * WIDTH, COUNT - 9 * WIDTH);
        photo_close(file);
    }
}

/* Float files are in units of 1/65535; a radiance map is an EXR image like any other. */
static void test_exr_image(void **state)
{
    (void)state;
    static float value[COUNT], back[COUNT];
    struct radiance map = {
        .width = WIDTH, .height = HEIGHT, .value = value, .variance = value, .channels = 3};
    struct photo_file *file = NULL;
    struct error err = {0};
    for (int i = 0; i < COUNT; i++)
        value[i] = (float)i / 1000;
    value[5] = NAN;
    assert_int_equal(cap_radiance_write(&map, path, &err), STATUS_OK);
    assert_int_equal(photo_open(&file, path, &err), STATUS_OK);
    assert_int_equal(file->info.bits, 32);
    assert_int_equal(photo_read(file, back, HEIGHT, &err), STATUS_OK);
    for (int i = 0; i < COUNT; i++)
        if (i != 5)
            assert_near(back[i], 65.535 * i, 1e-6 * 65.535 * i);
    assert_true(isinf(back[5]));
    photo_close(file);
}

/* A raw file stays a mosaic, with its levels and settings. */
static void test_dng(void **state)
{
    (void)state;
    enum { W = 64, H = 48 };
    static uint16_t mosaic[W * H];
    static float back[W * H];
    char dng[sizeof path + 4];
    struct photo_file *file = NULL;
    struct error err = {0};
    for (int i = 0; i < W * H; i++)
        mosaic[i] = (uint16_t)(100 + i);
    snprintf(dng, sizeof dng, "%s.dng", path);
    write_dng(dng, mosaic, W, H, 0.125);
    assert_int_equal(photo_open(&file, dng, &err), STATUS_OK);
    assert_int_equal(file->info.width, W);
    assert_int_equal(file->info.height, H);
    assert_int_equal(file->info.channels, 1);
    assert_string_equal(file->info.cfa, "RGGB");
    assert_near(file->info.black, DNG_BLACK, 0);
    assert_near(file->info.white, DNG_WHITE, 0);
    assert_near(file->info.exposure_time, 0.125, 1e-7);
    assert_near(file->info.aperture, 8, 1e-6);
    assert_int_equal(photo_skip(file, 7, &err), STATUS_OK);
    assert_int_equal(photo_read(file, back, H - 7, &err), STATUS_OK);
    assert_same(back, mosaic + 7 * W, (H - 7) * W);
    photo_close(file);
    assert_int_equal(truncate(dng, 3000), 0);
    enum status status = photo_open(&file, dng, &err);
    if (!status) {
        status = photo_read(file, back, H, &err);
        photo_close(file);
    }
    assert_int_equal(status, STATUS_FORMAT);
    remove(dng);
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
    struct tiff_form two = {16, 2, COMPRESSION_NONE, 0, false, 0};
    put_bytes("", 0);
    expect_refused(STATUS_FORMAT, "empty");
    put_bytes("just some text", 14);
    expect_refused(STATUS_FORMAT, "no photograph that can be read");
    put_bytes("II*\0garbage and more", 20);
    expect_refused(STATUS_FORMAT, path);
    write_tiff(path, rgb, WIDTH, HEIGHT, &two);
    expect_refused(STATUS_FORMAT, "neither RGB nor gray");
    struct error err = {0};
    struct photo_file *file = NULL;
    assert_int_equal(photo_open(&file, "/tmp", &err), STATUS_IO);
    assert_int_equal(photo_open(&file, "/nowhere/a.tif", &err), STATUS_IO);
    assert_non_null(strstr(err.text, "/nowhere/a.tif"));
}

/* A picture that we write, without what stands between its rows, is read as it was. */
static void test_a_picture_comes_back(void **state)
{
    (void)state;
    enum { STRIDE = WIDTH + 3 };
    static uint32_t picture[HEIGHT * STRIDE];
    static uint16_t rgb[COUNT];
    static float back[COUNT];
    struct photo_file *file = NULL;
    struct error err = {0};
    fill_image(rgb, 8);
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        picture[i / WIDTH * STRIDE + i % WIDTH] = 0xab000000u | (uint32_t)rgb[3 * i] << 16
                                                  | (uint32_t)rgb[3 * i + 1] << 8 | rgb[3 * i + 2];
    assert_int_equal(cap_png_write(picture, WIDTH, HEIGHT, STRIDE, path, &err), STATUS_OK);
    assert_int_equal(photo_open(&file, path, &err), STATUS_OK);
    assert_int_equal(file->info.width, WIDTH);
    assert_int_equal(file->info.height, HEIGHT);
    assert_int_equal(photo_read(file, back, HEIGHT, &err), STATUS_OK);
    assert_same(back, rgb, COUNT);
    photo_close(file);
    assert_int_equal(cap_png_write(picture, WIDTH, HEIGHT, STRIDE, "/no/such/folder/a.png", &err),
                     STATUS_IO);
}

/* A raw file that was read stays decoded for who opens it next, unless it has changed. */
static void test_a_raw_file_is_kept(void **state)
{
    (void)state;
    enum { W = 64, H = 48 };
    static uint16_t mosaic[W * (H + 2)];
    static float back[W * H];
    char dng[sizeof path + 4];
    struct photo_file *file = NULL, *again = NULL;
    struct error err = {0};
    for (int i = 0; i < W * (H + 2); i++)
        mosaic[i] = (uint16_t)(200 + i);
    snprintf(dng, sizeof dng, "%s.dng", path);
    write_dng(dng, mosaic, W, H, 0.125);
    assert_int_equal(photo_open(&file, dng, &err), STATUS_OK);
    assert_int_equal(photo_read(file, back, H, &err), STATUS_OK);
    photo_close(file);
    assert_int_equal(photo_open(&again, dng, &err), STATUS_OK);
    assert_ptr_equal(again, file);
    assert_int_equal(photo_read(again, back, H, &err), STATUS_OK);
    assert_same(back, mosaic, W * H);
    photo_close(again);
    write_dng(dng, mosaic, W, H + 2, 0.125);
    assert_int_equal(photo_open(&file, dng, &err), STATUS_OK);
    assert_int_equal(file->info.height, H + 2);
    photo_close(file);
    photo_forget();
    remove(dng);
}

int main(void)
{
    const struct CMUnitTest more[] = {
        cmocka_unit_test(test_jpeg),
        cmocka_unit_test(test_png),
        cmocka_unit_test(test_a_picture_comes_back),
        cmocka_unit_test(test_exr_image),
        cmocka_unit_test(test_dng),
        cmocka_unit_test(test_a_raw_file_is_kept),
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
