/* merge_shots.c -- all shots of a capture become radiance maps.
 *
 * Many shots go to threads, one each; few are merged one after the other by all threads. A finished
 * map carries a hash of what it was made from, so that a second run keeps it.
 */
#include "merge_shots.h"
#include "lessons.h"
#include "merge_shot.h"
#include "hash.h"

#include <stdlib.h>
#include <string.h>

// Part of every map's identity: a change of the method makes the maps anew.
static const char method[] = "merge 10";

/* The photographs of a shot and how they are used; their files are read beside each other. */
static enum status hash_photos(struct hash *hash, const struct job *job, const struct shot *shot,
                               struct error *err)
{
    char(*digest)[33] = calloc((size_t)shot->photos, sizeof *digest);
    enum status status = digest ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%s", shot->name);
#pragma omp parallel for schedule(dynamic) num_threads(job->threads)
    for (int k = 0; k < (digest ? shot->photos : 0); k++) {
        struct error mine = {0};
        enum status own = file_digest(digest[k], job->capture->folder,
                                      job->capture->photo[shot->photo[k]].name, &mine);
#pragma omp critical(hash_photos_failed)
        if (own) {
            status = own;
            if (err)
                *err = mine;
        }
    }
    for (int k = 0; k < shot->photos && !status; k++) {
        int photo = shot->photo[k];
        hash_bytes(hash, digest[k], sizeof digest[k]);
        hash_bytes(hash, &job->seconds[photo], sizeof job->seconds[photo]);
        hash_bytes(hash, &job->left_out[photo], sizeof job->left_out[photo]);
    }
    free(digest);
    return status;
}

static enum status identify(char text[33], const struct job *job, const struct shot *shot,
                            struct error *err)
{
    const struct capture *capture = job->capture;
    const struct learned *learned = &job->learned[shot->camera];
    struct hash *hash = hash_begin();
    if (!hash)
        return cap_fail(err, STATUS_MEMORY, "%s", shot->name);
    enum status status = STATUS_OK;
    hash_bytes(hash, method, sizeof method);
    hash_bytes(hash, &learned->sensor, sizeof learned->sensor);
    if (learned->encoded)
        hash_bytes(hash, &learned->curve, sizeof learned->curve);
    const struct evenness *sites = &job->frames[shot->camera].defects.sites;
    hash_bytes(hash, sites->defect, sites->defects * sizeof *sites->defect);
    const struct frame_names ambient = ambients_of(job->ambients, (int)(shot - capture->shot));
    const struct frame_names *const kinds[3] = {&capture->flat_frames, &capture->dark_frames,
                                                &ambient};
    for (int kind = 0; kind < 3; kind++)
        for (int k = 0; k < kinds[kind]->count && !status; k++)
            status = hash_file(hash, capture->folder, kinds[kind]->name[k], err);
    if (!status)
        status = hash_photos(hash, job, shot, err);
    hash_end(hash, text);
    return status;
}

static int frames_left(const struct job *job, const struct shot *shot)
{
    int left = 0;
    for (int k = 0; k < shot->photos; k++)
        left += !job->left_out[shot->photo[k]];
    return left;
}

/* "0.001 0.004 0.0156": what the map was made with. NULL: out of memory. */
static char *times_text(const struct job *job, const struct shot *shot)
{
    enum { NUMBER = 24 };
    char *text = calloc((size_t)shot->photos + 1, NUMBER), *end = text;
    for (int k = 0; text && k < shot->photos; k++)
        if (!job->left_out[shot->photo[k]])
            end += snprintf(end, NUMBER, "%s%.9g", end == text ? "" : " ",
                            job->seconds[shot->photo[k]]);
    return text;
}

/* Write the map; photographs found damaged are left out, and it begins anew. */
static enum status write_map(const char *path, const char *inputs, const struct job *job,
                             const struct shot *shot, bool *usable, struct error *err)
{
    const struct photo *first = &job->capture->photo[shot->photo[0]];
    for (;;) {
        char *times = times_text(job, shot);
        struct exr_header header = {.width = first->width,
                                    .height = first->height,
                                    .channels = first->channels,
                                    .cfa = first->cfa,
                                    .chroma = {first->chroma[0], first->chroma[1]},
                                    .inputs = inputs,
                                    .make = first->make,
                                    .model = first->model,
                                    .times = times,
                                    .let_go = job->let_go};
        int bad = -1;
        enum status status = times ? merge_shot_rows(path, &header, job, shot, &bad, err)
                                   : cap_fail(err, STATUS_MEMORY, "%s", shot->name);
        free(times);
        if (!status || bad < 0)
            return status;
        cap_warn(job->run, "%s: this photograph is left out", err->text);
        job->left_out[bad] = true;
        *usable = frames_left(job, shot) > 0;
        if (!*usable)
            break;
    }
    cap_warn(job->run, "shot %s: no photograph of it can be read; it is left out", shot->name);
    return STATUS_OK;
}

static enum status write_with_ambient(const char *path, const char *inputs, const struct job *job,
                                      const struct shot *shot, bool *usable, struct error *err)
{
    const int number = (int)(shot - job->capture->shot);
    enum status status = ambients_begin(job->ambients, number, err);
    if (status)
        return status;
    status = write_map(path, inputs, job, shot, usable, err);
    ambients_done(job->ambients, number);
    return status;
}

static enum status merge_shot(const struct job *job, const struct shot *shot, bool *usable,
                              struct error *err)
{
    char inputs[33], *path = NULL;
    *usable = true;
    if (asprintf(&path, "%s/%s.exr", job->folder, shot->name) < 0)
        return cap_fail(err, STATUS_MEMORY, "%s", shot->name);
    enum status status = identify(inputs, job, shot, err);
    if (!status && !exr_made_from(path, inputs))
        status = write_with_ambient(path, inputs, job, shot, usable, err);
    free(path);
    return status;
}

/* Shots beside each other where there are enough of them to keep all threads busy to the end, and
 * their frames are not large in memory, as those of a mosaic are. */
static int threads_a_shot(const struct capture *capture, const struct run *run)
{
    enum { SHOTS_A_THREAD = 4 };
    bool many = capture->shots >= SHOTS_A_THREAD * run->threads && !*capture->photo[0].cfa;
    return many ? 1 : run->threads;
}

static enum status merge_all(const struct job *job, bool *usable, struct error *err)
{
    enum status status = STATUS_OK;
    int shots = job->capture->shots, failed = 0;
    cap_stage(job->run, "merge", shots);
#pragma omp parallel for schedule(dynamic) num_threads(job->threads == 1 ? job->run->threads : 1)
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

enum status merge_shots(const struct capture *capture, const char *out, struct sensor *sensor,
                        bool *usable, bool let_go, struct run *run, struct error *err)
{
    char *folder = cap_path(out, "radiance");
    struct lessons lessons = {0};
    bool *left_out = calloc((size_t)capture->photos, sizeof *left_out);
    bool *has_map = calloc((size_t)capture->shots, sizeof *has_map);
    enum status status = STATUS_OK;
    if (!folder || !left_out || !has_map)
        status = cap_fail(err, STATUS_MEMORY, "%s", out);
    if (!status)
        status = cap_make_folder(folder, err);
    photo_keep_in(status ? NULL : folder);
    status = lessons_learn(&lessons, left_out, capture, out, status, run, err);
    struct job job = {.capture = capture,
                      .folder = folder,
                      .learned = lessons.learned,
                      .seconds = lessons.seconds,
                      .frames = lessons.frames,
                      .ambients = lessons.ambients,
                      .left_out = left_out,
                      .threads = threads_a_shot(capture, run),
                      .let_go = let_go,
                      .run = run};
    if (!status)
        status = merge_all(&job, has_map, err);
    for (int k = 0; k < capture->cameras && !status && sensor; k++)
        sensor[k] = lessons.learned[k].sensor;
    if (!status && usable)
        memcpy(usable, has_map, (size_t)capture->shots * sizeof *has_map);
    photo_forget();
    lessons_free(&lessons, capture->cameras);
    free(has_map);
    free(left_out);
    free(folder);
    return status;
}

enum status cap_merge(const struct capture *capture, const char *out, struct sensor *sensor,
                      bool *usable, struct run *run, struct error *err)
{
    return merge_shots(capture, out, sensor, usable, false, run, err);
}
