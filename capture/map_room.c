/* map_room.c -- memory that maps are loaded into, kept for the next.
 *
 * Of a map of 24 megapixels the sample's box is 50 MB. To find its pages anew for each shot takes
 * longer than to fill them; what the shot before has left is used again. A thread has one map at a
 * time, so that a few rooms are enough; memory does not grow with the number of shots.
 */
#include "map_room.h"
#include "capture.h"

#include <pthread.h>
#include <stdlib.h>

enum { ROOMS = 64 };

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static struct room {
    float *at;
    size_t count;
    bool taken;
} rooms[ROOMS];

/* The first room of this size that is free; else an empty place, or NULL. */
static struct room *find_room(size_t count)
{
    struct room *empty = NULL;
    for (int k = 0; k < ROOMS; k++) {
        struct room *r = &rooms[k];
        if (r->at && !r->taken && r->count == count)
            return r;
        if (!r->at && !empty)
            empty = r;
    }
    return empty;
}

float *map_room_take(size_t count)
{
    pthread_mutex_lock(&lock);
    struct room *r = find_room(count);
    float *at = r && r->at ? r->at : malloc(count * sizeof *at);
    if (r && at)
        *r = (struct room){at, count, true};
    pthread_mutex_unlock(&lock);
    return at;
}

void map_room_give(float *room)
{
    bool kept = false;
    pthread_mutex_lock(&lock);
    for (int k = 0; k < ROOMS && room && !kept; k++)
        if (rooms[k].at == room) {
            rooms[k].taken = false;
            kept = true;
        }
    pthread_mutex_unlock(&lock);
    if (!kept)
        free(room);
}

void cap_radiance_forget(void)
{
    pthread_mutex_lock(&lock);
    for (int k = 0; k < ROOMS; k++)
        if (rooms[k].at && !rooms[k].taken) {
            free(rooms[k].at);
            rooms[k] = (struct room){0};
        }
    pthread_mutex_unlock(&lock);
}
