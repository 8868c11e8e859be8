/* What programs write besides the usual into TIFF, PNG and JPEG files: every form gives the values
 * that were put in, or one message that says what it is. */
#include "photo_forms.h"

#include <jpeglib.h>
#include <png.h>

/* ---- TIFF -------------------------------------------------------------------------------- */

static struct tiff_row {
    const char *name, *mode;
    int photometric, samples, bits, format, compression, predictor;
    bool planes, tiles;
} tiff_rows[] = {
    {"gray, 16 bits", "w", 1, 1, 16, 1, COMPRESSION_NONE, 1, false, false},
    {"gray, 8 bits", "w", 1, 1, 8, 1, COMPRESSION_LZW, 2, false, false},
    {"gray and alpha, in planes", "w", 1, 2, 16, 1, COMPRESSION_NONE, 1, true, false},
    {"gray, float, in tiles", "w", 1, 1, 32, 3, COMPRESSION_ADOBE_DEFLATE, 3, false, true},
    {"big-endian", "wb", 2, 3, 16, 1, COMPRESSION_NONE, 1, false, false},
    {"big-endian, LZW, differences", "wb", 2, 3, 16, 1, COMPRESSION_LZW, 2, false, false},
    {"big TIFF", "w8", 2, 3, 16, 1, COMPRESSION_ADOBE_DEFLATE, 2, false, false},
    {"float", "w", 2, 3, 32, 3, COMPRESSION_NONE, 1, false, false},
    {"float, big-endian, predictor 3", "wb", 2, 3, 32, 3, COMPRESSION_LZW, 3, false, false},
    {"float and alpha, in tiles of planes", "w", 2, 4, 32, 3, COMPRESSION_NONE, 1, true, true},
    {"half", "w", 2, 3, 16, 3, COMPRESSION_NONE, 1, false, false},
    {"half, big-endian, predictor 3", "wb8", 2, 3, 16, 3, COMPRESSION_LZW, 3, false, false},
};
enum { TIFF_ROWS = sizeof tiff_rows / sizeof *tiff_rows };

static void put_sample_of(const struct tiff_row *r, unsigned char *to, size_t i, int x, int y,
                          int c)
{
    const size_t bytes = (size_t)r->bits / 8;
    bool inside = x < WIDTH && y < HEIGHT && c < 3;
    int code = inside ? code_at(x, y, c) : 0;
    float real = (float)(code / 256.0);
    uint16_t wide = r->format == 3 ? half_of((double)real) : (uint16_t)(code * 257);
    if (r->bits == 8)
        to[i] = (unsigned char)code;
    else
        memcpy(to + i * bytes, r->bits == 32 ? (void *)&real : &wide, bytes);
    // Where it takes differences of floats, libtiff 4.5 writes numbers of the other byte order the
    // wrong way round, and reads them the right way.
    for (size_t k = 0; r->predictor == 3 && r->mode[1] == 'b' && 2 * k < bytes; k++) {
        unsigned char aside = to[i * bytes + k];
        to[i * bytes + k] = to[(i + 1) * bytes - 1 - k];
        to[(i + 1) * bytes - 1 - k] = aside;
    }
}

static void write_form(const struct tiff_row *r)
{
    enum { TILE = 16, STRIP = 5 };
    static unsigned char block[WIDTH * HEIGHT * 16];
    TIFF *tiff = TIFFOpen(path, r->mode);
    assert_non_null(tiff);
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, WIDTH);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, HEIGHT);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, r->bits);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, r->samples);
    TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, r->format);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, r->photometric);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, r->compression);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, r->planes ? 2 : 1);
    if (r->predictor > 1)
        TIFFSetField(tiff, TIFFTAG_PREDICTOR, r->predictor);
    int colours = r->photometric == 1 ? 1 : 3, columns = WIDTH, rows = STRIP;
    uint16_t alpha = EXTRASAMPLE_UNASSALPHA;
    if (r->samples > colours)
        TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, 1, &alpha);
    if (r->tiles) {
        columns = rows = TILE;
        TIFFSetField(tiff, TIFFTAG_TILEWIDTH, TILE);
        TIFFSetField(tiff, TIFFTAG_TILELENGTH, TILE);
    } else {
        TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, STRIP);
    }
    int together = r->planes ? 1 : r->samples;
    for (int p = 0; p < (r->planes ? r->samples : 1); p++)
        for (int top = 0; top < HEIGHT; top += rows)
            for (int left = 0; left < WIDTH; left += columns) {
                int some = r->tiles || HEIGHT - top > rows ? rows : HEIGHT - top;
                for (int i = 0; i < some * columns * together; i++)
                    put_sample_of(r, block, (size_t)i, left + i / together % columns,
                                  top + i / together / columns,
                                  i % together + p < colours ? i % together + p : 3);
                tmsize_t size = (tmsize_t)some * columns * together * r->bits / 8;
                uint16_t plane = (uint16_t)p;
                uint32_t x = (uint32_t)left, y = (uint32_t)top;
                assert_true((r->tiles ? TIFFWriteEncodedTile(
                                 tiff, TIFFComputeTile(tiff, x, y, 0, plane), block, size)
                                      : TIFFWriteEncodedStrip(
                                          tiff, TIFFComputeStrip(tiff, y, plane), block, size))
                            == size);
            }
    TIFFClose(tiff);
}

static void test_tiff(void **state)
{
    const struct tiff_row *r = *state;
    struct photo info;
    write_form(r);
    float *dn = read_all(&info);
    assert_int_equal(info.channels, 3);
    assert_int_equal(info.gray, r->photometric == 1);
    assert_int_equal(info.bits, r->format == 3 ? 32 : r->bits);
    for (int i = 0; i < 3 * PIXELS; i++) {
        int code = code_at(i / 3 % WIDTH, i / 3 / WIDTH, info.gray ? 0 : i % 3);
        double due = r->format == 3 ? 65535 * code / 256.0 : code * (r->bits == 8 ? 1 : 257);
        assert_near((double)dn[i], due, 1e-6 * due);
    }
    free(dn);
}

static void test_tiff_of_a_palette_is_refused(void **state)
{
    (void)state;
    struct tiff_row r = {"",    "w",  PHOTOMETRIC_MINISWHITE, 1, 8, 1, COMPRESSION_NONE, 1,
                         false, false};
    write_form(&r);
    expect_refused("neither RGB nor gray");
}

/* ---- PNG --------------------------------------------------------------------------------- */

static struct png_row {
    const char *name;
    int type, bits;
    double gamma;  // 0: no chunk; -1: sRGB
} png_rows[] = {
    {"RGB with alpha, 16 bits", PNG_COLOR_TYPE_RGBA, 16, 0},
    {"gray, 16 bits", PNG_COLOR_TYPE_GRAY, 16, 0},
    {"gray with alpha, 8 bits", PNG_COLOR_TYPE_GRAY_ALPHA, 8, 0},
    {"gray, 4 bits", PNG_COLOR_TYPE_GRAY, 4, 0},
    {"palette", PNG_COLOR_TYPE_PALETTE, 8, 0},
    {"16 bits that say they are linear", PNG_COLOR_TYPE_RGB, 16, 1},
    {"16 bits that say they are a power", PNG_COLOR_TYPE_RGB, 16, 0.5},
    {"16 bits that say they are sRGB", PNG_COLOR_TYPE_RGB, 16, -1},
    {"8 bits, encoded whatever they say", PNG_COLOR_TYPE_RGB, 8, 0.5},
};
enum { PNG_ROWS = sizeof png_rows / sizeof *png_rows };

static void write_png_form(const struct png_row *r, int interlace)
{
    FILE *file = fopen(path, "wb");
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
    png_infop info = png_create_info_struct(png);
    static png_color palette[256];
    assert_non_null(file);
    assert_int_equal(setjmp(png_jmpbuf(png)), 0);
    png_init_io(png, file);
    png_set_IHDR(png, info, WIDTH, HEIGHT, r->bits, r->type, interlace, 0, 0);
    for (int i = 0; i < 256; i++)  // of the first row's codes
        palette[i] = (png_color){(png_byte)i, (png_byte)(255 - i), (png_byte)(i ^ 85)};
    if (r->type == PNG_COLOR_TYPE_PALETTE)
        png_set_PLTE(png, info, palette, 256);
    if (r->gamma > 0)
        png_set_gAMA(png, info, r->gamma);
    if (r->gamma < 0)
        png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_write_info(png, info);
    int colours = r->type & PNG_COLOR_MASK_COLOR && r->type != PNG_COLOR_TYPE_PALETTE ? 3 : 1;
    int samples = colours + (r->type & PNG_COLOR_MASK_ALPHA ? 1 : 0);
    int passes = png_set_interlace_handling(png);
    for (int row = 0; row < passes * HEIGHT; row++) {
        int y = row % HEIGHT;
        unsigned char line[8 * WIDTH] = {0};
        for (int i = 0; i < WIDTH * samples; i++) {
            int code = i % samples < colours ? code_at(i / samples, y, i % samples) : 99;
            if (r->bits == 4)
                line[i / 2] = (unsigned char)(line[i / 2] | code / 16 << (i % 2 ? 0 : 4));
            else if (r->bits == 8)
                line[i] = (unsigned char)code;
            else
                line[2 * i] = line[2 * i + 1] = (unsigned char)code;  // code * 257
        }
        png_write_row(png, line);
    }
    png_write_end(png, NULL);
    png_destroy_write_struct(&png, &info);
    assert_int_equal(fclose(file), 0);
}

static double due_of_png(const struct png_row *r, int x, int y, int c)
{
    int code =
        code_at(x, y, r->type == PNG_COLOR_TYPE_RGB || r->type == PNG_COLOR_TYPE_RGBA ? c : 0);
    double v = code / 255.0;
    if (r->type == PNG_COLOR_TYPE_PALETTE)
        return c == 0 ? code : c == 1 ? 255 - code : code ^ 85;
    if (r->bits < 16)
        return r->bits == 4 ? code / 16 * 17 : code;
    if (r->gamma > 0)
        return 65535 * pow(v, 1 / r->gamma);
    return 65535 * (r->gamma < 0 ? v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4) : v);
}

static void expect_png(const struct png_row *r, int interlace)
{
    struct photo info;
    write_png_form(r, interlace);
    float *dn = read_all(&info);
    assert_int_equal(info.channels, 3);
    assert_int_equal(info.bits, r->bits == 16 ? 16 : 8);
    assert_int_equal(info.encoded, r->bits < 16);
    assert_int_equal(info.gray,
                     r->type == PNG_COLOR_TYPE_GRAY || r->type == PNG_COLOR_TYPE_GRAY_ALPHA);
    assert_int_equal(info.decoded, r->bits == 16 && r->gamma != 0 && r->gamma != 1);
    for (int i = 0; i < 3 * PIXELS; i++)
        assert_near((double)dn[i], due_of_png(r, i / 3 % WIDTH, i / 3 / WIDTH, i % 3), 0.01);
    free(dn);
}

static void test_png(void **state)
{
    expect_png(*state, PNG_INTERLACE_NONE);
}

static void test_interlaced_png(void **state)
{
    (void)state;
    for (int i = 0; i < PNG_ROWS; i++)
        expect_png(&png_rows[i], PNG_INTERLACE_ADAM7);
}

static void test_interlaced_png_that_ends_early_is_refused(void **state)
{
    (void)state;
    write_png_form(&(struct png_row){"", PNG_COLOR_TYPE_RGB, 16, 0}, PNG_INTERLACE_ADAM7);
    assert_int_equal(truncate(path, 200), 0);
    struct photo_file *file;
    struct error err = {0};
    static float dn[3 * PIXELS];
    assert_int_equal(photo_open(&file, path, &err), STATUS_OK);
    assert_int_equal(photo_read(file, dn, HEIGHT, &err), STATUS_FORMAT);
    photo_close(file);
    photo_forget();
}

/* ---- JPEG -------------------------------------------------------------------------------- */

static void write_jpeg_form(J_COLOR_SPACE space, int components, bool progressive)
{
    struct jpeg_compress_struct jpeg;
    struct jpeg_error_mgr errors;
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_compress(&jpeg);
    jpeg_stdio_dest(&jpeg, file);
    jpeg.image_width = WIDTH;
    jpeg.image_height = HEIGHT;
    jpeg.input_components = components;
    jpeg.in_color_space = space;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, 100, TRUE);
    if (progressive)
        jpeg_simple_progression(&jpeg);
    jpeg_start_compress(&jpeg, TRUE);
    static unsigned char line[4 * WIDTH];
    JSAMPLE *rows[] = {line};
    for (int y = 0; y < HEIGHT; y++) {
        memset(line, 40 + 7 * y, sizeof line);
        jpeg_write_scanlines(&jpeg, rows, 1);
    }
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    assert_int_equal(fclose(file), 0);
}

static void expect_steps(bool gray)
{
    struct photo info;
    float *dn = read_all(&info);
    assert_int_equal(info.channels, 3);
    assert_int_equal(info.gray, gray);
    for (int i = 0; i < 3 * PIXELS; i++)
        assert_near((double)dn[i], 40 + 7 * (i / 3 / WIDTH), 2.5);  // rounding of the DCT
    free(dn);
}

static void test_gray_jpeg(void **state)
{
    (void)state;
    write_jpeg_form(JCS_GRAYSCALE, 1, false);
    expect_steps(true);
}

static void test_progressive_jpeg(void **state)
{
    (void)state;
    write_jpeg_form(JCS_RGB, 3, true);
    expect_steps(false);
}

static void test_jpeg_of_print_is_refused(void **state)
{
    (void)state;
    write_jpeg_form(JCS_CMYK, 4, false);
    expect_refused("CMYK");
}

int main(void)
{
    const struct CMUnitTest more[] = {
        cmocka_unit_test(test_tiff_of_a_palette_is_refused),
        cmocka_unit_test(test_interlaced_png),
        cmocka_unit_test(test_interlaced_png_that_ends_early_is_refused),
        cmocka_unit_test(test_gray_jpeg),
        cmocka_unit_test(test_progressive_jpeg),
        cmocka_unit_test(test_jpeg_of_print_is_refused),
    };
    enum { MORE = sizeof more / sizeof *more };
    struct CMUnitTest tests[TIFF_ROWS + PNG_ROWS + MORE];
    int n = 0;
    for (int i = 0; i < TIFF_ROWS; i++)
        tests[n++] = (struct CMUnitTest){tiff_rows[i].name, test_tiff, NULL, NULL, &tiff_rows[i]};
    for (int i = 0; i < PNG_ROWS; i++)
        tests[n++] = (struct CMUnitTest){png_rows[i].name, test_png, NULL, NULL, &png_rows[i]};
    memcpy(&tests[n], more, sizeof more);
    return cmocka_run_group_tests(tests, make_file, remove_file);
}
