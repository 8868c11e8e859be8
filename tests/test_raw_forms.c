/* Raw files of other sensors than Bayer's, with borders and orientations: all photosites, as they
 * were, and the channel of each. */
#include "photo_forms.h"

/* A DNG of 16 bits: samples 1 with a cell of side x side filters (0: none), or 3. */
struct dng_form {
    int side, samples, orientation;
    const char *letters;
    int active[4];  // top, left, bottom, right of what is visible; 0: all
};

static void write_dng_form(const char *name, const struct dng_form *f)
{
    static const uint8_t version[4] = {1, 4, 0, 0}, backward[4] = {1, 1, 0, 0};
    static const float matrix[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, neutral[3] = {1, 1, 1};
    static uint16_t dn[3 * PIXELS];
    uint16_t cell[2] = {(uint16_t)f->side, (uint16_t)f->side}, one[2] = {1, 1};
    uint8_t cfa[64] = {0};
    float black[3] = {128, 128, 128};
    uint32_t white = 65535, active[4];
    for (int i = 0; i < f->side * f->side; i++)
        cfa[i] = f->letters[i] == 'R' ? 0 : f->letters[i] == 'G' ? 1 : 2;
    for (int i = 0; i < 4; i++)
        active[i] = (uint32_t)f->active[i];
    for (int i = 0; i < PIXELS * f->samples; i++)
        dn[i] = (uint16_t)(1000 + 13 * i % 50000);
    TIFF *tiff = TIFFOpen(name, "w");
    assert_non_null(tiff);
    TIFFSetField(tiff, TIFFTAG_SUBFILETYPE, 0);
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, WIDTH);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, HEIGHT);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 16);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, f->samples);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, f->side ? 32803 : 34892);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, HEIGHT);
    TIFFSetField(tiff, TIFFTAG_ORIENTATION, f->orientation);
    TIFFSetField(tiff, TIFFTAG_MAKE, "Synthetic");
    TIFFSetField(tiff, TIFFTAG_MODEL, "Chip");
    TIFFSetField(tiff, TIFFTAG_DNGVERSION, version);
    TIFFSetField(tiff, TIFFTAG_DNGBACKWARDVERSION, backward);
    TIFFSetField(tiff, TIFFTAG_UNIQUECAMERAMODEL, "Synthetic Chip");
    if (f->side) {
        TIFFSetField(tiff, TIFFTAG_CFAREPEATPATTERNDIM, cell);
        TIFFSetField(tiff, TIFFTAG_CFAPATTERN, f->side * f->side, cfa);
    }
    if (f->active[2])
        TIFFSetField(tiff, TIFFTAG_ACTIVEAREA, active);
    if (f->side || f->samples > 1) {
        TIFFSetField(tiff, TIFFTAG_COLORMATRIX1, 9, matrix);
        TIFFSetField(tiff, TIFFTAG_ASSHOTNEUTRAL, 3, neutral);
        TIFFSetField(tiff, TIFFTAG_CALIBRATIONILLUMINANT1, 21);
    }
    TIFFSetField(tiff, TIFFTAG_BLACKLEVELREPEATDIM, one);
    TIFFSetField(tiff, TIFFTAG_BLACKLEVEL, f->samples, black);
    TIFFSetField(tiff, TIFFTAG_WHITELEVEL, 1, &white);
    assert_true(TIFFWriteEncodedStrip(tiff, 0, dn, (tmsize_t)2 * PIXELS * f->samples) > 0);
    write_exif_ifd(tiff, 0.125);
    TIFFClose(tiff);
}

#define XTRANS "GBGGRGRGRBGBGBGGRGGRGGBGBGBRGRGRGGBG"

static struct raw_row {
    const char *name;
    struct dng_form form;
    const char *cfa;  // due
} raw_rows[] = {
    {"X-Trans", {6, 1, 1, XTRANS, {0}}, XTRANS},
    // The cell is told from the first visible photosite, at row 2 and column 4.
    {"X-Trans with a border",
     {6, 1, 1, XTRANS, {2, 4, 29, 40}},
     "BRGRBGGGBGGRGGRGGBRBGBRGGGRGGBGGBGGR"},
    {"Bayer with a border", {2, 1, 1, "RGGB", {1, 1, 28, 37}}, "BGGR"},
    {"no filters", {0, 1, 1, "", {0}}, ""},
    {"three numbers a pixel", {0, 3, 1, "", {0}}, ""},
    {"orientation 2", {2, 1, 2, "GRBG", {0}}, "GRBG"},
    {"orientation 3", {2, 1, 3, "GRBG", {0}}, "GRBG"},
    {"orientation 4", {2, 1, 4, "GRBG", {0}}, "GRBG"},
    {"orientation 5", {2, 1, 5, "GRBG", {0}}, "GRBG"},
    {"orientation 6", {2, 1, 6, "GRBG", {0}}, "GRBG"},
    {"orientation 7", {2, 1, 7, "GRBG", {0}}, "GRBG"},
    {"orientation 8", {2, 1, 8, "GRBG", {0}}, "GRBG"},
};
enum { RAW_ROWS = sizeof raw_rows / sizeof *raw_rows };

static void check_rows(struct photo_file *file, int from)
{
    static float dn[3 * PIXELS];
    struct error err = {0};
    const struct photo *info = &file->info;
    const int line = WIDTH * info->channels;
    assert_int_equal(photo_skip(file, from, &err), STATUS_OK);
    assert_int_equal(photo_read(file, dn, HEIGHT - from, &err), STATUS_OK);
    for (int i = 0; i < line * (HEIGHT - from); i++) {
        int at = i + line * from;
        assert_near((double)dn[i], 1000 + 13 * (info->gray ? at / 3 : at) % 50000, 0);
    }
}

static void test_raw(void **state)
{
    const struct raw_row *r = *state;
    char dng[sizeof path + 4];
    struct photo_file *file = NULL;
    struct error err = {0};
    snprintf(dng, sizeof dng, "%s.dng", path);
    write_dng_form(dng, &r->form);
    if (photo_open(&file, dng, &err))
        fail_msg("%s", err.text);
    const struct photo info = file->info;
    check_rows(file, 0);
    assert_false(file->aside);  // no folder for it
    photo_close(file);
    photo_forget();
    remove(dng);
    assert_int_equal(info.width, WIDTH);
    assert_int_equal(info.height, HEIGHT);
    assert_string_equal(info.cfa, r->cfa);
    assert_int_equal(info.orientation, r->form.orientation);
    assert_int_equal(info.gray, !r->form.side && r->form.samples == 1);
    assert_int_equal(info.channels, r->form.side ? 1 : 3);
    assert_near(info.black, 128, 0);
}

static void test_raw_aside(void **state)
{
    const struct raw_row *r = *state;
    char dng[sizeof path + 4];
    snprintf(dng, sizeof dng, "%s.dng", path);
    write_dng_form(dng, &r->form);
    photo_keep_in("/tmp");
    for (int again = 0; again < 2; again++) {
        struct photo_file *file = NULL;
        assert_int_equal(photo_open(&file, dng, NULL), STATUS_OK);
        assert_int_equal(file->aside, again);  // decoded already
        check_rows(file, 11 * again);
        assert_true(file->aside);
        photo_close(file);
    }
    photo_forget();
    remove(dng);
}

static void test_no_room_aside(void **state)
{
    const struct raw_row *r = *state;
    char dng[sizeof path + 4];
    struct photo_file *file = NULL;
    snprintf(dng, sizeof dng, "%s.dng", path);
    write_dng_form(dng, &r->form);
    photo_keep_in("/proc");
    assert_int_equal(photo_open(&file, dng, NULL), STATUS_OK);
    check_rows(file, 0);
    assert_false(file->aside);
    photo_close(file);
    photo_forget();
    remove(dng);
}

int main(void)
{
    struct CMUnitTest tests[2 * RAW_ROWS + 1];
    char names[RAW_ROWS][80];
    int n = 0;
    for (int i = 0; i < RAW_ROWS; i++) {
        snprintf(names[i], sizeof names[i], "%s, aside", raw_rows[i].name);
        tests[n++] = (struct CMUnitTest){raw_rows[i].name, test_raw, NULL, NULL, &raw_rows[i]};
        tests[n++] = (struct CMUnitTest){names[i], test_raw_aside, NULL, NULL, &raw_rows[i]};
    }
    tests[n++] = (struct CMUnitTest){"no room aside", test_no_room_aside, NULL, NULL, &raw_rows[0]};
    return cmocka_run_group_tests(tests, make_file, remove_file);
}
