/* PNG photographs, as the program itself reads them. */
#include "png_write.h"
#include "near.h"

#include <png.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { WIDTH = 5, HEIGHT = 3, VALUES = WIDTH * HEIGHT * 3 };

// All 16 bits of every value come back, and the exposure time stands in the eXIf chunk as 1/30.
static void test_values_and_exif_come_back(void **state)
{
    (void)state;
    char path[] = "/tmp/test_png_XXXXXX";
    int file = mkstemp(path);
    assert_true(file >= 0 && close(file) == 0);
    uint16_t dn[VALUES], back[VALUES];
    for (int i = 0; i < VALUES; i++)
        dn[i] = (uint16_t)(i * 1489);
    const struct exif exif = {2.8, 200, 50, "Maker", "Model 1"};
    assert_int_equal(sam_png_write(path, dn, WIDTH, HEIGHT, &exif, 1.0 / 30, NULL), STATUS_OK);

    FILE *stream = fopen(path, "rb");
    assert_non_null(stream);
    png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
    png_infop info = png_create_info_struct(png);
    png_init_io(png, stream);
    png_read_info(png, info);
    assert_int_equal(png_get_image_width(png, info), WIDTH);
    assert_int_equal(png_get_bit_depth(png, info), 16);
    png_bytep block = NULL;
    png_uint_32 size = 0;
    assert_true(png_get_eXIf_1(png, info, &size, &block) && size > 8);
    assert_memory_equal(block, "II*", 4);  // a TIFF, little-endian
    static const unsigned char thirtieth[8] = {1, 0, 0, 0, 30, 0, 0, 0};
    assert_non_null(memmem(block, size, thirtieth, sizeof thirtieth));
    png_set_swap(png);
    for (int y = 0; y < HEIGHT; y++)
        png_read_row(png, (png_bytep)&back[y * WIDTH * 3], NULL);
    assert_memory_equal(back, dn, sizeof dn);
    png_destroy_read_struct(&png, &info, NULL);
    fclose(stream);
    unlink(path);
}

static void test_no_such_folder(void **state)
{
    (void)state;
    uint16_t dn[3] = {0};
    const struct exif exif = {2.8, 200, 50, "Maker", "Model 1"};
    struct error err = {0};
    assert_int_equal(sam_png_write("/nowhere/a.png", dn, 1, 1, &exif, 1, &err), STATUS_IO);
    assert_non_null(strstr(err.text, "/nowhere/a.png"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_values_and_exif_come_back),
        cmocka_unit_test(test_no_such_folder),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
