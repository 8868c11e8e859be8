/* world.h -- what a ray of a scene meets, and how much light leaves from there.
 *
 * Light is direct: from the lamp to the surface to the camera, with shadows, without light that
 * surfaces throw on each other.
 */
#ifndef GONIOCAM_SAMPLES_WORLD_H
#define GONIOCAM_SAMPLES_WORLD_H

#include "shapes.h"
#include "scene.h"
#include "tags.h"

enum matter { MATTER_NONE, MATTER_SAMPLE, MATTER_POST, MATTER_PATCH, MATTER_SHEET, MATTER_PAPER };

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
    struct box *slab;     // [scene->patches]
    struct rod post;      // radius 0: none
    struct rod rod;       // the sample, when it is a cylinder
};

/** The lamp as one shot has it. */
struct lighting {
    vec3 position;
    double intensity[3];
};

/** What a ray meets. Spots of one id lie on one smooth surface of one colour. */
struct spot {
    enum matter matter;
    int id;
    vec3 point, normal;
    double albedo;  // of what is matt; the sample has its model
    bool lit;       // the lamp sees it
};

/** STATUS_MEMORY. The scene must outlive the world. */
enum status sam_world_build(struct world *world, const struct scene *scene, struct error *err);
void sam_world_free(struct world *world);
struct lighting sam_lighting(const struct scene *scene, const struct scene_shot *shot);
/** The first thing that a ray meets; MATTER_NONE and id 0: nothing. */
struct spot sam_spot(const struct world *world, struct ray ray, const struct lighting *light);
/** The radiance of a spot towards -view: L = f I cos(theta_i) / r^2, 0 where it is not lit. */
void sam_shade(const struct world *world, const struct spot *spot, const struct lighting *light,
               vec3 view, double rgb[3]);
#endif
