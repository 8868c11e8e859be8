/* merge_shots.c -- all shots of a capture become radiance maps.
 *
 * Shots go to threads, a shot is merged by one of them in bands of rows: memory does not depend
 * on the number of shots, and the result not on the number of threads. A finished map carries a
 * hash of what it was made from, so that a second run keeps it.
 */
#include "bracket.h"
#include "exr.h"
#include "flat.h"
#include "hash.h"
#include "merge.h"

#include <stdlib.h>
#include <string.h>

// Part of every map's identity: a change of the method makes the maps anew.
static const char method[] = "merge 1";

enum { BAND_ROWS = 8 };

/* What the shots of one merge share. */
struct job {
    const struct capture *capture;
    const char *folder;           // OUT/radiance
    const struct sensor *sensor;  // [cameras]
    const struct flat *flat;      // [cameras], or NULL
    bool *left_out;               // [photos]: found damaged
    struct run *run;
};

static enum status identify(char text[33], const struct job *job, const struct shot *shot,
                            struct error *err)
{
    const struct capture *capture = job->capture;
    struct hash *hash = hash_begin();
    if (!hash)
        return cap_fail(err, STATUS_MEMORY, "%s", shot->name);
    enum status status = STATUS_OK;
    hash_bytes(hash, method, sizeof method);
    hash_bytes(hash, &job->sensor[shot->camera], sizeof *job->sensor);
    hash_bytes(hash, &capture->response, sizeof capture->response);
    if (capture->flat)
        status = hash_file(hash, capture->folder, capture->flat, err);
    for (int k = 0; k < shot->photos && !status; k++) {
        const struct photo *photo = &capture->photo[shot->photo[k]];
        hash_bytes(hash, &photo->exposure_time, sizeof photo->exposure_time);
        status = hash_file(hash, capture->folder, photo->name, err);
    }
    hash_end(hash, text);
    return status;
}

static enum status merge_bands(struct radiance *map, struct bracket *bracket, struct merge_row *row,
                               const struct job *job, int camera, int *bad, struct error *err)
{
    float *flat = job->flat ? malloc((size_t)row->count * sizeof *flat) : NULL;
    if (job->flat && !flat)
        return cap_fail(err, STATUS_MEMORY, "a row of the flat frame");
    size_t line = (size_t)row->count;
    enum status status = STATUS_OK;
    for (int top = 0; top < map->height && !status; top += BAND_ROWS) {
        int rows = map->height - top < BAND_ROWS ? map->height - top : BAND_ROWS;
        status = bracket_read(bracket, rows, bad, err);
        for (int y = 0; y < rows && !status; y++) {
            const uint16_t *dn[BRACKET_FRAMES_MAX];
            for (int f = 0; f < bracket->frames; f++)
                dn[f] = bracket->dn[f] + y * line;
            if (flat) {
                flat_row(&job->flat[camera], top + y, flat);
                merge_row_scale(row, &job->sensor[camera], flat);
            }
            size_t at = (size_t)(top + y) * line;
            merge_row(map->value + at, map->variance + at, row, dn, bracket->time, bracket->frames);
        }
    }
    free(flat);
    return status;
}

/* Once through the shot with the frames that are not left out. */
static enum status merge_frames(struct radiance *map, const struct job *job,
                                const struct shot *shot, int *bad, struct error *err)
{
    struct bracket bracket = {0};
    struct merge_row row = {0};
    enum status status =
        bracket_open(&bracket, job->capture, shot, job->left_out, BAND_ROWS, bad, err);
    if (!status)
        status = merge_row_make(&row, &job->sensor[shot->camera], bracket.width, err);
    if (!status)
        status = merge_bands(map, &bracket, &row, job, shot->camera, bad, err);
    merge_row_free(&row);
    bracket_close(&bracket);
    return status;
}

static int frames_left(const struct job *job, const struct shot *shot)
{
    int left = 0;
    for (int k = 0; k < shot->photos; k++)
        left += !job->left_out[shot->photo[k]];
    return left;
}

static enum status merge_shot(const struct job *job, const struct shot *shot, bool *usable,
                              struct error *err)
{
    const struct photo *first = &job->capture->photo[shot->photo[0]];
    struct radiance map = {.width = first->width, .height = first->height};
    size_t count = 3 * (size_t)map.width * (size_t)map.height;
    char inputs[33], *path = NULL;
    *usable = true;
    if (asprintf(&path, "%s/%s.exr", job->folder, shot->name) < 0)
        return cap_fail(err, STATUS_MEMORY, "%s", shot->name);
    enum status status = identify(inputs, job, shot, err);
    if (status || exr_made_from(path, inputs)) {
        free(path);
        return status;
    }
    map.value = malloc(count * sizeof *map.value);
    map.variance = malloc(count * sizeof *map.variance);
    if (!map.value || !map.variance)
        status = cap_fail(err, STATUS_MEMORY, "%s: %zu values", shot->name, 2 * count);
    for (bool again = !status; again;) {
        int bad = -1;
        status = merge_frames(&map, job, shot, &bad, err);
        again = status && bad >= 0;
        if (again) {
            cap_warn(job->run, "%s: this photograph is left out", err->text);
            job->left_out[bad] = true;
            *usable = frames_left(job, shot) > 0;
            again = *usable;
            status = STATUS_OK;
        }
    }
    if (!status && *usable)
        status = exr_write(&map, path, inputs, err);
    else if (!status)
        cap_warn(job->run, "shot %s: no photograph of it can be read; it is left out", shot->name);
    cap_radiance_free(&map);
    free(path);
    return status;
}

static void free_flats(struct flat *flat, int cameras)
{
    for (int k = 0; flat && k < cameras; k++)
        flat_free(&flat[k]);
    free(flat);
}

/* Flat frames of all cameras; *flats stays NULL where capture.yaml names none. */
static enum status fit_flats(struct flat **flats, const struct capture *capture,
                             const struct sensor *sensor, struct error *err)
{
    if (!capture->flat)
        return STATUS_OK;
    struct flat *made = calloc((size_t)capture->cameras, sizeof *made);
    if (!made)
        return cap_fail(err, STATUS_MEMORY, "%s", capture->flat);
    enum status status = STATUS_OK;
    for (int k = 0; k < capture->cameras && !status; k++)
        status = flat_fit(&made[k], capture, &sensor[k], k, err);
    if (status)
        free_flats(made, capture->cameras);
    else
        *flats = made;
    return status;
}

static enum status merge_all(const struct job *job, bool *usable, struct error *err)
{
    enum status status = STATUS_OK;
    int shots = job->capture->shots, failed = 0;
    cap_stage(job->run, "merge", shots);
#pragma omp parallel for schedule(dynamic) num_threads(job->run->threads)
    for (int s = 0; s < shots; s++) {
        struct error mine = {0};
        int stop;
#pragma omp atomic read
        stop = failed;
        if (stop || !cap_ours(job->run, s))
            continue;
        enum status one = merge_shot(job, &job->capture->shot[s], &usable[s], &mine);
        cap_step(job->run);
        if (!one)
            continue;
#pragma omp critical(merge_failed)
        if (!status) {
            status = one;
            if (err)
                *err = mine;
#pragma omp atomic write
            failed = 1;
        }
    }
    cap_stage(job->run, "", 0);
    return status;
}

enum status cap_merge(const struct capture *capture, const char *out, struct sensor *sensor,
                      bool *usable, struct run *run, struct error *err)
{
    char *folder = cap_path(out, "radiance");
    struct sensor *found = calloc((size_t)capture->cameras, sizeof *found);
    bool *left_out = calloc((size_t)capture->photos, sizeof *left_out);
    bool *has_map = calloc((size_t)capture->shots, sizeof *has_map);
    struct flat *flat = NULL;
    enum status status = STATUS_OK;
    if (!folder || !found || !left_out || !has_map)
        status = cap_fail(err, STATUS_MEMORY, "%s", out);
    if (!status)
        status = cap_make_folder(folder, err);
    if (!status)
        cap_stage(run, "levels", capture->cameras);
    for (int k = 0; k < capture->cameras && !status; k++)
        status = cap_sensor_find(&found[k], capture, k, run, err);
    if (!status)
        status = fit_flats(&flat, capture, found, err);
    struct job job = {capture, folder, found, flat, left_out, run};
    if (!status)
        status = merge_all(&job, has_map, err);
    if (!status && sensor)
        memcpy(sensor, found, (size_t)capture->cameras * sizeof *found);
    if (!status && usable)
        memcpy(usable, has_map, (size_t)capture->shots * sizeof *has_map);
    free_flats(flat, capture->cameras);
    free(has_map);
    free(left_out);
    free(found);
    free(folder);
    return status;
}
