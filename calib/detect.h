/* detect.h -- AprilTag for C with our conventions: finds the tags of a board in a radiance map. */
#ifndef GONIOCAM_DETECT_H
#define GONIOCAM_DETECT_H

#include "pattern.h"

/** A tag found. Corners as in struct seen_tag; the centre of the first pixel is (0, 0). */
struct detection {
    int id;
    double corner[4][2];
    double margin;  // of the decoding, in 8-bit levels: more is better
    bool twice;     // two tags with its id are in the picture: which one is meant?
};

/** A detector for one thread. detector_end() releases it; {0} is empty. */
struct detector {
    struct tag_family family;
    apriltag_detector_t *detector;
};
enum status detector_begin(struct detector *d, const char *family, struct error *err);
void detector_end(struct detector *d);

/** Find the tags that capture names, and with capture->tag_size all others, each id at most once,
 *  in the order of ids. On success the caller frees *found, [*count]. STATUS_MEMORY. */
enum status detector_find(struct detector *d, const struct capture *capture,
                          const struct radiance *map, struct detection **found, int *count,
                          struct error *err);
/** Corners of all tags with an id, however many there are: at most `room`, and their *count. */
enum status detector_all(struct detector *d, const struct radiance *map, int id,
                         double (*corner)[4][2], int room, int *count, struct error *err);
#endif
