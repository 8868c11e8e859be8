/* slopes.h -- where a photograph changes, at a reduced size. Internal to calib/. */
#ifndef GONIOCAM_SLOPES_H
#define GONIOCAM_SLOPES_H

#include "calib.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Slopes of ln radiance in `step` x `step` blocks of photosites: [height][width][2], x and y, of
 *  length 1 where an edge is clear, 0 where there is none. Owns slope; {0} is empty. */
struct slopes {
    int width, height;
    double step;
    float *slope;
};
/** Of a map. step: 1 or more. STATUS_MEMORY. */
enum status cal_slopes_make(struct slopes *slopes, const struct radiance *map, int step,
                            struct error *err);
void cal_slopes_free(struct slopes *slopes);
/** How much an edge along an outline is at a pixel of the photograph, whose normal there is unit:
 *  1, a clear one in its direction; 0, none, or one that runs elsewhere. -1: outside. */
double cal_slopes_edge(const struct slopes *slopes, const double pixel[2], const double normal[2]);

#ifdef __cplusplus
}
#endif
#endif
