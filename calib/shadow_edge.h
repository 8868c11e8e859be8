/* shadow_edge.h -- the edge of a sphere's cast shadow on the board, piece by piece. Internal to
 * calib/. */
#ifndef GONIOCAM_SHADOW_EDGE_H
#define GONIOCAM_SHADOW_EDGE_H

#include "calib.h"

enum { SHADOW_SITES = 192 };
/** A photosite near the edge. */
struct shadow_site {
    float off;  // mm outwards, along the board, from where the edge is expected
    float value, sigma;
};
/** A piece of the edge in one view, with the photosites about it. */
struct shadow_piece {
    int view;
    vec3 point,
        across;         // where it is expected, on the board; unit, in the board, out of the shadow
    double blur;        // 1 sigma of lens and photosite, mm along across
    double spread;      // mm along across that a mm of the lamp's radius blurs to
    double off, sigma;  // by edge_fit: how far further out it is, mm
    int sites;
    struct shadow_site site[SHADOW_SITES];
};

/** A plane that the tags lie in, and the rectangle about them. */
struct board_plane {
    vec3 point, x, y, normal;
    double low[2], high[2];  // along x and y from point
};
/** false: they do not lie in one plane to a millimetre. */
bool shadow_board(struct board_plane *plane, const struct capture *capture);

/** Append to piece[] (room for `most`) what a view shows of the shadow's edge on paper that is
 *  neither tag nor patch, from the lamp's and the sphere's present places; -> how many there are.
 *  `count` pieces around the shadow are tried. */
int shadow_pieces(struct shadow_piece *piece, int have, int most, int count,
                  const struct radiance *map, const struct calibration *calibration, int view,
                  const struct capture *capture, const struct board_plane *plane);

/** Where a piece's edge is for a lamp of this radius (mm): fills off and sigma. `sharper`: factor
 * on its blur. -> the sum of squares that is left, in sigmas; INFINITY: there is no such edge. */
double shadow_edge_fit(struct shadow_piece *piece, double radius, double sharper);
#endif
