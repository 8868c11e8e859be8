/* frames.c -- what dark, flat and ambient frames tell of each photosite. */
#include "frames.h"

#include <string.h>

enum status frames_make(struct frames *frames, const struct capture *capture,
                        const struct learned *learned, int camera, struct error *err)
{
    struct frames made = {0};
    if (!capture->flat) {
        *frames = made;
        return STATUS_OK;
    }
    enum status status =
        flat_fit(&made.flat, capture, &learned->sensor, &learned->curve, camera, made.cfa, err);
    made.has_flat = !status;
    if (!status)
        *frames = made;
    return status;
}

void frames_free(struct frames *frames)
{
    flat_free(&frames->flat);
    *frames = (struct frames){0};
}

size_t frames_room(int count)
{
    return 4 * (size_t)count * sizeof(float);
}

void frames_row(const struct frames *frames, struct merge_row *row, int y, float *room)
{
    float *scale = room, *flat = room + row->count;  // of a mosaic, three channels a photosite
    if (!frames->has_flat)
        return;
    flat_row(&frames->flat, y, flat);
    for (int x = 0; *frames->cfa && x < row->count; x++) {
        char letter = frames->cfa[2 * (y % 2) + x % 2];
        flat[x] = flat[3 * x + (letter == 'R' ? 0 : letter == 'G' ? 1 : 2)];
    }
    row->scale = scale;
    merge_row_scale(row, flat);
}
