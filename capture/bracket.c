/* bracket.c -- the frames of one shot, read side by side in bands of rows. */
#include "bracket.h"

#include <assert.h>
#include <stdlib.h>

void response_table(uint16_t dn[256], enum response response)
{
    for (int code = 0; code < 256; code++) {
        double v = code / 255.0;
        double linear = response == RESPONSE_LINEAR ? v
                        : v <= 0.04045              ? v / 12.92
                                                    : pow((v + 0.055) / 1.055, 2.4);
        dn[code] = (uint16_t)lrint(65535 * linear);
    }
}

/* The frames' photographs, shortest first; of equal times, in the order of the names. */
static void sort_frames(struct bracket *bracket)
{
    for (int i = 1; i < bracket->frames; i++)
        for (int k = i; k > 0 && bracket->time[k] < bracket->time[k - 1]; k--) {
            double time = bracket->time[k];
            int photo = bracket->photo[k];
            bracket->time[k] = bracket->time[k - 1];
            bracket->photo[k] = bracket->photo[k - 1];
            bracket->time[k - 1] = time;
            bracket->photo[k - 1] = photo;
        }
}

static enum status open_frame(struct bracket *bracket, const struct capture *capture, int frame,
                              struct error *err)
{
    const struct photo *photo = &capture->photo[bracket->photo[frame]];
    size_t count = 3 * (size_t)bracket->rows * (size_t)bracket->width;
    bracket->dn[frame] = malloc(count * sizeof *bracket->dn[frame]);
    char *path = cap_path(capture->folder, photo->name);
    enum status status = STATUS_OK;
    if (!path || !bracket->dn[frame])
        status = cap_fail(err, STATUS_MEMORY, "%s", photo->name);
    else
        status = photo_open(&bracket->file[frame], path, err);
    if (!status) {
        const struct photo *info = &bracket->file[frame]->info;
        if (info->width != photo->width || info->height != photo->height
            || info->bits != photo->bits)
            status = cap_fail(err, STATUS_FORMAT, "%s: changed while it was in use", path);
    }
    free(path);
    return status;
}

enum status bracket_open(struct bracket *bracket, const struct capture *capture,
                         const struct shot *shot, const bool *skip, int rows, int *bad,
                         struct error *err)
{
    const struct photo *first = &capture->photo[shot->photo[0]];
    struct bracket made = {
        .width = first->width, .height = first->height, .rows = rows, .encoded = first->encoded};
    enum status status = STATUS_OK;
    if (bad)
        *bad = -1;
    if (shot->photos > BRACKET_FRAMES_MAX)
        return cap_fail(err, STATUS_DATA, "shot %s: more than %d photographs", shot->name,
                        BRACKET_FRAMES_MAX);
    for (int k = 0; k < shot->photos; k++) {
        if (skip && skip[shot->photo[k]])
            continue;
        made.photo[made.frames] = shot->photo[k];
        made.time[made.frames++] = capture->photo[shot->photo[k]].exposure_time;
    }
    sort_frames(&made);
    response_table(made.table, capture->response);
    for (int f = 0; f < made.frames && !status; f++) {
        status = open_frame(&made, capture, f, err);
        if (status && status != STATUS_MEMORY && bad)
            *bad = made.photo[f];
    }
    if (status)
        bracket_close(&made);
    else
        *bracket = made;
    return status;
}

enum status bracket_read(struct bracket *bracket, int rows, int *bad, struct error *err)
{
    assert(rows <= bracket->rows);
    size_t count = 3 * (size_t)rows * (size_t)bracket->width;
    for (int f = 0; f < bracket->frames; f++) {
        uint16_t *dn = bracket->dn[f];
        enum status status = photo_read(bracket->file[f], dn, rows, err);
        if (status) {
            if (bad)
                *bad = bracket->photo[f];
            return status;
        }
        if (bracket->encoded)
            for (size_t i = 0; i < count; i++)
                dn[i] = bracket->table[dn[i]];
    }
    return STATUS_OK;
}

enum status bracket_skip(struct bracket *bracket, int rows, int *bad, struct error *err)
{
    for (int f = 0; f < bracket->frames; f++) {
        enum status status = photo_skip(bracket->file[f], rows, err);
        if (status) {
            if (bad)
                *bad = bracket->photo[f];
            return status;
        }
    }
    return STATUS_OK;
}

void bracket_close(struct bracket *bracket)
{
    for (int f = 0; f < bracket->frames; f++) {
        photo_close(bracket->file[f]);
        free(bracket->dn[f]);
    }
    *bracket = (struct bracket){0};
}
