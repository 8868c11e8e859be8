/* bounce.h -- light that board and sample throw on each other. */
#ifndef GONIOCAM_SAMPLES_BOUNCE_H
#define GONIOCAM_SAMPLES_BOUNCE_H

#include "shade.h"

/** What bounces add in one shot: on the sample, radiance towards the camera by the board's
 *  light; on the board, irradiance by the sample's. Owns its maps; release with sam_bounce_free().
 */
struct bounce {
    const struct shot_view *view;
    vec3 x, y, z;       // a frame whose z points from the sample to the camera
    double *on_sample;  // [BOUNCE_THETA][BOUNCE_PHI][3], by the normal's angles in that frame
    double *on_board;   // [rows][columns][3] at the world's (x0 + column step, y0 + row step)
    int columns, rows;
    double x0, y0, step;
};

enum { BOUNCE_THETA = 64, BOUNCE_PHI = 160 };

/** Both maps of a shot; the view must outlive them. The sample is a sphere. STATUS_MEMORY. */
enum status sam_bounce_build(struct bounce *bounce, const struct shot_view *view, int threads,
                             struct error *err);
void sam_bounce_free(struct bounce *bounce);
/** Add what the bounce brings to the radiance of a spot. */
void sam_bounce_add(const struct bounce *bounce, const struct spot *spot, double rgb[3]);
#endif
