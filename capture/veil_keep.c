/* veil_keep.c -- veils of maps in files, kept for whoever opens the same map again.
 *
 * A job opens each map a dozen times, and what the lens spread over it is the same every time.
 * Those of the last KEPT files are kept, some 30 kB each, by the file as it was and by the shares
 * that they were made with.
 */
#include "veil_keep.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

enum { KEPT = 512 };

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;  // of all below
static struct entry {
    struct veil_key key;
    struct map_veil veil;  // its field is NULL where there is none
} entry[KEPT];
static int next;

static size_t bytes(const struct glare_field *field)
{
    return 3 * (size_t)field->width * (size_t)field->height * sizeof *field->value;
}

/* A copy with a field of its own; field.value is NULL: out of memory. */
static struct map_veil copy_of(const struct map_veil *veil)
{
    struct map_veil copy = *veil;
    copy.field.value = malloc(bytes(&veil->field));
    if (copy.field.value)
        memcpy(copy.field.value, veil->field.value, bytes(&veil->field));
    return copy;
}

static bool same(const struct veil_key *a, const struct veil_key *b)
{
    return a->device == b->device && a->node == b->node && a->size == b->size
           && a->changed.tv_sec == b->changed.tv_sec && a->changed.tv_nsec == b->changed.tv_nsec
           && memcmp(a->share, b->share, sizeof a->share) == 0
           && memcmp(&a->sigma, &b->sigma, sizeof a->sigma) == 0;
}

static struct entry *find(const struct veil_key *key)
{
    for (int i = 0; i < KEPT; i++)
        if (entry[i].veil.field.value && same(&entry[i].key, key))
            return &entry[i];
    return NULL;
}

bool veil_recall(struct map_veil *veil, const struct veil_key *key)
{
    struct map_veil copy = {0};
    pthread_mutex_lock(&lock);
    const struct entry *found = find(key);
    if (found)
        copy = copy_of(&found->veil);
    pthread_mutex_unlock(&lock);
    if (copy.field.value)
        *veil = copy;
    return copy.field.value != NULL;
}

void veil_keep(const struct veil_key *key, const struct map_veil *veil)
{
    struct map_veil copy = copy_of(veil);
    if (!copy.field.value)
        return;
    pthread_mutex_lock(&lock);
    struct entry *to = find(key);
    if (!to) {
        to = &entry[next];
        next = (next + 1) % KEPT;
    }
    free(to->veil.field.value);
    *to = (struct entry){*key, copy};
    pthread_mutex_unlock(&lock);
}
