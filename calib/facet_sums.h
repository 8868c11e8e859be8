/* facet_sums.h -- the radiance of small pieces of surface. Internal to calib/. */
#ifndef GONIOCAM_FACET_SUMS_H
#define GONIOCAM_FACET_SUMS_H

#include "photometry.h"

/** Running sums over the photosites of one channel, places counted from the facet's first one. */
struct channel_sums {
    double value, square, variance;
    double place[2], spread[3], slope[2];  // of x y, of xx xy yy, of x value, y value
    int count;                             // fewer than the facet's in a mosaic
};
/** Of a facet; {0} is empty. */
struct facet_sums {
    struct channel_sums channel[3];
    double first[2], pixel[2], place[2], spread[3];  // spread: of the place's aa ab bb
    int count;
    double low, high;  // of the channels' mean
};
/** Add the photosite (x, y), if it was measured, which lies at (a, b) of the surface. */
void facet_sums_add(struct facet_sums *sums, const struct radiance *map, int x, int y, double a,
                    double b);
/** The facet's pixel, means and sigmas; false: no photosites, or more spread than one material has
 *  (spread_max, relative). */
bool facet_of_sums(const struct facet_sums *sums, double spread_max, struct facet *facet);
/** The mean place of the photosites on a surface whose point (a, b) is origin + a right + b up, and
 *  how they are spread about it: facet->point and ->spread. */
void facet_of_place(const struct facet_sums *sums, vec3 origin, vec3 right, vec3 up,
                    struct facet *facet);
/** By what the mean [3] over the block of side x side photosites from (x, y) is above the radiance
 *  in its middle that the lens has not blurred. False: the photosites around it do not tell, and
 *  bend is as it was. */
bool facet_bend(const struct radiance *map, int x, int y, int side, double blur_px, double bend[3]);
#endif
