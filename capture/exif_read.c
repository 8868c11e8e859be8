/* exif_read.c -- EXIF blocks of JPEG and PNG files, through libexif. */
#include "photo.h"

#include <libexif/exif-data.h>
#include <stdlib.h>
#include <string.h>

static double rational_tag(ExifData *exif, ExifTag tag)
{
    ExifEntry *entry = exif_content_get_entry(exif->ifd[EXIF_IFD_EXIF], tag);
    if (!entry || entry->format != EXIF_FORMAT_RATIONAL || entry->size < 8)
        return 0;
    ExifRational r = exif_get_rational(entry->data, exif_data_get_byte_order(exif));
    return r.denominator ? (double)r.numerator / r.denominator : 0;
}

static int short_tag(ExifData *exif, ExifIfd ifd, ExifTag tag)
{
    ExifEntry *entry = exif_content_get_entry(exif->ifd[ifd], tag);
    if (!entry || entry->format != EXIF_FORMAT_SHORT || entry->size < 2)
        return 0;
    return exif_get_short(entry->data, exif_data_get_byte_order(exif));
}

static void text_tag(ExifData *exif, ExifIfd ifd, ExifTag tag, char *to, size_t size)
{
    ExifEntry *entry = exif_content_get_entry(exif->ifd[ifd], tag);
    if (!entry || entry->format != EXIF_FORMAT_ASCII || !entry->data)
        return;
    snprintf(to, size, "%.*s", (int)entry->size, (const char *)entry->data);
    for (size_t end = strlen(to); end > 0 && to[end - 1] == ' '; end--)
        to[end - 1] = '\0';  // some cameras pad
}

static void take_tags(struct photo *info, ExifData *exif)
{
    enum { LENS_MODEL = 0xA434 };  // EXIF 2.3; libexif 0.6.24 has no name for it
    info->iso = short_tag(exif, EXIF_IFD_EXIF, EXIF_TAG_ISO_SPEED_RATINGS);
    info->orientation = short_tag(exif, EXIF_IFD_0, EXIF_TAG_ORIENTATION);
    info->exposure_time = rational_tag(exif, EXIF_TAG_EXPOSURE_TIME);
    info->aperture = rational_tag(exif, EXIF_TAG_FNUMBER);
    info->focal_length = rational_tag(exif, EXIF_TAG_FOCAL_LENGTH);
    text_tag(exif, EXIF_IFD_0, EXIF_TAG_MAKE, info->make, sizeof info->make);
    text_tag(exif, EXIF_IFD_0, EXIF_TAG_MODEL, info->model, sizeof info->model);
    text_tag(exif, EXIF_IFD_EXIF, (ExifTag)LENS_MODEL, info->lens, sizeof info->lens);
    text_tag(exif, EXIF_IFD_EXIF, EXIF_TAG_DATE_TIME_ORIGINAL, info->taken, sizeof info->taken);
}

void exif_take(struct photo *info, const unsigned char *block, size_t size)
{
    static const unsigned char begin[6] = "Exif\0";
    unsigned char *whole = malloc(sizeof begin + size);
    if (!whole || size > UINT16_MAX * 64u) {
        free(whole);
        return;
    }
    memcpy(whole, begin, sizeof begin);
    memcpy(whole + sizeof begin, block, size);
    ExifData *exif = exif_data_new_from_data(whole, (unsigned)(sizeof begin + size));
    if (exif) {
        take_tags(info, exif);
        exif_data_unref(exif);
    }
    free(whole);
}
