/* tag_sites.h -- the photosites of a map that see a tag's pattern. */
#ifndef GONIOCAM_TAG_SITES_H
#define GONIOCAM_TAG_SITES_H

#include "tag_image.h"

/** A photosite: where it is without distortion, and its mean of R, G and B; in a mosaic its own
 *  channel's value, scaled to that mean. */
struct photosite {
    double q[2];
    double value, variance;
};

/** Owns site; {0} is empty; release with tag_sites_free(). */
struct tag_sites {
    struct photosite *site;  // [count]
    int count;
};

/** The photosites that lie at least margin_px from the rim of the pattern and its ring. false: the
 *  tag reaches out of the image, or out of memory. May be called again. */
bool tag_sites_gather(struct tag_sites *sites, const struct tag_image *image,
                      const struct camera *camera, const struct radiance *map, double margin_px);
void tag_sites_free(struct tag_sites *sites);

#endif
