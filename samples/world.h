/* world.h -- what a ray of a scene meets.
 *
 * Rays of a shot pass through its camera or its lamp. Seen from there, each solid lies in a cone,
 * and one product of directions tells the many rays that miss it.
 */
#ifndef GONIOCAM_SAMPLES_WORLD_H
#define GONIOCAM_SAMPLES_WORLD_H

#include "shapes.h"
#include "scene.h"
#include "tags.h"

enum matter {
    MATTER_NONE,
    MATTER_SAMPLE,
    MATTER_POST,
    MATTER_PATCH,
    MATTER_SHEET,
    MATTER_PAPER,
    MATTER_THING
};

/** Tags that lie in one plane, with its own axes x and y. */
struct paper_plane {
    vec3 origin, x, y, normal;
    int first, count;  // into the scene's tags
};

/** Where a tag's paper is in its plane: within `reach` of (x, y) along both axes. */
struct paper {
    double x, y, reach;
};

/** A scene made ready for rays. Borrows the scene; owns the rest; release with sam_world_free(). */
struct world {
    const struct scene *scene;
    struct tag_family family;
    struct paper_plane *plane;  // [planes]
    int planes;
    struct paper *paper;  // [scene->board.tags]
    struct rod post;      // radius 0: none
    struct rod rod;       // the sample, when it is a cylinder
    struct box slab[PATCHES_MAX];
};

/** Directions within acos(cosine) of a unit axis; cosine -2: all. */
struct cone {
    vec3 axis;
    double cosine;
};
/** A place that rays pass through, and the cones that the solids fill from there. */
struct vantage {
    struct cone sample, post, slab[PATCHES_MAX], thing[THINGS_MAX];
};

/** What a ray meets first. Spots of one surface lie on one smooth face of one colour; 0: nothing
 *  is met. */
struct spot {
    enum matter matter;
    int surface;
    vec3 point, normal;
    double albedo;  // of what is matt; sample and things have their materials
    int index;      // of a thing
};

/** STATUS_MEMORY. The scene must outlive the world. */
enum status sam_world_build(struct world *world, const struct scene *scene, struct error *err);
void sam_world_free(struct world *world);
/** The cones from an apex, for rays that pass within `slack` of it. */
struct vantage sam_vantage(const struct world *world, vec3 apex, double slack);
/** The vantage of rays that have no point in common. */
struct vantage sam_vantage_nowhere(void);
/** The first thing that a ray from the vantage's apex meets. */
struct spot sam_spot(const struct world *world, const struct vantage *from, struct ray ray);
/** What a sample or a thing is made of; NULL for what is matt. */
const struct material *sam_spot_material(const struct world *world, const struct spot *spot);
/** May a solid other than `self` stand between a point and the apex, which is in `direction`? */
bool sam_near_solid(const struct world *world, const struct vantage *apex, vec3 direction,
                    enum matter self);
/** Does anything stand on the ray before s = far? Its line passes through the vantage's apex, and
 *  its direction is towards the apex. */
bool sam_blocked(const struct world *world, const struct vantage *apex, struct ray ray, double far);
#endif
