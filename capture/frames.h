/* frames.h -- what dark, flat and ambient frames tell of each photosite. */
#ifndef GONIOCAM_FRAMES_H
#define GONIOCAM_FRAMES_H

#include "flat.h"
#include "merge.h"
#include "sensor.h"

/** Corrections of one camera; {0} has none. Release with frames_free(). */
struct frames {
    bool has_flat;
    struct flat flat;
    char cfa[5];
};
enum status frames_make(struct frames *frames, const struct capture *capture,
                        const struct learned *learned, int camera, struct error *err);
void frames_free(struct frames *frames);
/** Bytes of room that a row of `count` values needs. */
size_t frames_room(int count);
/** Put what is known of row y into *row, whose arrays are borrowed: what changes goes to room. */
void frames_row(const struct frames *frames, struct merge_row *row, int y, float *room);
#endif
