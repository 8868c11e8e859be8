/* lens_table.h -- the rays of a camera, tabulated once, interpolated ever after. */
#ifndef GONIOCAM_LENS_TABLE_H
#define GONIOCAM_LENS_TABLE_H

#include "lanes.h"

enum { LENS_STEP = 8 };

/** Weights of the four nodes about the pixels between two nodes, [node][pixel]. */
struct span_weights {
    double at[4][LENS_STEP], by_u[4][LENS_STEP];
};

/** Undistorted image coordinates (x/z, y/z in the camera's frame) at every LENS_STEP-th pixel.
 *  Owns node; {0} is empty; release with rec_lens_free(). */
struct lens_table {
    double (*node)[2];  // [rows][columns]; node [1][1] is the pixel (0, 0)
    int columns, rows;
    struct span_weights weights;
};

/** STATUS_MEMORY. */
enum status rec_lens_make(struct lens_table *table, const struct camera *camera, struct error *err);
void rec_lens_free(struct lens_table *table);

/** (x/z, y/z) of photosites beside each other, and its derivatives by the pixel's x and y. */
struct lens_row {
    double at[2][LANES], by_u[2][LANES], by_v[2][LANES];
};
/** The photosites (x0 + i, y), i < LANES. Requires x0 to be a multiple of LANES, and the first to
 *  lie in the image; beyond the image's end the last one is repeated. */
void rec_lens_row(struct lens_row *row, const struct lens_table *table, int x0, int y);

#endif
