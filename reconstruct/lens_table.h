/* lens_table.h -- the rays of a camera, tabulated once, interpolated ever after. */
#ifndef GONIOCAM_LENS_TABLE_H
#define GONIOCAM_LENS_TABLE_H

#include "calib.h"

/** Undistorted image coordinates (x/z, y/z in the camera's frame) at every LENS_STEP-th pixel.
 *  Owns node; {0} is empty; release with rec_lens_free(). */
struct lens_table {
    double (*node)[2];  // [rows][columns]; node [1][1] is the pixel (0, 0)
    int columns, rows;
};

/** STATUS_MEMORY. */
enum status rec_lens_make(struct lens_table *table, const struct camera *camera, struct error *err);
void rec_lens_free(struct lens_table *table);
/** (x/z, y/z) at a pixel, and its derivatives by the pixel's x and y. Requires the pixel to lie
 *  within one pixel of the image. */
void rec_lens_at(const struct lens_table *table, double u, double v, double at[2], double by_u[2],
                 double by_v[2]);

#endif
