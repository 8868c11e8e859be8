/* tiff_write.c -- 16-bit RGB TIFF with EXIF, by libtiff. */
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

static bool set_image_tags(TIFF *tiff, int width, int height, const struct exif *exif)
{
    uint32_t rows = (uint32_t)(STRIP_BYTES / (6 * width));
    return TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, width)
           && TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, height)
           && TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 16)
           && TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 3)
           && TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_RGB)
           && TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG)
           && TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE)
           && TIFFSetField(tiff, TIFFTAG_PREDICTOR, PREDICTOR_HORIZONTAL)
           && TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, rows ? rows : 1)
           && TIFFSetField(tiff, TIFFTAG_MAKE, exif->make)
           && TIFFSetField(tiff, TIFFTAG_MODEL, exif->model)
           && TIFFSetField(tiff, TIFFTAG_SOFTWARE, "goniocam render");
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

static bool write_strips(TIFF *tiff, uint16_t *dn, int width, int height)
{
    uint32_t rows = 1;
    TIFFGetField(tiff, TIFFTAG_ROWSPERSTRIP, &rows);
    for (uint32_t y = 0, strip = 0; y < (uint32_t)height; y += rows, strip++) {
        uint32_t count = (uint32_t)height - y < rows ? (uint32_t)height - y : rows;
        tmsize_t bytes = (tmsize_t)count * width * 6;
        uint16_t *first = &dn[(size_t)y * (size_t)width * 3];
        if (TIFFWriteEncodedStrip(tiff, strip, first, bytes) < 0)
            return false;
    }
    return true;
}

static bool write_all(const char *aside, uint16_t *dn, int width, int height,
                      const struct exif *exif, double seconds, struct message *message)
{
    TIFFOpenOptions *options = TIFFOpenOptionsAlloc();
    if (!options)
        return false;
    TIFFOpenOptionsSetErrorHandlerExtR(options, keep_message, message);
    TIFF *tiff = TIFFOpenExt(aside, "w", options);
    TIFFOpenOptionsFree(options);
    if (!tiff)
        return false;
    bool done = set_image_tags(tiff, width, height, exif) && write_strips(tiff, dn, width, height)
                && write_exif(tiff, exif, seconds);
    TIFFClose(tiff);
    return done;
}

enum status sam_tiff_write(const char *path, uint16_t *dn, int width, int height,
                           const struct exif *exif, double seconds, struct error *err)
{
    struct atomic_file file;
    struct message message = {""};
    enum status status = cap_file_begin(&file, path, false, err);
    if (status)
        return status;
    errno = 0;
    if (write_all(file.aside, dn, width, height, exif, seconds, &message) && !message.text[0])
        return cap_file_commit(&file, err);
    status = cap_fail(err, STATUS_IO, "%s: %s", path,
                      message.text[0] ? message.text
                      : errno         ? strerror(errno)
                                      : "cannot be written");
    cap_file_abandon(&file);
    return status;
}
