/* limb.h -- one edge of an outline, from the photosites across it. Internal to calib/. */
#ifndef GONIOCAM_LIMB_H
#define GONIOCAM_LIMB_H

#include "calib.h"

enum {
    EDGE_PX = 6,            // length of outline that makes one edge
    LIMB_SITES_MAX = 512,   // photosites of one edge
    LIMB_SITES_ENOUGH = 20  // four for each coefficient of the model
};
// What the limb model spans, in pixels on each side of the predicted outline.
static const double LIMB_INSIDE_PX = 7, LIMB_OUTSIDE_PX = 4.5;
// Of a surface that bends more, the series of the limb's root (limb.c) is no good that far inside.
static const double LIMB_BEND_MAX = 0.1;

// Edges that are no outline's lie anywhere within the search: 0.58 of it rms about any fit.
static const double STRAYING = 0.4;

enum { LIMB_TERMS = 5, LIMB_POWERS = 6, LIMB_CELLS = 64 * 20 };
/** The powers of the depth that the limb model is made of (limb.c), as a lens shows them that blurs
 * by `blur`, 1 sigma in pixels. */
struct limb_lens {
    double blur, power[LIMB_CELLS + 1][LIMB_POWERS];
};

/** A photosite near the outline. */
struct site {
    double d;  // pixels outwards from the predicted outline
    double value, variance;
};
/** The photosites of one edge. */
struct sector {
    struct site site[LIMB_SITES_MAX];
    int count;
    double bend;  // of the surface from the limb inwards: 1 / its radius in pixels; 0: not known
};

/** Add a photosite of a map at distance d; one that says nothing, or is too many, is left out. */
void limb_add(struct sector *sector, const struct radiance *map, int x, int y, double d);
/** Every how many photosites, both ways, are enough for sectors that are this long across. */
int limb_stride(double across_px);
void limb_lens_make(struct limb_lens *lens, double blur);
/** The lens that fits these sectors best. by_tags: the blur that the view's tags show. */
void limb_lens_find(struct limb_lens *lens, const struct sector *sector, int count, double by_tags);
/** The edge of one sector by the limb model, pixels outwards, and its standard deviation. false:
 *  none is there, or it is not sure. */
bool limb_edge(const struct sector *sector, const struct limb_lens *lens, double *edge,
               double *sigma);
/** The steepest step of one sector within `search` pixels, over three pixels on each side. */
bool limb_step(const struct sector *sector, double search, double *edge, double *sigma);
#endif
