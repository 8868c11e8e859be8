/* things.h -- what stands in a scene besides sample and board: balls, rods, boxes. */
#ifndef GONIOCAM_SAMPLES_THINGS_H
#define GONIOCAM_SAMPLES_THINGS_H

#include "scene_material.h"
#include "shapes.h"

enum { THINGS_MAX = 16 };
enum thing_shape { THING_BALL, THING_ROD, THING_BOX };

struct thing {
    enum thing_shape shape;
    struct rod rod;  // a ball's middle and radius, too
    struct box box;
    struct material material;
};

/** Things of a scene. Owns their materials; {0} is empty; release with sam_things_free(). */
struct things {
    struct thing item[THINGS_MAX];
    int count;
};

/** Read the list `things`; 0: none. Errors are kept by the document. */
void sam_read_things(struct things *things, struct doc *doc, doc_node list);
void sam_things_free(struct things *things);
struct crossing sam_cross_thing(struct ray ray, const struct thing *thing, double nearest);
/** A ball about a thing. */
void sam_thing_reach(const struct thing *thing, vec3 *center, double *radius);
#endif
