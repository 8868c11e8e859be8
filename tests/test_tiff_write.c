/* Photographs on disk: libtiff reads every value and every EXIF field back. */
#include "near.h"
#include "random.h"
#include "tiff_write.h"

#include <stdlib.h>
#include <string.h>
#include <tiffio.h>
#include <unistd.h>

enum { WIDTH = 37, HEIGHT = 2500 };  // odd, and higher than a strip

static const struct exif exif = {5.6, 400, 85, "Maker", "Model 1"};

static uint16_t *noise(void)
{
    uint16_t *dn = malloc(sizeof *dn * WIDTH * HEIGHT * 3);
    struct random random = sam_random_at(1, 2, 3);
    assert_non_null(dn);
    for (int i = 0; i < WIDTH * HEIGHT * 3; i++)
        dn[i] = (uint16_t)(sam_uniform(&random) * 65536);
    return dn;
}

static void check_pixels(TIFF *tiff, const uint16_t *dn)
{
    uint16_t row[WIDTH * 3];
    for (int y = 0; y < HEIGHT; y++) {
        assert_int_equal(TIFFReadScanline(tiff, row, (uint32_t)y, 0), 1);
        assert_memory_equal(row, &dn[y * WIDTH * 3], sizeof row);
    }
}

static void check_exif(TIFF *tiff, double seconds)
{
    char *text;
    assert_int_equal(TIFFGetField(tiff, TIFFTAG_MAKE, &text), 1);
    assert_string_equal(text, "Maker");
    assert_int_equal(TIFFGetField(tiff, TIFFTAG_MODEL, &text), 1);
    assert_string_equal(text, "Model 1");
    uint64_t place;
    uint16_t count, *iso;
    float time, number;  // as libtiff hands out fractions
    assert_int_equal(TIFFGetField(tiff, TIFFTAG_EXIFIFD, &place), 1);
    assert_int_equal(TIFFReadEXIFDirectory(tiff, place), 1);
    assert_int_equal(TIFFGetField(tiff, EXIFTAG_EXPOSURETIME, &time), 1);
    assert_near(time, seconds, 1e-7 * seconds);  // a fraction of whole numbers
    assert_int_equal(TIFFGetField(tiff, EXIFTAG_FNUMBER, &number), 1);
    assert_near(number, 5.6, 1e-6);
    assert_int_equal(TIFFGetField(tiff, EXIFTAG_FOCALLENGTH, &number), 1);
    assert_near(number, 85, 1e-6);
    assert_int_equal(TIFFGetField(tiff, EXIFTAG_ISOSPEEDRATINGS, &count, &iso), 1);
    assert_int_equal(iso[0], 400);
}

static double times[] = {1.0 / 1024, 1.0 / 32, 0.3, 2.5, 30, 0.0123456};
enum { TIMES = sizeof times / sizeof *times };

static void test_round_trip(void **state)
{
    double seconds = *(double *)*state;
    char path[] = "/tmp/test_tiff_XXXXXX";
    assert_int_equal(close(mkstemp(path)), 0);
    uint16_t *dn = noise(), *copy = noise();
    struct error err = {0};
    assert_int_equal(sam_tiff_write(path, copy, WIDTH, HEIGHT, &exif, seconds, &err), STATUS_OK);
    TIFF *tiff = TIFFOpen(path, "r");
    assert_non_null(tiff);
    check_pixels(tiff, dn);
    check_exif(tiff, seconds);
    TIFFClose(tiff);
    remove(path);
    free(dn);
    free(copy);
}

static void test_no_folder(void **state)
{
    (void)state;
    uint16_t *dn = noise();
    struct error err = {0};
    assert_int_equal(sam_tiff_write("/nowhere/a.tif", dn, WIDTH, HEIGHT, &exif, 1, &err),
                     STATUS_IO);
    assert_non_null(strstr(err.text, "/nowhere/a.tif"));
    assert_non_null(strstr(err.text, "No such file"));
    free(dn);
}

// /dev/full takes a file's opening and refuses its bytes, as a full disk does.
static void test_full_disk_leaves_nothing(void **state)
{
    (void)state;
    char folder[] = "/tmp/test_tiff_XXXXXX", path[64], aside[96];
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/a.tif", folder);
    snprintf(aside, sizeof aside, "%s.%ld.part", path, (long)getpid());
    assert_int_equal(symlink("/dev/full", aside), 0);
    uint16_t *dn = noise();
    struct error err = {0};
    assert_int_equal(sam_tiff_write(path, dn, WIDTH, HEIGHT, &exif, 1, &err), STATUS_IO);
    assert_non_null(strstr(err.text, path));
    assert_int_equal(access(path, F_OK), -1);
    assert_int_equal(access(aside, F_OK), -1);
    free(dn);
    rmdir(folder);
}

int main(void)
{
    struct CMUnitTest tests[TIMES + 2];
    for (int i = 0; i < TIMES; i++)
        tests[i] = (struct CMUnitTest){"round trip", test_round_trip, NULL, NULL, &times[i]};
    tests[TIMES] = (struct CMUnitTest)cmocka_unit_test(test_no_folder);
    tests[TIMES + 1] = (struct CMUnitTest)cmocka_unit_test(test_full_disk_leaves_nothing);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
