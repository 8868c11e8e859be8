/* merge_shot.c -- one shot, from its photographs to its map, in bands of rows.
 *
 * Files whose strips can be decoded in any order are opened once a thread, and bands go round the
 * threads, which write them to their places. Others, and those that are decoded all at once, are
 * decoded frame beside frame, and the rows of the band are merged beside each other then. One
 * thread goes row by row: what it has unpacked is still in the nearest cache when it is merged.
 * Memory is that of some bands, whatever the size of the image; the result does not depend on the
 * number of threads.
 */
#include "merge_shot.h"
#include "blocks.h"
#include "bracket.h"

#include <omp.h>
#include <stdlib.h>

/* What encoded photographs need besides: blocks.h, coding.h. */
struct encoded {
    float *chi2, *freedom;                     // [rows][count]
    struct coding coding[BRACKET_FRAMES_MAX];  // of the frames
    struct code_steps steps;
};

/* What a thread needs for a band. */
struct worker {
    struct bracket bracket;
    struct merge_row row[CFA_SIDE_MAX];  // [sides] of the rows of a mosaic's cell, which differ
    int sides;
    float *value, *variance;              // [rows][count]
    float *room;                          // [rows][frames_room()]
    struct encoded *encoded;              // of encoded photographs; else NULL
    const struct ambient_light *ambient;  // NULL: none; borrowed
};

/* Variance of the sensor's noise in codes, where each code stands. */
static void noise_in_codes(struct code_noise *noise, const struct learned *learned)
{
    for (int code = 0; code < 256; code++)
        for (int c = 0; c < 3; c++) {
            const struct sensor *sensor = &learned->sensor;
            const float *dn = learned->curve.dn[c];
            int low = code > 0 ? code - 1 : 0, high = code < 255 ? code + 1 : 255;
            double step = (double)(dn[high] - dn[low]) / (high - low);
            double variance =
                sensor->read_noise[c] * sensor->read_noise[c] + (double)dn[code] / sensor->gain[c];
            noise->variance[code][c] = variance / fmax(step * step, 1e-6);
        }
}

/* What the frames' codes are worth; a broken file shows when its rows are read. */
static enum status read_codings(struct encoded *e, const struct bracket *bracket,
                                const struct job *job, const struct learned *learned,
                                struct error *err)
{
    struct code_noise noise;
    enum status status = STATUS_OK;
    noise_in_codes(&noise, learned);
#pragma omp parallel for schedule(dynamic) num_threads(job->threads)
    for (int f = 0; f < bracket->frames; f++) {
        struct error own = {0};
        enum status one = coding_read(&e->coding[f], bracket->file[f]->path, &noise, &own);
        if (one == STATUS_MEMORY) {
#pragma omp critical(merge_shot_coding)
            status = cap_fail(err, one, "%s", own.text);
        }
    }
    return status;
}

static enum status encoded_open(struct worker *w, const struct job *job,
                                const struct learned *learned, size_t values, struct error *err)
{
    struct encoded *e = w->encoded = calloc(1, sizeof *e);
    if (!e)
        return cap_fail(err, STATUS_MEMORY, "a band of rows");
    e->chi2 = malloc(values * sizeof *e->chi2);
    e->freedom = malloc(values * sizeof *e->freedom);
    if (!e->chi2 || !e->freedom)
        return cap_fail(err, STATUS_MEMORY, "a band of rows");
    blocks_steps(&e->steps, &learned->curve);
    return read_codings(e, &w->bracket, job, learned, err);
}

static void encoded_close(struct encoded *e)
{
    if (!e)
        return;
    for (int f = 0; f < BRACKET_FRAMES_MAX; f++)
        coding_free(&e->coding[f]);
    free(e->chi2);
    free(e->freedom);
    free(e);
}

static enum status worker_open(struct worker *w, const struct job *job, const struct shot *shot,
                               const struct exr_header *header, int *bad, struct error *err)
{
    const struct learned *learned = &job->learned[shot->camera];
    const struct photo *photo = &job->capture->photo[shot->photo[0]];
    struct bracket_choice choice = {job->capture, shot, job->left_out, job->seconds,
                                    learned->encoded ? &learned->curve : NULL};
    *w =
        (struct worker){.ambient = ambients_light(job->ambients, (int)(shot - job->capture->shot))};
    enum status status = bracket_open(&w->bracket, &choice, 0, bad, err);
    w->sides = *photo->cfa ? cap_cfa_side(photo->cfa) : 1;
    for (int k = 0; k < w->sides && !status; k++)
        status = merge_row_make(&w->row[k], &learned->sensor, header->width, photo->cfa, k, err);
    if (status)
        return status;
    size_t rows = (size_t)w->bracket.rows, values = rows * (size_t)w->row[0].count;
    w->value = malloc(values * sizeof *w->value);
    w->variance = malloc(values * sizeof *w->variance);
    w->room = malloc(rows * frames_room(w->row[0].count) * sizeof *w->room);
    if (!w->value || !w->variance || !w->room)
        return cap_fail(err, STATUS_MEMORY, "%s: a band of rows", shot->name);
    return learned->encoded ? encoded_open(w, job, learned, values, err) : STATUS_OK;
}

static void worker_close(struct worker *w)
{
    bracket_close(&w->bracket);
    for (int k = 0; k < w->sides; k++)
        merge_row_free(&w->row[k]);
    free(w->value);
    free(w->variance);
    free(w->room);
    encoded_close(w->encoded);
}

/* The errors of the frames of row y, the k-th of what was read. */
static void compare_frames(const struct worker *w, const struct merge_row *row,
                           const float *const *dn, int y, int k)
{
    struct encoded *e = w->encoded;
    const size_t at = (size_t)k * (size_t)row->count;
    const float *kept[BRACKET_FRAMES_MAX] = {NULL}, *lost[BRACKET_FRAMES_MAX] = {NULL};
    for (int f = 0; f < w->bracket.frames; f++) {
        const struct coding *coding = &e->coding[f];
        size_t first = 3 * (size_t)(y / BLOCK_SIDE) * (size_t)coding->across;
        if (coding->kept) {
            kept[f] = coding->kept + first;
            lost[f] = coding->lost + first;
        }
    }
    const struct encoded_row encoded = {row,  dn,        w->bracket.time,  kept,
                                        lost, &e->steps, w->bracket.frames};
    blocks_disagreement(e->chi2 + at, e->freedom + at, w->variance + at, w->value + at, &encoded);
}

/* Row y of the image, the k-th of what was read. */
static void merge_line(const struct worker *w, const struct frames *frames, int y, int k)
{
    struct merge_row row = w->row[y % w->sides];
    size_t count = (size_t)row.count, at = (size_t)k * count;
    const float *dn[BRACKET_FRAMES_MAX];
    for (int f = 0; f < w->bracket.frames; f++)
        dn[f] = w->bracket.dn[f] + at;
    frames_row(frames, &row, y, w->room + (size_t)k * frames_room(row.count));
    merge_row(w->value + at, w->variance + at, &row, dn, w->bracket.time, w->bracket.frames);
    if (w->encoded)
        compare_frames(w, &row, dn, y, k);
    if (w->ambient)
        ambient_take(w->ambient, &row, y, w->value + at, w->variance + at);
    frames_finish(frames, &row, y, w->variance + at);
}

/* The k-th row of what was merged is row y of the map. */
static enum status put_line(struct exr_writer *writer, const struct worker *w, int y, int k,
                            struct error *err)
{
    size_t at = (size_t)k * (size_t)w->row[0].count;
    return exr_put(writer, y, w->value + at, w->variance + at, err);
}

static enum status put_lines(struct exr_writer *writer, const struct worker *w, int top, int rows,
                             int threads, struct error *err)
{
    enum status status = STATUS_OK;
#pragma omp parallel for schedule(static) num_threads(threads)
    for (int k = 0; k < rows; k++) {
        struct error own = {0};
        enum status one = put_line(writer, w, top + k, k, &own);
        if (one) {
#pragma omp critical(merge_shot_put)
            status = cap_fail(err, one, "%s", own.text);
        }
    }
    return status;
}

/* Blocks of encoded photographs need the whole band. */
static bool by_rows(const struct worker *w, int threads)
{
    return threads == 1 && !w->encoded;
}

/* Row by row, by one thread. */
static enum status merge_rows(struct worker *w, struct exr_writer *writer,
                              const struct frames *frames, int top, int rows, int *bad,
                              struct error *err)
{
    enum status status = STATUS_OK;
    for (int k = 0; k < rows && !status; k++) {
        status = bracket_read(&w->bracket, 1, bad, err);
        if (status)
            break;
        merge_line(w, frames, top + k, 0);
        status = put_line(writer, w, top + k, 0, err);
    }
    return status;
}

static enum status merge_band(struct worker *w, struct exr_writer *writer,
                              const struct frames *frames, int top, int rows, int threads, int *bad,
                              struct error *err)
{
    enum status status = bracket_seek(&w->bracket, top, bad, err);
    if (!status && by_rows(w, threads))
        return merge_rows(w, writer, frames, top, rows, bad, err);
    if (!status)
        status = bracket_read(&w->bracket, rows, bad, err);
    if (status)
        return status;
#pragma omp parallel for schedule(static) num_threads(threads)
    for (int k = 0; k < rows; k++)
        merge_line(w, frames, top + k, k);
    if (w->encoded) {
        const struct encoded *e = w->encoded;
        blocks_apply(w->variance, w->value, e->chi2, e->freedom, &w->row[0], e->coding[0].kept,
                     rows);
    }
    return put_lines(writer, w, top, rows, threads, err);
}

/* The first failure of all threads. */
struct failure {
    enum status status;
    struct error err;
    int bad;
};

static void note_failure(struct failure *failure, enum status status, const struct error *err,
                         int bad)
{
#pragma omp critical(merge_shot_failed)
    if (!failure->status)
        *failure = (struct failure){status, *err, bad};
}

static bool has_failed(const struct failure *failure)
{
    bool failed;
#pragma omp critical(merge_shot_failed)
    failed = failure->status != STATUS_OK;
    return failed;
}

/* Bands go round the threads, each with its own files. */
static void merge_round(struct failure *failure, struct exr_writer *writer, struct worker *first,
                        const struct exr_header *header, const struct job *job,
                        const struct shot *shot)
{
    int each = first->bracket.rows, bands = (header->height + each - 1) / each;
    const struct frames *frames = &job->frames[shot->camera];
#pragma omp parallel num_threads(job->threads)
    {
        struct worker own = {0}, *w = omp_get_thread_num() == 0 ? first : &own;
        struct error err = {0};
        int bad = -1;
        enum status status = w == first ? STATUS_OK : worker_open(w, job, shot, header, &bad, &err);
        if (status)
            note_failure(failure, status, &err, bad);
#pragma omp for schedule(dynamic)
        for (int k = 0; k < bands; k++) {
            int top = k * each, rows = header->height - top < each ? header->height - top : each;
            if (has_failed(failure))
                continue;
            status = merge_band(w, writer, frames, top, rows, 1, &bad, &err);
            if (status)
                note_failure(failure, status, &err, bad);
        }
        if (w == &own)
            worker_close(&own);
    }
}

/* Band after band. */
static void merge_in_order(struct failure *failure, struct exr_writer *writer, struct worker *w,
                           const struct exr_header *header, const struct job *job,
                           const struct shot *shot)
{
    w->bracket.threads = job->threads;
    const int each = w->bracket.rows;
    for (int top = 0; top < header->height && !failure->status; top += each) {
        int left = header->height - top, rows = left < each ? left : each;
        failure->status = merge_band(w, writer, &job->frames[shot->camera], top, rows, job->threads,
                                     &failure->bad, &failure->err);
    }
}

enum status merge_shot_rows(const char *path, const struct exr_header *header,
                            const struct job *job, const struct shot *shot, int *bad,
                            struct error *err)
{
    struct failure failure = {.bad = -1};
    struct worker first;
    struct exr_writer *writer = NULL;
    failure.status = worker_open(&first, job, shot, header, &failure.bad, &failure.err);
    if (!failure.status) {
        failure.bad = -1;
        failure.status = exr_begin(&writer, path, header, &failure.err);
    }
    if (!failure.status && job->threads > 1 && first.bracket.any_row && !first.bracket.at_once)
        merge_round(&failure, writer, &first, header, job, shot);
    else if (!failure.status)
        merge_in_order(&failure, writer, &first, header, job, shot);
    worker_close(&first);
    struct error end = {0};
    enum status ended = exr_end(writer, !failure.status, &end);
    if (!failure.status && ended)
        failure = (struct failure){ended, end, -1};
    if (failure.status && err)
        *err = failure.err;
    *bad = failure.status ? failure.bad : -1;
    return failure.status;
}
