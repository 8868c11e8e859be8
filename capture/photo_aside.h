/* photo_aside.h -- decoded photographs wait in files without a name instead of in memory. */
#ifndef GONIOCAM_PHOTO_ASIDE_H
#define GONIOCAM_PHOTO_ASIDE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** The folder that such files are made in; NULL: they are not, as it is at first. */
void aside_in(const char *folder);
/** A file of so many bytes, to be closed with close(); it is nowhere to be seen and gone with the
 *  program. -1: no folder, or not plenty of room there: who asks keeps its memory. */
int aside_open(size_t size);
/** Write, read so many bytes at a place; false: they stay where they are, they cannot be read. */
bool aside_write(int file, const void *from, size_t size, size_t at);
bool aside_read(int file, void *to, size_t size, size_t at);

/** What holds a whole photograph in memory waits for its turn: few do at a time. */
void aside_begin(void);
void aside_end(void);
#endif
