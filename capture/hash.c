/* hash.c -- identity of files: XXH3, 128 bits. Y. Collet, xxhash.com; no cryptography. */
#include "hash.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
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

/* Files are hashed one by one, and their hashes in the order of the names: the order in which
 * they were found does not matter. */
static int by_name(const void *a, const void *b)
{
    return strcmp(*(const char *const *)a, *(const char *const *)b);
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
    for (int i = 0; i < count && !status; i++)
        status = hash_file(hash, capture->folder, name[i], err);
    char made[33];
    hash_end(hash, made);
    if (!status)
        memcpy(text, made, sizeof made);
    free(name);
    return status;
}
