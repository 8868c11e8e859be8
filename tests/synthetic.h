/* synthetic.h -- sensors with known noise, and photographs of them, for the tests of capture/. */
#ifndef GONIOCAM_SYNTHETIC_H
#define GONIOCAM_SYNTHETIC_H

#include "near.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <tiffio.h>

/* S. Vigna's SplitMix64; uniform in (0, 1). */
static inline double random_uniform(uint64_t *state)
{
    uint64_t z = (*state += 0x9E3779B97F4A7C15u);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return ((double)((z ^ (z >> 31)) >> 11) + 0.5) / 9007199254740992.0;
}

static inline double random_normal(uint64_t *state)
{
    double radius = sqrt(-2 * log(random_uniform(state)));
    return radius * cos(2 * 3.14159265358979323846 * random_uniform(state));
}

/* Photons: by counting gaps below 30, a rounded normal above (its skewness is lost). */
static inline double random_poisson(uint64_t *state, double mean)
{
    if (mean > 30)
        return fmax(0, rint(mean + sqrt(mean) * random_normal(state)));
    double product = random_uniform(state), limit = exp(-mean);
    int count = 0;
    for (; product > limit; count++)
        product *= random_uniform(state);
    return count;
}

/* DN = clip(round(black + (min(photons, full_well) + read noise) / gain)). */
struct chip {
    double black, gain, read_noise, full_well;  // DN, electrons a DN, electrons, electrons
    int top;                                    // of the converter
};

static inline uint16_t chip_expose(const struct chip *chip, double electrons, uint64_t *state)
{
    double e = random_poisson(state, electrons);
    e = fmin(e, chip->full_well) + chip->read_noise * random_normal(state);
    return (uint16_t)fmin(fmax(rint(chip->black + e / chip->gain), 0), chip->top);
}

/* How a TIFF is laid out. */
struct tiff_form {
    int bits, samples, compression, tile;  // tile 0: strips of 8 rows
    bool planes;
    double exposure_time;  // 0: no EXIF
};

static inline void write_exif_ifd(TIFF *tiff, double exposure_time)
{
    uint64_t offset = 0;
    uint16_t iso = 100;
    assert_int_equal(TIFFWriteDirectory(tiff), 1);
    assert_int_equal(TIFFCreateEXIFDirectory(tiff), 0);
    assert_int_equal(TIFFSetField(tiff, EXIFTAG_EXPOSURETIME, exposure_time), 1);
    assert_int_equal(TIFFSetField(tiff, EXIFTAG_FNUMBER, 8.0), 1);
    assert_int_equal(TIFFSetField(tiff, EXIFTAG_FOCALLENGTH, 50.0), 1);
    assert_int_equal(TIFFSetField(tiff, EXIFTAG_ISOSPEEDRATINGS, 1, &iso), 1);
    assert_int_equal(TIFFWriteCustomDirectory(tiff, &offset), 1);
    assert_int_equal(TIFFSetDirectory(tiff, 0), 1);
    assert_int_equal(TIFFSetField(tiff, TIFFTAG_EXIFIFD, offset), 1);
    assert_int_equal(TIFFRewriteDirectory(tiff), 1);
}

/* One sample of one pixel, in the file's width. */
static inline void put_sample(unsigned char *to, size_t index, int bits, uint16_t value)
{
    if (bits == 8)
        to[index] = (unsigned char)value;
    else
        memcpy(to + 2 * index, &value, 2);
}

/* The block of rgb[height][width][3] at (left, top), of plane p or (p < 0) all samples. */
static inline void fill_block(unsigned char *block, const uint16_t *rgb, int width, int height,
                              const struct tiff_form *form, int left, int top, int columns,
                              int rows, int p)
{
    int samples = p < 0 ? form->samples : 1;
    for (int y = 0; y < rows; y++)
        for (int x = 0; x < columns; x++)
            for (int c = 0; c < samples; c++) {
                int from = p < 0 ? c : p;
                bool inside = left + x < width && top + y < height && from < 3;
                size_t at = ((size_t)(top + y) * width + left + x) * 3 + from;
                put_sample(block, ((size_t)y * columns + x) * samples + c, form->bits,
                           inside ? rgb[at] : 0);
            }
}

static inline void write_tiff(const char *path, const uint16_t *rgb, int width, int height,
                              const struct tiff_form *form)
{
    enum { STRIP_ROWS = 8 };
    TIFF *tiff = TIFFOpen(path, "w");
    assert_non_null(tiff);
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, width);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, height);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, form->bits);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, form->samples);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_RGB);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, form->compression);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG,
                 form->planes ? PLANARCONFIG_SEPARATE : PLANARCONFIG_CONTIG);
    if (form->tile) {
        TIFFSetField(tiff, TIFFTAG_TILEWIDTH, form->tile);
        TIFFSetField(tiff, TIFFTAG_TILELENGTH, form->tile);
    } else {
        TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, STRIP_ROWS);
    }
    if (form->samples == 4) {
        uint16_t alpha = EXTRASAMPLE_UNASSALPHA;
        TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, 1, &alpha);
    }
    int columns = form->tile ? form->tile : width, rows = form->tile ? form->tile : STRIP_ROWS;
    size_t pixel = (size_t)form->bits / 8 * (form->planes ? 1 : form->samples);
    unsigned char *block = malloc((size_t)columns * rows * pixel);
    assert_non_null(block);
    for (int p = form->planes ? 0 : -1; p < (form->planes ? form->samples : 0); p++)
        for (int top = 0; top < height; top += rows)
            for (int left = 0; left < width; left += columns) {
                int some = form->tile || height - top > rows ? rows : height - top;
                fill_block(block, rgb, width, height, form, left, top, columns, some, p);
                size_t size = (size_t)columns * some * pixel;
                uint16_t plane = (uint16_t)(p < 0 ? 0 : p);
                uint32_t index =
                    form->tile ? TIFFComputeTile(tiff, (uint32_t)left, (uint32_t)top, 0, plane)
                               : TIFFComputeStrip(tiff, (uint32_t)top, plane);
                tmsize_t done = form->tile
                                    ? TIFFWriteEncodedTile(tiff, index, block, (tmsize_t)size)
                                    : TIFFWriteEncodedStrip(tiff, index, block, (tmsize_t)size);
                assert_true(done == (tmsize_t)size);
            }
    free(block);
    if (form->exposure_time > 0)
        write_exif_ifd(tiff, form->exposure_time);
    TIFFClose(tiff);
}

/* A raw file as LibRaw reads it: an uncompressed DNG of a mosaic RGGB, 16 bits. */
enum { DNG_BLACK = 128, DNG_WHITE = 4095 };

static inline void write_dng(const char *path, const uint16_t *mosaic, int width, int height,
                             double exposure_time)
{
    static const uint8_t version[4] = {1, 4, 0, 0}, backward[4] = {1, 1, 0, 0};
    static const uint8_t pattern[4] = {0, 1, 1, 2};
    static const uint16_t cell[2] = {2, 2}, one[2] = {1, 1};
    static const float matrix[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, neutral[3] = {1, 1, 1};
    float black = DNG_BLACK;
    uint32_t white = DNG_WHITE;
    TIFF *tiff = TIFFOpen(path, "w");
    assert_non_null(tiff);
    TIFFSetField(tiff, TIFFTAG_SUBFILETYPE, 0);
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, width);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, height);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 16);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, 32803);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, height);
    TIFFSetField(tiff, TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT);
    TIFFSetField(tiff, TIFFTAG_MAKE, "Synthetic");
    TIFFSetField(tiff, TIFFTAG_MODEL, "Chip");
    TIFFSetField(tiff, TIFFTAG_DNGVERSION, version);
    TIFFSetField(tiff, TIFFTAG_DNGBACKWARDVERSION, backward);
    TIFFSetField(tiff, TIFFTAG_UNIQUECAMERAMODEL, "Synthetic Chip");
    TIFFSetField(tiff, TIFFTAG_CFAREPEATPATTERNDIM, cell);
    TIFFSetField(tiff, TIFFTAG_CFAPATTERN, 4, pattern);
    TIFFSetField(tiff, TIFFTAG_COLORMATRIX1, 9, matrix);
    TIFFSetField(tiff, TIFFTAG_ASSHOTNEUTRAL, 3, neutral);
    TIFFSetField(tiff, TIFFTAG_CALIBRATIONILLUMINANT1, 21);
    TIFFSetField(tiff, TIFFTAG_BLACKLEVELREPEATDIM, one);
    TIFFSetField(tiff, TIFFTAG_BLACKLEVEL, 1, &black);
    TIFFSetField(tiff, TIFFTAG_WHITELEVEL, 1, &white);
    assert_true(
        TIFFWriteEncodedStrip(tiff, 0, (void *)(uintptr_t)mosaic, (tmsize_t)width * height * 2)
        > 0);
    write_exif_ifd(tiff, exposure_time);
    TIFFClose(tiff);
}
#endif
