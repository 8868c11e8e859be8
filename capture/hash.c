/* hash.c -- identity of files: XXH3, 128 bits. Y. Collet, xxhash.com; no cryptography. */
#include "hash.h"

#include <errno.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <xxhash.h>

struct hash {
    XXH3_state_t *state;
};

struct hash *hash_begin(void)
{
    struct hash *hash = malloc(sizeof *hash);
    if (hash && !(hash->state = XXH3_createState())) {
        free(hash);
        hash = NULL;
    }
    if (hash)
        XXH3_128bits_reset(hash->state);
    return hash;
}

void hash_bytes(struct hash *hash, const void *bytes, size_t size)
{
    XXH3_128bits_update(hash->state, bytes, size);
}

enum status hash_file(struct hash *hash, const char *folder, const char *name, struct error *err)
{
    enum { CHUNK = 1 << 18 };
    char *path = cap_path(folder, name), *buffer = malloc(CHUNK);
    FILE *file = path ? fopen(path, "rb") : NULL;
    enum status status = STATUS_OK;
    if (!path || !buffer) {
        status = cap_fail(err, STATUS_MEMORY, "%s", name);
    } else if (!file) {
        status = cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
    } else {
        hash_bytes(hash, name, strlen(name) + 1);  // the 0 keeps name and contents apart
        size_t size;
        while ((size = fread(buffer, 1, CHUNK, file)) > 0)
            hash_bytes(hash, buffer, size);
        if (ferror(file))
            status = cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
    }
    if (file)
        fclose(file);
    free(buffer);
    free(path);
    return status;
}

void hash_end(struct hash *hash, char text[33])
{
    if (!hash)
        return;
    XXH128_canonical_t bytes;
    XXH128_canonicalFromHash(&bytes, XXH3_128bits_digest(hash->state));
    for (int i = 0; i < 16; i++)
        snprintf(text + 2 * i, 3, "%02x", bytes.digest[i]);
    XXH3_freeState(hash->state);
    free(hash);
}

/* ---- what is known of files already */

struct known {
    char *path;
    struct stat about;
    char digest[33];
};
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static struct known *known = NULL;
static size_t knowns = 0;

static bool is_same(const struct stat *a, const struct stat *b)
{
    return a->st_dev == b->st_dev && a->st_ino == b->st_ino && a->st_size == b->st_size
           && a->st_mtim.tv_sec == b->st_mtim.tv_sec && a->st_mtim.tv_nsec == b->st_mtim.tv_nsec;
}

static bool recall(char digest[33], const char *path, const struct stat *about)
{
    bool found = false;
    pthread_mutex_lock(&lock);
    for (size_t i = 0; i < knowns && !found; i++) {
        found = strcmp(known[i].path, path) == 0 && is_same(&known[i].about, about);
        if (found)
            memcpy(digest, known[i].digest, sizeof known[i].digest);
    }
    pthread_mutex_unlock(&lock);
    return found;
}

/* Takes path. Without memory for it the file will be read again. */
static void remember(char *path, const struct stat *about, const char digest[33])
{
    pthread_mutex_lock(&lock);
    struct known *grown = realloc(known, (knowns + 1) * sizeof *known);
    if (grown) {
        known = grown;
        known[knowns] = (struct known){.path = path, .about = *about};
        memcpy(known[knowns++].digest, digest, sizeof known->digest);
        path = NULL;
    }
    pthread_mutex_unlock(&lock);
    free(path);
}

enum status file_digest(char digest[33], const char *folder, const char *name, struct error *err)
{
    struct stat about;
    char *path = cap_path(folder, name), made[33];
    struct hash *hash = hash_begin();
    enum status status = path && hash ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%s", name);
    const bool there = !status && stat(path, &about) == 0;
    if (there && recall(digest, path, &about)) {
        hash_end(hash, made);
        free(path);
        return STATUS_OK;
    }
    if (!status)
        status = hash_file(hash, folder, name, err);
    hash_end(hash, made);
    if (!status)
        memcpy(digest, made, sizeof made);
    if (!status && there)
        remember(path, &about, made);
    else
        free(path);
    return status;
}

/* ---- all of a capture */

/* Files are hashed one by one, and their hashes in the order of the names: the order in which
 * they were found does not matter. */
static int by_name(const void *a, const void *b)
{
    return strcmp(*(const char *const *)a, *(const char *const *)b);
}

/* The digests of the files, which are read beside each other. */
static enum status hash_all(struct hash *hash, const char *folder, const char *const *name,
                            int count, struct error *err)
{
    char(*digest)[33] = calloc((size_t)count + 1, sizeof *digest);
    enum status status = digest ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%s", folder);
#pragma omp parallel for schedule(dynamic)
    for (int i = 0; i < (digest ? count : 0); i++) {
        struct error mine = {0};
        enum status own = file_digest(digest[i], folder, name[i], &mine);
        if (own) {
#pragma omp critical(hash_all_failed)
            status = cap_fail(err, own, "%s", mine.text);
        }
    }
    for (int i = 0; i < count && !status; i++)
        hash_bytes(hash, digest[i], sizeof digest[i]);
    free(digest);
    return status;
}

enum status cap_capture_hash(char text[33], const struct capture *capture, struct error *err)
{
    int count = 0;
    const struct frame_names *const kinds[3] = {&capture->flat_frames, &capture->dark_frames,
                                                &capture->ambient_frames};
    int most = capture->photos + 1;
    for (int kind = 0; kind < 3; kind++)
        most += kinds[kind]->count;
    const char **name = calloc((size_t)most, sizeof *name);
    struct hash *hash = hash_begin();
    enum status status =
        name && hash ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%s", capture->folder);
    if (!status) {
        name[count++] = "capture.yaml";
        for (int kind = 0; kind < 3; kind++)
            for (int i = 0; i < kinds[kind]->count; i++)
                name[count++] = kinds[kind]->name[i];
        for (int i = 0; i < capture->photos; i++)
            name[count++] = capture->photo[i].name;
        qsort(name, (size_t)count, sizeof *name, by_name);
    }
    if (!status)
        status = hash_all(hash, capture->folder, name, count, err);
    char made[33];
    hash_end(hash, made);
    if (!status)
        memcpy(text, made, sizeof made);
    free(name);
    return status;
}
