/* tiff_write.c -- 16-bit RGB TIFF, and DNG, which is a TIFF with a mosaic; both with EXIF, by
 * libtiff. */
#include "tiff_write.h"

#include <errno.h>
#include <stdarg.h>
#include <string.h>
#include <tiffio.h>

enum { STRIP_BYTES = 1 << 18 };  // what a reader unpacks at a time

/** libtiff's last message, for this call: it tells of a full disk only there. */
struct message {
    char text[200];
};

static int keep_message(TIFF *tiff, void *user, const char *module, const char *format,
                        va_list args)
{
    (void)tiff;
    (void)module;
    struct message *message = user;
    vsnprintf(message->text, sizeof message->text, format, args);
    return 1;  // said; libtiff shall not print it
}

/** A photograph under way. */
struct picture {
    uint16_t *dn;  // [height][width][channels]
    int width, height, channels;
    const struct exif *exif;
    double seconds;
    const struct sensor_model *mosaic;  // NULL: RGB
};

static bool set_common_tags(TIFF *tiff, const struct picture *p, uint32_t rows)
{
    return TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, p->width)
           && TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, p->height)
           && TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 16)
           && TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, p->channels)
           && TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG)
           && TIFFSetField(tiff, TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT)
           && TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, rows)
           && TIFFSetField(tiff, TIFFTAG_MAKE, p->exif->make)
           && TIFFSetField(tiff, TIFFTAG_MODEL, p->exif->model)
           && TIFFSetField(tiff, TIFFTAG_SOFTWARE, "goniocam render");
}

static bool set_rgb_tags(TIFF *tiff, const struct picture *p)
{
    uint32_t rows = (uint32_t)(STRIP_BYTES / (6 * p->width));
    return set_common_tags(tiff, p, rows ? rows : 1)
           && TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_RGB)
           && TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE)
           && TIFFSetField(tiff, TIFFTAG_PREDICTOR, PREDICTOR_HORIZONTAL);
}

/** Raw readers want one uncompressed strip, and numbers from which to make colours for a screen:
 *  the camera's primaries are sRGB's (IEC 61966-2-1, XYZ to linear RGB), its white is even. */
static bool set_mosaic_tags(TIFF *tiff, const struct picture *p)
{
    static const float xyz_to_rgb[9] = {3.2404542f,  -1.5371385f, -0.4985314f,
                                        -0.9692660f, 1.8760108f,  0.0415560f,
                                        0.0556434f,  -0.2040259f, 1.0572252f};
    static const uint16_t one[2] = {1, 1}, d65 = 21;
    const struct sensor_model *sensor = p->mosaic;
    const int side = cap_cfa_side(sensor->cfa);
    const uint16_t cell[2] = {(uint16_t)side, (uint16_t)side};
    uint8_t cfa[CFA_SIZE];
    float black = (float)sensor->black_level, neutral[3];
    uint32_t white = (uint32_t)sensor->adc_max;
    for (int i = 0; i < side * side; i++)
        cfa[i] = (uint8_t)cap_cfa_channel(sensor->cfa, i % side, i / side);
    for (int c = 0; c < 3; c++)
        neutral[c] = (float)(sensor->channel_gain[c] / sensor->channel_gain[1]);
    return set_common_tags(tiff, p, (uint32_t)p->height)
           && TIFFSetField(tiff, TIFFTAG_SUBFILETYPE, 0)
           && TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_CFA)
           && TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE)
           && TIFFSetField(tiff, TIFFTAG_CFAREPEATPATTERNDIM, cell)
           && TIFFSetField(tiff, TIFFTAG_CFAPATTERN, side * side, cfa)
           && TIFFSetField(tiff, TIFFTAG_DNGVERSION, "\001\004\000\000")
           && TIFFSetField(tiff, TIFFTAG_DNGBACKWARDVERSION, "\001\001\000\000")
           && TIFFSetField(tiff, TIFFTAG_UNIQUECAMERAMODEL, p->exif->model)
           && TIFFSetField(tiff, TIFFTAG_COLORMATRIX1, 9, xyz_to_rgb)
           && TIFFSetField(tiff, TIFFTAG_ASSHOTNEUTRAL, 3, neutral)
           && TIFFSetField(tiff, TIFFTAG_CALIBRATIONILLUMINANT1, d65)
           && TIFFSetField(tiff, TIFFTAG_BLACKLEVELREPEATDIM, one)
           && TIFFSetField(tiff, TIFFTAG_BLACKLEVEL, 1, &black)
           && TIFFSetField(tiff, TIFFTAG_WHITELEVEL, 1, &white);
}

/** A first directory that leaves room for the place of the second, the second with the EXIF tags,
 *  and the first again with that place: as libtiff wants it. */
static bool write_exif(TIFF *tiff, const struct exif *exif, double seconds)
{
    uint16_t iso = (uint16_t)exif->iso;
    uint64_t place = 0;
    return TIFFWriteDirectory(tiff) && TIFFCreateEXIFDirectory(tiff) == 0
           && TIFFSetField(tiff, EXIFTAG_EXPOSURETIME, seconds)
           && TIFFSetField(tiff, EXIFTAG_FNUMBER, exif->aperture)
           && TIFFSetField(tiff, EXIFTAG_ISOSPEEDRATINGS, 1, &iso)
           && TIFFSetField(tiff, EXIFTAG_FOCALLENGTH, exif->focal_length)
           && TIFFWriteCustomDirectory(tiff, &place) && TIFFSetDirectory(tiff, 0)
           && TIFFSetField(tiff, TIFFTAG_EXIFIFD, place) && TIFFRewriteDirectory(tiff);
}

static bool write_strips(TIFF *tiff, const struct picture *p)
{
    uint32_t rows = 1, height = (uint32_t)p->height;
    size_t row = (size_t)p->width * (size_t)p->channels;
    TIFFGetField(tiff, TIFFTAG_ROWSPERSTRIP, &rows);
    for (uint32_t y = 0, strip = 0; y < height; y += rows, strip++) {
        uint32_t count = height - y < rows ? height - y : rows;
        if (TIFFWriteEncodedStrip(tiff, strip, &p->dn[y * row], (tmsize_t)(count * row * 2)) < 0)
            return false;
    }
    return true;
}

static bool write_all(const char *aside, const struct picture *p, struct message *message)
{
    TIFFOpenOptions *options = TIFFOpenOptionsAlloc();
    if (!options)
        return false;
    TIFFOpenOptionsSetErrorHandlerExtR(options, keep_message, message);
    TIFF *tiff = TIFFOpenExt(aside, "w", options);
    TIFFOpenOptionsFree(options);
    if (!tiff)
        return false;
    bool done = (p->mosaic ? set_mosaic_tags(tiff, p) : set_rgb_tags(tiff, p))
                && write_strips(tiff, p) && write_exif(tiff, p->exif, p->seconds);
    TIFFClose(tiff);
    return done;
}

static enum status write_picture(const char *path, const struct picture *p, struct error *err)
{
    struct atomic_file file;
    struct message message = {""};
    enum status status = cap_file_begin(&file, path, false, err);
    if (status)
        return status;
    errno = 0;
    if (write_all(file.aside, p, &message) && !message.text[0])
        return cap_file_commit(&file, err);
    const char *reason = errno ? strerror(errno) : "cannot be written";
    if (message.text[0])
        status = cap_fail(err, STATUS_IO, "%s: %s (%s)", path, message.text, reason);
    else
        status = cap_fail(err, STATUS_IO, "%s: %s", path, reason);
    cap_file_abandon(&file);
    return status;
}

enum status sam_tiff_write(const char *path, uint16_t *dn, int width, int height,
                           const struct exif *exif, double seconds, struct error *err)
{
    struct picture p = {dn, width, height, 3, exif, seconds, NULL};
    return write_picture(path, &p, err);
}

enum status sam_dng_write(const char *path, uint16_t *dn, int width, int height,
                          const struct exif *exif, double seconds,
                          const struct sensor_model *sensor, struct error *err)
{
    struct picture p = {dn, width, height, 1, exif, seconds, sensor};
    return write_picture(path, &p, err);
}
