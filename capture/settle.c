/* settle.c -- photographs in an order of their own.
 *
 * Sums of numbers that are rounded depend on the order of the terms, and which photographs a level
 * is learned from on which come first. So that neither changes with the files' names, shots are
 * put in the order of what their photographs hold, and photographs of a shot in that of their
 * exposure times. To know them apart some of each file is enough: its length, and a piece of its
 * beginning, its middle and its end. Where even these are the same, names decide.
 */
#include "hash.h"
#include "shots.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

enum { PIECE = 1 << 16, KEY = 33 };

/** A shot or photograph on its way to its place. */
struct settler {
    char key[KEY];
    double time;  // of a photograph; 0 for a shot
    const char *name;
    int from;  // its place so far
};

static int by_key(const void *a, const void *b)
{
    const struct settler *p = a, *q = b;
    if (p->time != q->time)
        return p->time < q->time ? -1 : 1;
    int order = strcmp(p->key, q->key);
    return order ? order : natural_order(p->name, q->name);
}

static enum status look_into(char key[KEY], const char *folder, const char *name, struct error *err)
{
    char *path = cap_path(folder, name), *piece = malloc(PIECE);
    FILE *file = path ? fopen(path, "rb") : NULL;
    struct hash *hash = hash_begin();
    enum status status = STATUS_OK;
    if (!path || !piece || !hash)
        status = cap_fail(err, STATUS_MEMORY, "%s", name);
    else if (!file || fseek(file, 0, SEEK_END))
        status = cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
    long size = status ? 0 : ftell(file);
    const long start[3] = {0, size / 2, size > PIECE ? size - PIECE : 0};
    if (!status)
        hash_bytes(hash, &size, sizeof size);
    for (int k = 0; k < 3 && !status; k++) {
        if (fseek(file, start[k], SEEK_SET))
            status = cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
        else
            hash_bytes(hash, piece, fread(piece, 1, PIECE, file));
    }
    hash_end(hash, key);
    if (file)
        fclose(file);
    free(piece);
    free(path);
    return status;
}

static enum status look_into_all(struct settler *photo, const struct capture *capture,
                                 struct run *run, struct error *err)
{
    enum status status = STATUS_OK;
#pragma omp parallel for schedule(dynamic) num_threads(run->threads)
    for (int i = 0; i < capture->photos; i++) {
        struct error mine = {0};
        photo[i].name = capture->photo[i].name;
        photo[i].time = capture->photo[i].exposure_time;
        photo[i].from = i;
        enum status one = look_into(photo[i].key, capture->folder, photo[i].name, &mine);
#pragma omp critical(settle_failed)
        if (one && !status)
            status = cap_fail(err, one, "%s", mine.text);
    }
    return status;
}

// The photographs of each shot by time and contents, and the key of them all.
static void settle_shots(struct settler *shot, struct capture *capture, const struct settler *photo,
                         struct settler *scratch)
{
    for (int s = 0; s < capture->shots; s++) {
        struct shot *of = &capture->shot[s];
        for (int k = 0; k < of->photos; k++)
            scratch[k] = photo[of->photo[k]];
        qsort(scratch, (size_t)of->photos, sizeof *scratch, by_key);
        struct hash *hash = hash_begin();
        for (int k = 0; k < of->photos; k++) {
            of->photo[k] = scratch[k].from;
            if (hash)
                hash_bytes(hash, scratch[k].key, KEY);
        }
        shot[s] = (struct settler){.name = of->name, .from = s};
        hash_end(hash, shot[s].key);
    }
    qsort(shot, (size_t)capture->shots, sizeof *shot, by_key);
}

// Photographs in the order of the shots; those of no shot at the end, in their order.
static void move_photos(struct capture *capture, struct photo *to)
{
    int n = 0;
    for (int s = 0; s < capture->shots; s++)
        for (int k = 0; k < capture->shot[s].photos; k++) {
            int *at = &capture->shot[s].photo[k];
            to[n] = capture->photo[*at];
            to[n].shot = s;
            capture->photo[*at].name = NULL;
            *at = n++;
        }
    for (int i = 0; i < capture->photos; i++)
        if (capture->photo[i].name)
            to[n++] = capture->photo[i];
    free(capture->photo);
    capture->photo = to;
}

// Cameras are numbered as shots bring them.
static void move_cameras(struct capture *capture, struct camera_kind *scratch)
{
    int n = 0;
    for (int s = 0; s < capture->shots; s++) {
        int was = capture->shot[s].camera, now = 0;
        while (now < n && scratch[now].name != capture->camera[was].name)
            now++;
        if (now == n)
            scratch[n++] = capture->camera[was];
        capture->shot[s].camera = now;
    }
    for (int k = 0; k < n; k++)  // camera0 is the first again
        for (int j = k + 1; j < n; j++)
            if (natural_order(scratch[j].name, scratch[k].name) < 0) {
                char *swap = scratch[j].name;
                scratch[j].name = scratch[k].name;
                scratch[k].name = swap;
            }
    memcpy(capture->camera, scratch, (size_t)n * sizeof *scratch);
}

enum status cap_capture_settle(struct capture *capture, struct run *run, struct error *err)
{
    size_t photos = (size_t)capture->photos, shots = (size_t)capture->shots;
    struct settler *photo = calloc(photos + 1, sizeof *photo);
    struct settler *scratch = calloc(photos + 1, sizeof *scratch);
    struct settler *order = calloc(shots + 1, sizeof *order);
    struct shot *shot = calloc(shots + 1, sizeof *shot);
    struct photo *moved = calloc(photos + 1, sizeof *moved);
    struct camera_kind *camera = calloc(shots + 1, sizeof *camera);
    enum status status = photo && scratch && order && shot && moved && camera
                             ? look_into_all(photo, capture, run, err)
                             : cap_fail(err, STATUS_MEMORY, "%s", capture->folder);
    if (!status) {
        settle_shots(order, capture, photo, scratch);
        for (size_t s = 0; s < shots; s++)
            shot[s] = capture->shot[order[s].from];
        memcpy(capture->shot, shot, shots * sizeof *shot);
        move_cameras(capture, camera);
        move_photos(capture, moved);
        moved = NULL;  // the capture's now
    }
    free(photo);
    free(scratch);
    free(order);
    free(shot);
    free(moved);
    free(camera);
    return status;
}
