/* exif_block.c -- what a camera writes of itself and of a photograph, by libexif. */
#include "exif_block.h"

#include <libexif/exif-data.h>
#include <string.h>

/** An entry of `components` values, with room for them. NULL: out of memory. */
static ExifEntry *add_entry(ExifData *data, ExifIfd ifd, ExifTag tag, ExifFormat format,
                            unsigned components)
{
    ExifMem *memory = exif_mem_new_default();
    ExifEntry *entry = exif_entry_new_mem(memory);
    unsigned size = exif_format_get_size(format) * components;
    void *room = entry ? exif_mem_alloc(memory, size) : NULL;
    if (room) {
        entry->data = room;
        entry->size = size;
        entry->tag = tag;
        entry->format = format;
        entry->components = components;
        exif_content_add_entry(data->ifd[ifd], entry);
    }
    exif_mem_unref(memory);
    if (entry)
        exif_entry_unref(entry);  // the content holds it
    return room ? entry : NULL;
}

static bool add_text(ExifData *data, ExifTag tag, const char *text)
{
    unsigned size = (unsigned)strlen(text) + 1;
    ExifEntry *entry = add_entry(data, EXIF_IFD_0, tag, EXIF_FORMAT_ASCII, size);
    if (entry)
        memcpy(entry->data, text, size);
    return entry;
}

/** A positive number as a camera writes it: 1/n where that is what it is, else in millionths. */
static bool add_ratio(ExifData *data, ExifTag tag, double number)
{
    double inverse = 1 / number;
    bool is_inverse = fabs(inverse - round(inverse)) < 1e-9 * inverse;
    ExifRational ratio = {is_inverse ? 1 : (ExifLong)round(number * 1e6),
                          is_inverse ? (ExifLong)round(inverse) : 1000000};
    ExifEntry *entry = add_entry(data, EXIF_IFD_EXIF, tag, EXIF_FORMAT_RATIONAL, 1);
    if (entry)
        exif_set_rational(entry->data, EXIF_BYTE_ORDER_INTEL, ratio);
    return entry;
}

static bool add_short(ExifData *data, ExifTag tag, int number)
{
    ExifEntry *entry = add_entry(data, EXIF_IFD_EXIF, tag, EXIF_FORMAT_SHORT, 1);
    if (entry)
        exif_set_short(entry->data, EXIF_BYTE_ORDER_INTEL, (ExifShort)number);
    return entry;
}

bool sam_exif_block(const struct exif *exif, double seconds, unsigned char **bytes, unsigned *size)
{
    ExifData *data = exif_data_new();
    if (!data)
        return false;
    exif_data_set_byte_order(data, EXIF_BYTE_ORDER_INTEL);
    bool done = add_text(data, EXIF_TAG_MAKE, exif->make)
                && add_text(data, EXIF_TAG_MODEL, exif->model)
                && add_ratio(data, EXIF_TAG_EXPOSURE_TIME, seconds)
                && add_ratio(data, EXIF_TAG_FNUMBER, exif->aperture)
                && add_short(data, EXIF_TAG_ISO_SPEED_RATINGS, (int)exif->iso)
                && add_ratio(data, EXIF_TAG_FOCAL_LENGTH, exif->focal_length);
    *bytes = NULL;
    if (done)
        exif_data_save_data(data, bytes, size);
    exif_data_unref(data);
    return *bytes;
}
