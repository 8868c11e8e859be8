/* frames.h -- what dark and flat frames tell of each photosite. */
#ifndef GONIOCAM_FRAMES_H
#define GONIOCAM_FRAMES_H

#include "defects.h"
#include "flat.h"
#include "merge.h"
#include "sensor.h"
#include "stack.h"

/** Corrections of one camera; {0} has none. Release with frames_free(). */
struct frames {
    bool has_flat;
    struct flat flat;
    struct evenness evenness;  // of the flat frame
    struct defects defects;    // of the photographs
    char cfa[CFA_SIZE];
    struct stack dark;
    double dark_level[3], dark_noise2[3];  // DN; variance of a photosite of the mean, DN^2
    double pattern2[3];                    // variance of dark photosites about their level, DN^2
};
/** The unequal response of photosites that the flat frame shows goes into learned->sensor. */
enum status frames_make(struct frames *frames, const struct capture *capture,
                        struct learned *learned, int camera, struct error *err);
void frames_free(struct frames *frames);
/** Floats of room that a row of `count` values needs. */
size_t frames_room(int count);
/** Put what is known of row y into *row, whose arrays are borrowed: what changes goes to room. */
void frames_row(const struct frames *frames, struct merge_row *row, int y, float *room);
/** After the merge of row y: hot and dead photosites are marked. */
void frames_finish(const struct frames *frames, const struct merge_row *row, int y,
                   float *variance);
#endif
