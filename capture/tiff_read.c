/* tiff_read.c -- TIFF photographs: RGB or gray of 8 or 16 bits, half or float, in strips or tiles,
 * any compression.
 *
 * Strips and tiles are decoded whole, into a band of rows: libtiff is twice as fast then as row by
 * row (libdeflate instead of zlib). Only strips too large for that are read by rows, so that
 * memory stays small whatever the size of a strip. libtiff's messages are caught
 * by a handler of the file's own (libtiff 4.5), and end up in struct error.
 */
#include "photo.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <tiffio.h>

struct tiff_file {
    struct photo_file base;
    TIFF *tiff;
    int samples;  // a pixel in the file; the first three are R, G, B, or the first gray
    bool tiled, planes, banded;
    bool half;            // 16-bit numbers of floating point
    bool differences;     // line holds each pixel less the one on its left
    size_t bytes;         // a sample
    int band_rows;        // rows a strip or tile
    unsigned char *line;  // a row, strip or tile as in the file
    float *band;          // [band_rows][width][3], of tiles and planes
    int band_top;         // the first row that line (or band) holds; -1: none
    char message[300];    // libtiff's first
};

static int keep_message(TIFF *tiff, void *user, const char *module, const char *format,
                        va_list args)
{
    (void)tiff, (void)module;
    struct tiff_file *file = user;
    if (!*file->message)
        vsnprintf(file->message, sizeof file->message, format, args);
    return 1;  // handled: nothing is printed
}

static int drop_message(TIFF *tiff, void *user, const char *module, const char *format,
                        va_list args)
{
    (void)tiff, (void)user, (void)module, (void)format, (void)args;
    return 1;
}

// Some of libtiff's messages begin with the path, which is told once.
static enum status fail(struct tiff_file *file, struct error *err, const char *otherwise)
{
    const char *path = file->base.path, *told = *file->message ? file->message : otherwise;
    const size_t length = strlen(path);
    if (strncmp(told, path, length) == 0 && strncmp(told + length, ": ", 2) == 0)
        told += length + 2;
    return cap_fail(err, STATUS_FORMAT, "%s: %s", path, told);
}

/* A tag of rational type; libtiff hands it over as float or double, as its table says. */
static double number_tag(TIFF *tiff, uint32_t tag)
{
    const TIFFField *field = TIFFFindField(tiff, tag, TIFF_ANY);
    float single = 0;
    double value = 0;
    if (!field)
        return 0;
    if (TIFFFieldSetGetSize(field) == sizeof value)
        return TIFFGetField(tiff, tag, &value) ? value : 0;
    return TIFFGetField(tiff, tag, &single) ? (double)single : 0;
}

static void text_tag(TIFF *tiff, uint32_t tag, char *to, size_t size)
{
    char *text = NULL;
    if (TIFFGetField(tiff, tag, &text) && text)
        snprintf(to, size, "%s", text);
}

static void read_exif(struct tiff_file *file)
{
    struct photo *info = &file->base.info;
    toff_t offset = 0;
    text_tag(file->tiff, TIFFTAG_MAKE, info->make, sizeof info->make);
    text_tag(file->tiff, TIFFTAG_MODEL, info->model, sizeof info->model);
    text_tag(file->tiff, TIFFTAG_DATETIME, info->taken, sizeof info->taken);
    uint16_t orientation = 0;
    if (TIFFGetField(file->tiff, TIFFTAG_ORIENTATION, &orientation))
        info->orientation = orientation;
    if (TIFFGetField(file->tiff, TIFFTAG_EXIFIFD, &offset)
        && TIFFReadEXIFDirectory(file->tiff, offset)) {
        uint16_t count = 0, *iso = NULL;
        info->exposure_time = number_tag(file->tiff, EXIFTAG_EXPOSURETIME);
        info->aperture = number_tag(file->tiff, EXIFTAG_FNUMBER);
        info->focal_length = number_tag(file->tiff, EXIFTAG_FOCALLENGTH);
        if (TIFFGetField(file->tiff, EXIFTAG_ISOSPEEDRATINGS, &count, &iso) && count > 0)
            info->iso = iso[0];
        text_tag(file->tiff, EXIFTAG_DATETIMEORIGINAL, info->taken, sizeof info->taken);
        text_tag(file->tiff, EXIFTAG_LENSMODEL, info->lens, sizeof info->lens);
    }
    file->message[0] = '\0';  // a broken EXIF block is no broken photograph
    TIFFSetDirectory(file->tiff, 0);
}

/* Does the file hold all the bytes that its directory promises? */
static bool is_complete(TIFF *tiff)
{
    struct stat info;
    if (fstat(TIFFFileno(tiff), &info) != 0)
        return false;
    uint32_t count = TIFFIsTiled(tiff) ? TIFFNumberOfTiles(tiff) : TIFFNumberOfStrips(tiff);
    for (uint32_t i = 0; i < count; i++)
        if (TIFFGetStrileOffset(tiff, i) + TIFFGetStrileByteCount(tiff, i) > (uint64_t)info.st_size)
            return false;
    return true;
}

static enum status read_layout(struct tiff_file *file, struct error *err)
{
    enum { SIDE_MAX = 65535 };
    TIFF *tiff = file->tiff;
    struct photo *info = &file->base.info;
    uint32_t width = 0, height = 0, rows = 0;
    uint16_t bits = 0, samples = 1, format = SAMPLEFORMAT_UINT, photometric = 0, planar = 1;
    void *raw;
    uint32_t raw_size;
    TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &width);
    TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &height);
    TIFFGetField(tiff, TIFFTAG_PHOTOMETRIC, &photometric);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_BITSPERSAMPLE, &bits);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLESPERPIXEL, &samples);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLEFORMAT, &format);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_PLANARCONFIG, &planar);
    file->tiled = TIFFIsTiled(tiff);
    TIFFGetFieldDefaulted(tiff, file->tiled ? TIFFTAG_TILELENGTH : TIFFTAG_ROWSPERSTRIP, &rows);
    if (TIFFGetField(tiff, TIFFTAG_DNGVERSION, &raw_size, &raw))
        return fail(file, err, "a raw file under a TIFF's name; call it .dng");
    if (width == 0 || height == 0 || width > SIDE_MAX || height > SIDE_MAX || rows == 0)
        return fail(file, err, "the size of the image makes no sense");
    info->gray = photometric == PHOTOMETRIC_MINISBLACK;
    if ((photometric != PHOTOMETRIC_RGB && !info->gray) || samples < (info->gray ? 1 : 3)
        || samples > 16)
        return fail(file, err,
                    "neither RGB nor gray (a palette, CMYK, YCbCr, ...); save it as RGB");
    bool whole = (bits == 8 || bits == 16) && format == SAMPLEFORMAT_UINT;
    bool real = (bits == 16 || bits == 32) && format == SAMPLEFORMAT_IEEEFP;
    if (!whole && !real)
        return fail(file, err, "not 8 or 16 bits a sample, nor float of 16 or 32 bits");
    if (!is_complete(tiff))
        return fail(file, err, "the file is truncated");
    file->samples = samples;
    file->planes = planar == PLANARCONFIG_SEPARATE && samples > 1;
    file->band_rows = (int)(rows < height ? rows : height);
    file->band_top = -1;
    info->width = (int)width;
    info->height = (int)height;
    info->channels = 3;
    info->bits = real ? 32 : bits;
    info->encoded = bits == 8;
    file->half = real && bits == 16;
    file->bytes = bits / 8;
    file->base.rows_at_once = file->band_rows;
    file->base.any_row = true;
    return STATUS_OK;
}

/* Does the file hold differences along rows? libtiff then leaves them to us, who sum them on the
 * way to float: summed by libtiff they take a fifth of the time of decoding. Asked last, for to set
 * the directory anew is to forget. */
static bool takes_differences(struct tiff_file *file)
{
    uint16_t predictor = PREDICTOR_NONE;
    const bool plain = file->bytes == 2 && !file->half && file->samples == 3
                       && !file->base.info.gray && !file->planes && !file->tiled;
    return plain && TIFFGetField(file->tiff, TIFFTAG_PREDICTOR, &predictor)
           && predictor == PREDICTOR_HORIZONTAL
           && TIFFSetField(file->tiff, TIFFTAG_PREDICTOR, PREDICTOR_NONE);
}

static enum status make_buffers(struct tiff_file *file, struct error *err)
{
    enum { STRIP_BYTES = 16 << 20 };
    size_t line = (size_t)TIFFScanlineSize(file->tiff);
    size_t block = (size_t)(file->tiled ? TIFFTileSize(file->tiff) : TIFFStripSize(file->tiff));
    bool gathered = file->tiled || file->planes;
    file->banded = gathered || block <= STRIP_BYTES;
    if (gathered)
        file->band =
            calloc((size_t)file->band_rows * file->base.info.width * 3, sizeof *file->band);
    file->line = malloc(file->banded && block > line ? block : line);
    if (!file->banded) {
        file->base.rows_at_once = 1;
        file->base.any_row = false;
    }
    if (!file->line || (gathered && !file->band))
        return cap_fail(err, STATUS_MEMORY, "%s", file->base.path);
    return STATUS_OK;
}

static float from_half(uint16_t bits)
{
    int exponent = bits >> 10 & 31, fraction = bits & 1023;
    float size = exponent == 31  ? (fraction ? NAN : INFINITY)
                 : exponent == 0 ? ldexpf((float)fraction, -24)
                                 : ldexpf((float)(fraction + 1024), exponent - 25);
    return bits >> 15 ? -size : size;
}

static float scaled(float v)
{
    return v == v ? 65535 * v : INFINITY;
}

/* Count samples of the file's form, every `from_step`th, to every `to_step`th of ours. */
static void unpack(const struct tiff_file *file, const void *from, size_t from_step, float *to,
                   size_t to_step, size_t count)
{
    const uint8_t *narrow = from;
    const uint16_t *wide = from;
    const float *real = from;
    if (file->bytes == 1)
        for (size_t i = 0; i < count; i++)
            to[to_step * i] = narrow[from_step * i];
    else if (file->half)
        for (size_t i = 0; i < count; i++)
            to[to_step * i] = scaled(from_half(wide[from_step * i]));
    else if (file->bytes == 2 && from_step == 1 && to_step == 1)
        for (size_t i = 0; i < count; i++)  // the usual one; the compiler sees that steps are 1
            to[i] = wide[i];
    else if (file->bytes == 2)
        for (size_t i = 0; i < count; i++)
            to[to_step * i] = wide[from_step * i];
    else
        for (size_t i = 0; i < count; i++)
            to[to_step * i] = scaled(real[from_step * i]);
}

/* A row of pixels of three 16-bit samples, from differences modulo 2^16. Four values go together;
 * the fourth is the next pixel's and is overwritten, so that the last pixel goes by itself. */
static void sum_differences(const void *from, float *to, size_t pixels)
{
    typedef uint16_t four __attribute__((vector_size(8)));
    typedef int32_t four_whole __attribute__((vector_size(16)));
    typedef float four_real __attribute__((vector_size(16)));
    const unsigned char *next = from;
    four sum = {0}, step = {0};
    for (size_t i = 0; i + 1 < pixels; i++, next += 6, to += 3) {
        memcpy(&step, next, sizeof step);
        sum += step;
        // By way of 32 bits: the compiler knows no shorter way that is not one by one.
        const four_whole whole = __builtin_convertvector(sum, four_whole);
        const four_real real = __builtin_convertvector(whole, four_real);
        memcpy(to, &real, sizeof real);
    }
    memcpy(&step, next, 6);
    sum += step;
    for (int c = 0; c < 3; c++)
        to[c] = sum[c];
}

/* Pixels that stand together in the file; gray ones stand in all three channels. */
static void unpack_pixels(const struct tiff_file *file, const void *from, float *to, size_t pixels)
{
    size_t step = (size_t)file->samples;
    if (file->differences)
        sum_differences(from, to, pixels);
    else if (step == 3 && !file->base.info.gray)
        unpack(file, from, 1, to, 1, 3 * pixels);
    else
        for (size_t c = 0; c < 3; c++)
            unpack(file, (const char *)from + (file->base.info.gray ? 0 : c * file->bytes), step,
                   to + c, 3, pixels);
}

static bool read_line(struct tiff_file *file, int row, float *dn)
{
    if (TIFFReadScanline(file->tiff, file->line, (uint32_t)row, 0) < 0)
        return false;
    if (dn)
        unpack_pixels(file, file->line, dn, (size_t)file->base.info.width);
    return true;
}

/* Copy a decoded block to the band; left is its first column, plane -1: all samples together. */
static void place_block(struct tiff_file *file, int left, int columns, int rows, int pitch,
                        int plane)
{
    size_t sample = file->bytes * (plane < 0 ? (size_t)file->samples : 1);
    for (int y = 0; y < rows; y++) {
        float *to = file->band + ((size_t)y * file->base.info.width + left) * 3;
        const unsigned char *from = file->line + (size_t)y * pitch * sample;
        if (plane < 0)
            unpack_pixels(file, from, to, (size_t)columns);
        else
            for (int c = plane; c < (file->base.info.gray ? 3 : plane + 1); c++)
                unpack(file, from, 1, to + c, 3, (size_t)columns);
    }
}

static bool read_band_plane(struct tiff_file *file, int top, int plane)
{
    int width = file->base.info.width, left = file->base.info.height - top;
    int rows = left < file->band_rows ? left : file->band_rows;
    uint16_t sample = (uint16_t)(plane < 0 ? 0 : plane);
    if (!file->tiled) {
        uint32_t strip = TIFFComputeStrip(file->tiff, (uint32_t)top, sample);
        if (TIFFReadEncodedStrip(file->tiff, strip, file->line, -1) < 0)
            return false;
        if (plane >= 0)
            place_block(file, 0, width, rows, width, plane);
        return true;
    }
    uint32_t pitch = 0;
    TIFFGetField(file->tiff, TIFFTAG_TILEWIDTH, &pitch);
    for (int x = 0; x < width; x += (int)pitch) {
        uint32_t tile = TIFFComputeTile(file->tiff, (uint32_t)x, (uint32_t)top, 0, sample);
        if (TIFFReadEncodedTile(file->tiff, tile, file->line, -1) < 0)
            return false;
        int columns = width - x < (int)pitch ? width - x : (int)pitch;
        place_block(file, x, columns, rows, (int)pitch, plane);
    }
    return true;
}

static bool read_banded_line(struct tiff_file *file, int row, float *dn)
{
    int top = row - row % file->band_rows;
    int planes = !file->planes ? 0 : file->base.info.gray ? 1 : 3;
    bool ok = true;
    if (file->band_top != top)
        for (int p = file->planes ? 0 : -1; p < planes && ok; p++)
            ok = read_band_plane(file, top, p);
    file->band_top = ok ? top : -1;
    size_t width = (size_t)file->base.info.width, offset = (size_t)(row - top) * width;
    size_t pixel = file->bytes * (size_t)file->samples;
    if (ok && file->band)
        memcpy(dn, file->band + 3 * offset, 3 * width * sizeof *dn);
    else if (ok)
        unpack_pixels(file, file->line + offset * pixel, dn, width);
    return ok;
}

/* Decoders go forward only: from the row they stand at, or from the beginning of a strip. */
static bool skip_lines(struct tiff_file *file, int from, int to)
{
    int strip_top = to - to % file->band_rows;
    bool ok = true;
    if (file->banded || to == file->base.info.height)
        return true;
    for (int row = from > strip_top ? from : strip_top; row < to && ok; row++)
        ok = read_line(file, row, NULL);
    return ok;
}

static enum status read_rows(struct photo_file *base, float *dn, int rows, struct error *err)
{
    struct tiff_file *file = (struct tiff_file *)base;
    size_t line = 3 * (size_t)base->info.width;
    bool ok = true;
    if (!dn)
        ok = skip_lines(file, base->row, base->row + rows);
    for (int y = 0; dn && y < rows && ok; y++)
        ok = file->banded ? read_banded_line(file, base->row + y, dn + y * line)
                          : read_line(file, base->row + y, dn + y * line);
    return ok ? STATUS_OK : fail(file, err, "damaged");
}

static void close_file(struct photo_file *base)
{
    struct tiff_file *file = (struct tiff_file *)base;
    if (file->tiff)
        TIFFClose(file->tiff);
    free(file->line);
    free(file->band);
}

static TIFF *open_quietly(struct tiff_file *file)
{
    TIFFOpenOptions *options = TIFFOpenOptionsAlloc();
    if (!options)
        return NULL;
    TIFFOpenOptionsSetErrorHandlerExtR(options, keep_message, file);
    TIFFOpenOptionsSetWarningHandlerExtR(options, drop_message, NULL);
    // m: read, not mapped; a mapped file would count as memory, strip after strip.
    TIFF *tiff = TIFFOpenExt(file->base.path, "rm", options);
    TIFFOpenOptionsFree(options);
    return tiff;
}

enum status tiff_open(struct photo_file **opened, const char *path, struct error *err)
{
    static const struct photo_format format = {read_rows, close_file};
    struct tiff_file *file = photo_begin(sizeof *file, &format, path, err);
    if (!file)
        return STATUS_MEMORY;
    file->tiff = open_quietly(file);
    enum status status =
        file->tiff ? read_layout(file, err) : fail(file, err, "cannot be opened as a TIFF");
    if (!status) {
        read_exif(file);
        file->differences = takes_differences(file);
        status = make_buffers(file, err);
    }
    return photo_opened(opened, &file->base, status);
}
