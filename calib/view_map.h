/* view_map.h -- the radiance map of a view. Internal to calib/. */
#ifndef GONIOCAM_VIEW_MAP_H
#define GONIOCAM_VIEW_MAP_H

#include "calib.h"

/** OUT/radiance/NAME.exr of a view, freed of the veil that its glare tells of, left in its file
 * where its form allows: look at it through cap_radiance_at() and cap_radiance_row() only. On
 * success the caller owns *map. */
enum status cal_view_map(struct radiance *map, const char *out, const struct view *view,
                         struct error *err);

/** Channels of a photosite that were measured: all three, or the one of a mosaic's photosite; 0:
 *  saturated in every frame, in some channel. variance is the photosite's. */
int cal_measured(const struct radiance *map, const float variance[3], bool measured[3]);
/** Mean of the channels and its variance; in a mosaic, of the photosite and what its neighbours
 *  say of the other two. false: saturated. */
bool cal_gray(const struct radiance *map, int x, int y, double *value, double *variance);
/** A lattice over some region: every step-th column of every step-th row; in mosaics, cells instead
 *  of photosites. Of a large region some 16384 photosites tell enough, of a small one all. */
struct lattice {
    int cell, step;
};
struct lattice cal_lattice(const struct radiance *map, double region);
/** Is this row, or column, of the lattice? */
static inline bool cal_on_lattice(struct lattice l, int at)
{
    return at / l.cell % l.step == 0;
}
#endif
