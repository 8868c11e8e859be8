/* map_room.h -- memory that maps are loaded into, kept for the next. */
#ifndef GONIOCAM_MAP_ROOM_H
#define GONIOCAM_MAP_ROOM_H

#include <stddef.h>

/** Room for `count` numbers, which hold anything; whoever takes it gives it back. Pages that nobody
 *  has ever filled cost nothing. NULL: out of memory. Any thread. */
float *map_room_take(size_t count);
/** Give back what was taken, or free() what was not (NULL, too). */
void map_room_give(float *room);
#endif
