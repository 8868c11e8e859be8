/* bracket.c -- the frames of one shot, read side by side in bands of rows. */
#include "bracket.h"

#include <assert.h>
#include <stdlib.h>

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
    char *path = cap_path(capture->folder, photo->name);
    enum status status = path ? photo_open(&bracket->file[frame], path, err)
                              : cap_fail(err, STATUS_MEMORY, "%s", photo->name);
    if (!status) {
        const struct photo *info = &bracket->file[frame]->info;
        if (info->width != photo->width || info->height != photo->height
            || info->bits != photo->bits || info->channels != photo->channels)
            status = cap_fail(err, STATUS_FORMAT, "%s: changed while it was in use", path);
    }
    free(path);
    return status;
}

/* The band fits whole strips or tiles, so that none is decoded twice. */
static enum status make_band(struct bracket *bracket, int rows, struct error *err)
{
    enum { ROWS_MIN = 8, ROWS_MAX = 512 };
    bracket->any_row = true;
    bracket->rows_at_once = 1;
    for (int f = 0; f < bracket->frames; f++) {
        bracket->any_row = bracket->any_row && bracket->file[f]->any_row;
        bracket->at_once = bracket->at_once || bracket->file[f]->at_once;
        if (bracket->file[f]->rows_at_once > bracket->rows_at_once)
            bracket->rows_at_once = bracket->file[f]->rows_at_once;
    }
    if (rows == 0) {
        int each = bracket->rows_at_once < ROWS_MAX ? bracket->rows_at_once : ROWS_MAX;
        rows = (ROWS_MIN + each - 1) / each * each;
    }
    bracket->rows = rows;
    size_t count = (size_t)bracket->channels * (size_t)rows * (size_t)bracket->width;
    for (int f = 0; f < bracket->frames; f++)
        if (!(bracket->dn[f] = malloc(count * sizeof *bracket->dn[f])))
            return cap_fail(err, STATUS_MEMORY, "%d rows of a photograph", rows);
    return STATUS_OK;
}

enum status bracket_open(struct bracket *bracket, const struct bracket_choice *choice, int rows,
                         int *bad, struct error *err)
{
    const struct capture *capture = choice->capture;
    const struct shot *shot = choice->shot;
    const struct photo *first = &capture->photo[shot->photo[0]];
    struct bracket made = {.width = first->width,
                           .height = first->height,
                           .channels = first->channels,
                           .threads = 1,
                           .response = first->encoded ? choice->response : NULL};
    enum status status = STATUS_OK;
    if (bad)
        *bad = -1;
    if (shot->photos > BRACKET_FRAMES_MAX)
        return cap_fail(err, STATUS_DATA, "shot %s: more than %d photographs", shot->name,
                        BRACKET_FRAMES_MAX);
    for (int k = 0; k < shot->photos; k++) {
        int photo = shot->photo[k];
        if (choice->skip && choice->skip[photo])
            continue;
        made.photo[made.frames] = photo;
        made.time[made.frames++] =
            choice->seconds ? choice->seconds[photo] : capture->photo[photo].exposure_time;
    }
    sort_frames(&made);
    for (int f = 0; f < made.frames && !status; f++) {
        status = open_frame(&made, capture, f, err);
        if (status && status != STATUS_MEMORY && bad)
            *bad = made.photo[f];
    }
    if (!status)
        status = make_band(&made, rows, err);
    if (status)
        bracket_close(&made);
    else
        *bracket = made;
    return status;
}

/* Codes become linear. */
static void decode(float *dn, size_t pixels, const struct curve *response)
{
    for (size_t i = 0; i < pixels; i++)
        for (size_t c = 0; c < 3; c++)
            dn[3 * i + c] = response->dn[c][(unsigned char)dn[3 * i + c]];
}

enum status bracket_read(struct bracket *bracket, int rows, int *bad, struct error *err)
{
    assert(rows <= bracket->rows);
    enum status status = STATUS_OK;
#pragma omp parallel for schedule(dynamic) num_threads(bracket->threads)
    for (int f = 0; f < bracket->frames; f++) {
        struct error mine = {0};
        enum status one = photo_read(bracket->file[f], bracket->dn[f], rows, &mine);
        if (!one && bracket->response)
            decode(bracket->dn[f], (size_t)rows * (size_t)bracket->width, bracket->response);
        if (!one)
            continue;
#pragma omp critical(bracket_read_failed)
        {
            status = one;
            if (err)
                *err = mine;
            if (bad)
                *bad = bracket->photo[f];
        }
    }
    return status;
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

enum status bracket_seek(struct bracket *bracket, int row, int *bad, struct error *err)
{
    if (bracket->frames == 0 || bracket->file[0]->row == row)
        return STATUS_OK;
    if (row > bracket->file[0]->row)
        return bracket_skip(bracket, row - bracket->file[0]->row, bad, err);
    assert(bracket->any_row);
    for (int f = 0; f < bracket->frames; f++)
        bracket->file[f]->row = row;
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
