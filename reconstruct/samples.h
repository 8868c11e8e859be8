/* samples.h -- photosites become reflectance samples. */
#ifndef GONIOCAM_REFLECTANCE_SAMPLES_H
#define GONIOCAM_REFLECTANCE_SAMPLES_H

#include "blockers.h"
#include "lens_table.h"
#include "reconstruct.h"

/** What became of a photosite in the sample's neighbourhood. */
#define FATE_LIST(X)                                                                               \
    X(USED, "used")                                                                                \
    X(OUTLINE, "outline")       /* within a photosite of the sample's outline */                   \
    X(DARK, "dark")             /* the lamp is below its horizon */                                \
    X(TERMINATOR, "terminator") /* within a photosite of where the lamp sets */                    \
    X(SHADOWED, "shadowed")     /* something keeps the lamp's light off */                         \
    X(OCCLUDED, "occluded")     /* something stands before it */                                   \
    X(BOUNCED, "bounced")       /* taking out the board's light leaves too little to be sure of */ \
    X(SATURATED, "saturated")   /* in every frame of the bracket, in some channel */               \
    X(UNUSABLE, "unusable")     /* no number, or beyond what a bin can sum */                      \
    X(STRAY, "stray") /* far from its neighbours: dust, a scratch, flare, something before it */

#define FATE_ENUM(name, text) FATE_##name,
enum fate { FATE_LIST(FATE_ENUM) FATES };
#undef FATE_ENUM
extern const char *const rec_fate_name[FATES];

/** One photosite's measurement. The errors that bins share do not average out: `systematic` and
 *  `tilt` come from the geometry and the lamp, `noise` from the photosite alone. */
typedef struct {
    half_diff angles;
    int channel;        // of a mosaic: the one that was measured, the others are 0; else -1
    double f[3];        // 1/sr
    double noise[3];    // variance of f
    double systematic;  // 1 sigma of ln f at fixed angles
    double tilt;        // 1 sigma of theta_h
    double spread[2];   // variance of the normal over the photosite: towards h, across; rad^2
    double disc;        // variance of wi over the lamp's disc, each way; rad^2
    double weight;      // (0, 1]; no function of this photosite's own noise
    double bounced[3];  // light that the lit board brought, taken out of f: over what is left
    vec3 point, normal, wi, wo;  // in the world
    double residual;             // f over its bin's mean, less 1; NAN: nothing is known there
    double others;               // what part of the bin is other shots', which residual shows
    double excess;               // the board's light at strength 1 over the bin's f, less the bin's
} reflectance_sample;

/** All that a photosite needs to know of its shot. Borrows everything. */
struct viewing {
    const struct camera *camera;
    const struct view *view;
    const struct lamp *lamp;
    const struct sample *sample;
    const struct lens_table *lens;
    const struct board_extent *board;   // may be NULL
    const struct blockers *blockers;    // may be NULL
    const struct raster *raster;        // of a mesh, else NULL
    struct bounce_map *bounce;          // the lit board's light, may be NULL: there is none
    const struct consensus *consensus;  // what is known of f already, may be NULL: nothing
    const struct lookup *table;         // f so far, for the board's light; may be NULL
    mat3 view_from_world;
    vec3 eye, lamp_position;
    struct beam beam;  // of the lamp, its axis in the world
    double square;     // side of the square that photosite and lens average over, photosites
    double margin;     // what is this near an edge is mixed with what is beyond, photosites
    int chroma[2];     // so many photosites across and down share their colour; 0 or 1: none
    double photosite;  // 1.5 photosites, in radians: how near a blocker's edge may be
    vec3 to_sample;    // from the camera, in its frame, unit
    double cos_bound;  // of the cone about it that holds the sample; -2: the eye is too near
    double light[3];   // intensity (or irradiance) times power
    double shake;      // 1 sigma of the ray at the sample from the pose, mm
    double dimming;    // 1 sigma of ln(light), besides lamp_spread's
    double lamp_spread[4][4];  // covariance of the lamp's position (direction) and ln intensity
    double bounce_sigma;       // of the bounced light, relative: shared by all photosites
    double bounce_caution;     // as much of it as it was before samples were compared
    double bounce_scatter;     // likewise, of each photosite's own, besides what cells hide
};

/** The board's rectangle in the plane z = 0 of the world. */
struct board_extent {
    double low[2], high[2];
};

/** Prepare one view of a calibration. */
struct viewing rec_viewing(const struct calibration *calibration, int view,
                           const struct lens_table *lens, const struct board_extent *board);

/** What a photosite holds comes from so far before and after its centre, in x and y, photosites. */
struct reach {
    double before[2], after[2];
};

/** Of photosite (x, y): its margin, or as far as the photosites go whose colour it has a part of.
 */
struct reach rec_reach(const struct viewing *viewing, int x, int y);
/** The longest way of any of them. */
double rec_farthest(const struct viewing *viewing);

/** The pixels [x0, x1) x [y0, y1) that can show the sample. */
typedef struct {
    int x0, y0, x1, y1;
} pixel_box;
pixel_box rec_sample_box(const struct viewing *viewing);

#endif
