/* thumbnail.h -- what a photograph shows, small: to tell whether two show the same view. */
#ifndef GONIOCAM_THUMBNAIL_H
#define GONIOCAM_THUMBNAIL_H

#include "sensor.h"

/** Gradients of the logarithm of the light; NaN where it is saturated. Owns across and down;
 *  {0} is empty; release with thumbnail_free(). */
struct thumbnail {
    int width, height;
    float *across, *down;  // [height][width]: to the right, to the next row
    double seconds;        // exposure time; 0: not known
    bool blank;            // nothing but noise, or even light
};

/** Read a photograph of the camera whose sensor was learnt. One of another size leaves *thumbnail
 *  empty. STATUS_IO, STATUS_FORMAT, STATUS_MEMORY. */
enum status thumbnail_read(struct thumbnail *thumbnail, const char *path,
                           const struct camera_kind *kind, const struct learned *learned,
                           struct error *err);
void thumbnail_free(struct thumbnail *thumbnail);
/** How alike two views are: the correlation of their gradients, 1 for the same photograph. 0 where
 *  they do not show the same view: unlike, or more alike when one is moved. */
double thumbnail_likeness(const struct thumbnail *a, const struct thumbnail *b);
#endif
