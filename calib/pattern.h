/* pattern.h -- the printed patterns of AprilTag's families. */
#ifndef GONIOCAM_PATTERN_H
#define GONIOCAM_PATTERN_H

#include "capture.h"

#include <apriltag/apriltag.h>

/** A family of the AprilTag library, for one thread. Owns tags; {0} is empty; pattern_close(). */
struct tag_family {
    apriltag_family_t *tags;
    void (*destroy)(apriltag_family_t *);
};
/** STATUS_DATA: the AprilTag library has no such family (the message lists those it has). */
enum status pattern_open(struct tag_family *family, const char *name, struct error *err);
void pattern_close(struct tag_family *family);

enum { PATTERN_MAX = 16 };
enum cell { CELL_BLACK, CELL_WHITE, CELL_UNKNOWN };
/** What is printed: square cells, row 0 on top. The corners of a tag are those of the square of
 *  `side` cells that begins at cell (begin, begin): the outer border of the black frame (families
 *  with a reversed border: the inner one). One ring of cells about it belongs to the pattern. */
struct tag_pattern {
    int width, begin, side;
    unsigned char cell[PATTERN_MAX][PATTERN_MAX];  // enum cell
};
/** STATUS_DATA: the family has no such tag. */
enum status pattern_of(struct tag_pattern *pattern, const struct tag_family *family, int id,
                       struct error *err);

#endif
