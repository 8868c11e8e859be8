/* sights_look.h -- bands of rows of a photograph, and which of its photosites stand out. */
#ifndef GONIOCAM_SIGHTS_LOOK_H
#define GONIOCAM_SIGHTS_LOOK_H

#include "sensor.h"

enum { LOOK_NEAR = 8, LOOK_BAND = 32 };  // neighbours; rows
enum { LOOK_ODD = 1, LOOK_BRIGHT = 2, LOOK_TESTED = 4, LOOK_DIM = 8, LOOK_LIT = 16 };

/** What the photographs of a camera share. Values of a row that have the same place in the cell of
 *  filters stand beside each other: [places][plane], value i of place p is number i places + p of
 *  the file's row. */
struct look {
    const struct sensor *sensor;
    int width, height, channels, count;  // values of a row: width x channels
    int side, places, plane;
    char cfa[CFA_SIZE];
    int reach;  // rows, and pixels along the row, that neighbours are away at most
    struct {
        int along[LOOK_NEAR], rows[LOOK_NEAR];  // values, rows
    } near[3 * CFA_SIDE_MAX * CFA_SIDE_MAX];    // [side][places]
};

/** One photograph's rows and what they tell. */
struct view {
    struct photo_file *file;
    int first, end;        // rows that dn holds
    float *row;            // [count] as in the file
    float *dn;             // [LOOK_BAND + 2 reach][places][plane]
    unsigned char *flags;  // [LOOK_BAND][places][plane]
    float *residual;       // [LOOK_BAND][places][plane] of some rows; NAN: does not tell
    float *coarse;         // of the band: look_coarsely()
};

/** Photographs like this one. */
struct look look_for(const struct photo *photo, const struct sensor *sensor);
/** The channel of the values of a place. */
int look_channel(const struct look *look, int y, int place);
/** Values of a row of all places. */
size_t look_line(const struct look *look);
/** false: out of memory. Release with view_free() in any case. */
bool view_make(struct view *view, const struct look *look);
void view_free(struct view *view);
/** Read the band of `rows` (LOOK_BAND at most) from row `top` on and what is around it; false: the
 *  photograph fails. */
bool view_fill(struct view *view, const struct look *look, int top, int rows);
/** The values of row y, all places. */
const float *view_row(const struct view *view, const struct look *look, int y);
/** flags, and residual where wanted, of row y, the k-th of the band. */
void view_look(struct view *view, const struct look *look, int y, int k, bool residual);
/** coarse[width / side - 2]: second differences along a row of squares, `side` pixels wide from row
 *  y on, of the logarithm of their light. */
void view_look_coarsely(const struct view *view, const struct look *look, int y, int side,
                        float *coarse);
#endif
