/* init.h -- a first capture.yaml from photographs alone. */
#ifndef GONIOCAM_INIT_H
#define GONIOCAM_INIT_H

#include "calib.h"

/** What photographs tell without anybody's help. Owns all; {0} is empty; init_free(). */
struct init_finding {
    struct capture capture;    // all shots
    struct calibration found;  // of some of them: cameras, poses, and the board's tags
    char family[32];
};
void init_free(struct init_finding *finding);

/** Look for tags of a family (NULL: of the one that the photographs show) whose black squares are
 *  `size` mm wide, and find their places. The world becomes the board's: its origin in the middle
 *  of the tags, z their mean normal, x the right of the tag with the lowest id. Radiance maps are
 *  made in the folder `scratch`. STATUS_DATA: no tags; others of cap_capture_read and
 *  cal_geometry. */
enum status init_find(struct init_finding *finding, const char *photos, const char *family,
                      double size, const char *scratch, struct run *run, struct error *err);

/** Write it as a capture.yaml in which what a person has to fill in is marked. size is that of all
 *  tags. STATUS_IO. */
enum status init_write(const struct init_finding *finding, double size, const char *path,
                       struct error *err);

#endif
