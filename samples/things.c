/* things.c -- what stands in a scene besides sample and board: balls, rods, boxes. */
#include "things.h"

#include <string.h>

static const double DEG = CAP_PI / 180;

static void read_rod(struct thing *thing, struct doc *doc, doc_node node, vec3 center)
{
    vec3 axis = sam_doc_vec3(doc, node, "axis", (vec3){0, 0, 1});
    double length = vec3_length(axis);
    if (!(length > 0)) {
        sam_doc_wrong(doc, node, "axis: a direction is wanted");
        length = 1;
    }
    thing->rod = (struct rod){.center = center,
                              .axis = vec3_scale(axis, 1 / length),
                              .radius = sam_doc_number(doc, node, "radius", NAN, 1e-3, 1e5),
                              .half = sam_doc_number(doc, node, "height", NAN, 1e-3, 1e5) / 2};
}

/** A box lies flat, turned about z. */
static void read_box(struct thing *thing, struct doc *doc, doc_node node, vec3 center)
{
    double size[3] = {1, 1, 1}, turn = sam_doc_number(doc, node, "turn_deg", 0, -360, 360) * DEG;
    sam_doc_need(doc, node, "size");
    sam_doc_numbers(doc, node, "size", size, 3, true, 1e-3, 1e5);
    thing->box =
        (struct box){.center = center,
                     .axis = {{cos(turn), sin(turn), 0}, {-sin(turn), cos(turn), 0}, {0, 0, 1}},
                     .half = {size[0] / 2, size[1] / 2, size[2] / 2}};
}

static void read_thing(struct thing *thing, struct doc *doc, doc_node node)
{
    const char *shape = sam_doc_text(doc, node, "shape", NULL);
    sam_doc_need(doc, node, "center");
    vec3 center = sam_doc_vec3(doc, node, "center", (vec3){0, 0, 0});
    if (strcmp(shape, "ball") == 0) {
        thing->shape = THING_BALL;
        thing->rod.center = center;
        thing->rod.radius = sam_doc_number(doc, node, "radius", NAN, 1e-3, 1e5);
    } else if (strcmp(shape, "cylinder") == 0) {
        thing->shape = THING_ROD;
        read_rod(thing, doc, node, center);
    } else if (strcmp(shape, "box") == 0) {
        thing->shape = THING_BOX;
        read_box(thing, doc, node, center);
    } else {
        sam_doc_wrong(doc, node, "shape: ball, cylinder or box, not '%s'", shape);
    }
    sam_read_material(&thing->material, doc, sam_doc_need(doc, node, "material"), true);
}

void sam_read_things(struct things *things, struct doc *doc, doc_node list)
{
    int count = sam_doc_count(doc, list);
    if (count > THINGS_MAX) {
        sam_doc_wrong(doc, list, "things: at most %d", THINGS_MAX);
        return;
    }
    for (int i = 0; i < count; i++)
        read_thing(&things->item[i], doc, sam_doc_item(doc, list, i));
    things->count = count;
}

void sam_things_free(struct things *things)
{
    for (int i = 0; i < things->count; i++)
        sam_material_free(&things->item[i].material);
    *things = (struct things){0};
}

struct crossing sam_cross_thing(struct ray ray, const struct thing *thing, double nearest)
{
    if (thing->shape == THING_BALL)
        return sam_cross_sphere(ray, thing->rod.center, thing->rod.radius, nearest);
    if (thing->shape == THING_ROD)
        return sam_cross_rod(ray, &thing->rod, nearest);
    return sam_cross_box(ray, &thing->box, nearest);
}

void sam_thing_reach(const struct thing *thing, vec3 *center, double *radius)
{
    const double *half = thing->box.half;
    bool box = thing->shape == THING_BOX;
    *center = box ? thing->box.center : thing->rod.center;
    *radius = box ? sqrt(half[0] * half[0] + half[1] * half[1] + half[2] * half[2])
                  : hypot(thing->rod.radius, thing->rod.half);
}
