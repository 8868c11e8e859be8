/* ciff_read.c -- exposure time and aperture of Canon's CRW files, as they were.
 *
 * LibRaw gives what the camera aimed at. The record ShotInfo (0x102A) holds beside it what it did,
 * in 1/32 stops, up to a quarter of a stop away. CIFF is a tree of heaps: the last four bytes of a
 * heap point to its directory, an entry of which is {type, size, place} (P. Harvey's description of
 * the format, exiftool.org/canon_raw.html).
 */
#include "photo.h"

#include <stdlib.h>
#include <string.h>

enum { SHOT_INFO = 0x102A, SHOT_INFO_APERTURE = 21, SHOT_INFO_TIME = 22, DEPTH_MAX = 8 };

static uint32_t number(const unsigned char *at, int bytes)
{
    uint32_t value = 0;
    for (int i = bytes; i-- > 0;)
        value = value << 8 | at[i];
    return value;
}

/* Canon's stops: 32 to one, but 12 and 20 stand for thirds. */
static double stops(int value)
{
    int size = abs(value), fraction = size & 0x1F;
    double part = fraction == 0x0C ? 32 / 3.0 : fraction == 0x14 ? 64 / 3.0 : fraction;
    return (value < 0 ? -1 : 1) * (size - fraction + part) / 32;
}

static void take_shot_info(struct photo *info, const unsigned char *record, size_t size)
{
    if (size < 2 * (SHOT_INFO_TIME + 1))
        return;
    int aperture = (int16_t)number(record + 2 * SHOT_INFO_APERTURE, 2);
    int time = (int16_t)number(record + 2 * SHOT_INFO_TIME, 2);
    if (aperture != 0)
        info->aperture = exp2(stops(aperture) / 2);
    if (time != 0)
        info->exposure_time = exp2(-stops(time));
}

static void walk(struct photo *info, const unsigned char *heap, size_t size, int depth)
{
    size_t at = size >= 4 ? number(heap + size - 4, 4) : size;
    if (depth == DEPTH_MAX || at + 2 > size)
        return;
    size_t entries = number(heap + at, 2);
    for (size_t k = 0; k < entries && at + 2 + 10 * (k + 1) <= size; k++) {
        const unsigned char *entry = heap + at + 2 + 10 * k;
        unsigned type = number(entry, 2);
        size_t length = number(entry + 2, 4), place = number(entry + 6, 4);
        if ((type & 0x4000) || place > size || length > size - place)
            continue;  // its bytes stand in the entry itself, or nowhere
        if ((type & 0x3800) == 0x2800 || (type & 0x3800) == 0x3000)
            walk(info, heap + place, length, depth + 1);
        else if (type == SHOT_INFO)
            take_shot_info(info, heap + place, length);
    }
}

void ciff_take(struct photo *info, const char *path)
{
    enum { BYTES_MAX = 1 << 26, HEADER = 14 };
    FILE *file = fopen(path, "rb");
    unsigned char *bytes = NULL;
    size_t size = 0;
    if (file && fseek(file, 0, SEEK_END) == 0) {
        long end = ftell(file);
        if (end > HEADER && end < BYTES_MAX && (bytes = malloc((size_t)end))) {
            rewind(file);
            size = fread(bytes, 1, (size_t)end, file);
        }
    }
    if (size > HEADER && memcmp(bytes, "II", 2) == 0 && memcmp(bytes + 6, "HEAPCCDR", 8) == 0) {
        size_t start = number(bytes + 2, 4);
        if (start < size)
            walk(info, bytes + start, size - start, 0);
    }
    free(bytes);
    if (file)
        fclose(file);
}
