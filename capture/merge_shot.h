/* merge_shot.h -- one shot, from its photographs to its map. */
#ifndef GONIOCAM_MERGE_SHOT_H
#define GONIOCAM_MERGE_SHOT_H

#include "ambient.h"
#include "exr.h"
#include "frames.h"
#include "sensor.h"

/** What the shots of one merge share. */
struct job {
    const struct capture *capture;
    const char *folder;             // OUT/radiance
    const struct learned *learned;  // [cameras]
    const double *seconds;          // [photos]: exposure times as seen
    const struct frames *frames;    // [cameras]: dark, flat
    struct ambients *ambients;      // of the shots; NULL: none
    bool *left_out;                 // [photos]: damaged, or moved against the rest of its shot
    int threads;                    // for the rows of one shot
    bool let_go;                    // maps need not stay in memory
    struct run *run;
};

/** Write the map of a shot, whose ambient light is begun, from the photographs that are not left
 * out. On a failure *bad is the photograph to blame, or -1, and there is no file. */
enum status merge_shot_rows(const char *path, const struct exr_header *header,
                            const struct job *job, const struct shot *shot, int *bad,
                            struct error *err);
#endif
