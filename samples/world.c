/* world.c -- what a ray of a scene meets. */
#include "world.h"

#include <assert.h>
#include <stdlib.h>

// A ray that leaves a surface starts this far (mm) from it: well above the rounding of points some
// metres away (1e-12 mm), far below what a photograph shows.
static const double CLEAR = 1e-7;

// ---- making ready

static struct box slab_of(const struct scene_patch *patch)
{
    const vec3 *corner = patch->patch.corner;
    vec3 x = vec3_sub(corner[1], corner[0]), y = vec3_sub(corner[3], corner[0]);
    double width = vec3_length(x), height = vec3_length(y);
    x = vec3_normalize(x);
    y = vec3_normalize(y);
    vec3 z = vec3_normalize(vec3_cross(x, y));
    vec3 middle = vec3_scale(vec3_add(corner[0], corner[2]), 0.5);
    return (struct box){
        .center = vec3_sub(middle, vec3_scale(z, patch->thickness / 2)),
        .axis = {x, y, z},
        .half = {width / 2, height / 2, patch->thickness / 2},
    };
}

/** From the sheet up to the middle of the sample, which hides its end. */
static struct rod post_of(const struct scene *scene)
{
    vec3 top = scene->sample.place.center;
    double low = -scene->board.thickness;
    return (struct rod){.center = {top.x, top.y, (top.z + low) / 2},
                        .axis = {0, 0, 1},
                        .radius = scene->post.radius,
                        .half = (top.z - low) / 2};
}

static bool same_plane(const struct paper_plane *plane, const struct tag_place *tag, vec3 normal)
{
    double off = vec3_dot(vec3_sub(tag->center, plane->origin), plane->normal);
    return vec3_dot(normal, plane->normal) > 1 - 1e-12 && fabs(off) < 1e-9;
}

/** A square that is turned in its plane reaches further along the axes than its half side. */
static struct paper paper_of(const struct paper_plane *plane, const struct tag_place *tag,
                             double margin)
{
    vec3 d = vec3_sub(tag->center, plane->origin);
    double turn = fabs(vec3_dot(tag->x_axis, plane->x)) + fabs(vec3_dot(tag->x_axis, plane->y));
    return (struct paper){vec3_dot(d, plane->x), vec3_dot(d, plane->y),
                          (tag->size / 2 + margin) * turn * (1 + 1e-12)};
}

/** Neighbours in the list that share a plane are met by one crossing. */
static void find_planes(struct world *world)
{
    const struct scene_board *board = &world->scene->board;
    for (int i = 0; i < board->tags; i++) {
        const struct tag_place *tag = &board->tag[i];
        vec3 normal = vec3_cross(tag->x_axis, tag->y_axis);
        if (!world->planes || !same_plane(&world->plane[world->planes - 1], tag, normal))
            world->plane[world->planes++] =
                (struct paper_plane){tag->center, tag->x_axis, tag->y_axis, normal, i, 0};
        struct paper_plane *last = &world->plane[world->planes - 1];
        last->count++;
        world->paper[i] = paper_of(last, tag, board->margin);
    }
}

enum status sam_world_build(struct world *world, const struct scene *scene, struct error *err)
{
    const struct sample_place *place = &scene->sample.place;
    struct world built = {.scene = scene};
    built.plane = calloc((size_t)scene->board.tags + 1, sizeof *built.plane);
    built.paper = calloc((size_t)scene->board.tags + 1, sizeof *built.paper);
    if (!built.plane || !built.paper || !sam_tag_family(&built.family, scene->board.family)) {
        sam_world_free(&built);
        return cap_fail(err, STATUS_MEMORY, "%s: out of memory", scene->name);
    }
    find_planes(&built);
    for (int i = 0; i < scene->patches; i++)
        built.slab[i] = slab_of(&scene->patch[i]);
    built.post = post_of(scene);
    built.rod = (struct rod){.center = place->center,
                             .axis = place->axis,
                             .radius = place->radius,
                             .half = place->height / 2};
    *world = built;
    return STATUS_OK;
}

void sam_world_free(struct world *world)
{
    free(world->plane);
    free(world->paper);
    sam_tag_family_free(&world->family);
    *world = (struct world){0};
}

// ---- cones that solids fill

/** The cone of a ball about a solid. From within, it is all directions. */
static struct cone cone_of(vec3 apex, vec3 center, double radius)
{
    vec3 to = vec3_sub(center, apex);
    double distance = vec3_length(to), sine = radius * (1 + 1e-9) / distance;
    if (!(sine < 1))
        return (struct cone){.cosine = -2};
    return (struct cone){vec3_scale(to, 1 / distance), sqrt(1 - sine * sine) - 1e-12};
}

struct vantage sam_vantage(const struct world *world, vec3 apex, double slack)
{
    const struct sample_place *place = &world->scene->sample.place;
    const struct rod *post = &world->post;
    struct vantage v;
    v.sample = cone_of(apex, place->center, hypot(place->radius, place->height / 2) + slack);
    v.post = cone_of(apex, post->center, hypot(post->radius, post->half) + slack);
    if (post->radius == 0)
        v.post.cosine = 2;  // no direction
    for (int i = 0; i < world->scene->patches; i++) {
        const double *half = world->slab[i].half;
        v.slab[i] =
            cone_of(apex, world->slab[i].center,
                    sqrt(half[0] * half[0] + half[1] * half[1] + half[2] * half[2]) + slack);
    }
    for (int i = 0; i < world->scene->things.count; i++) {
        vec3 center;
        double radius;
        sam_thing_reach(&world->scene->things.item[i], &center, &radius);
        v.thing[i] = cone_of(apex, center, radius + slack);
    }
    return v;
}

struct vantage sam_vantage_nowhere(void)
{
    struct vantage v = {.sample = {.cosine = -2}, .post = {.cosine = -2}};
    for (int i = 0; i < PATCHES_MAX; i++)
        v.slab[i].cosine = -2;
    for (int i = 0; i < THINGS_MAX; i++)
        v.thing[i].cosine = -2;
    return v;
}

/** sign 1: the ray leaves the apex; -1: it runs towards it. */
static bool may_meet(const struct cone *cone, vec3 direction, double sign)
{
    return sign * vec3_dot(cone->axis, direction) >= cone->cosine;
}

// ---- solids: sample, post, patches

static struct crossing cross_sample(const struct world *world, struct ray ray)
{
    const struct sample_place *place = &world->scene->sample.place;
    if (place->shape == SHAPE_MESH) {
        mesh_hit hit = cal_mesh_meet(world->scene->sample.mesh, ray.origin, ray.direction);
        return (struct crossing){.s = hit.s, .normal = hit.normal};
    }
    if (place->shape == SHAPE_SPHERE)
        return sam_cross_sphere(ray, place->center, place->radius, CLEAR);
    return sam_cross_rod(ray, &world->rod, CLEAR);
}

/** The tag whose paper holds the point where the ray meets the plane; -1: none. *white says what
 *  is printed there. */
static int find_paper(const struct world *world, const struct paper_plane *plane, vec3 point,
                      bool *white)
{
    const struct scene_board *board = &world->scene->board;
    vec3 in_plane = vec3_sub(point, plane->origin);
    double plane_x = vec3_dot(in_plane, plane->x), plane_y = vec3_dot(in_plane, plane->y);
    for (int i = plane->first; i < plane->first + plane->count; i++) {
        const struct paper *paper = &world->paper[i];
        if (fabs(plane_x - paper->x) > paper->reach || fabs(plane_y - paper->y) > paper->reach)
            continue;
        const struct tag_place *tag = &board->tag[i];
        vec3 d = vec3_sub(point, tag->center);
        double x = vec3_dot(d, tag->x_axis), y = vec3_dot(d, tag->y_axis);
        double half = tag->size / 2 + board->margin;
        if (fabs(x) > half || fabs(y) > half)
            continue;
        double bits = world->family.border / tag->size;
        *white = sam_tag_white(&world->family, tag->id, x * bits, y * bits);
        return i;
    }
    return -1;
}

/** Where the ray meets the sheet, or INFINITY. */
static double cross_sheet(const struct world *world, struct ray ray)
{
    const struct scene_board *board = &world->scene->board;
    double s = sam_cross_plane(ray, (vec3){0, 0, -board->thickness}, (vec3){0, 0, 1}, CLEAR);
    if (s == INFINITY)
        return s;
    vec3 p = sam_at(ray, s);
    return fabs(p.x) <= board->size[0] / 2 && fabs(p.y) <= board->size[1] / 2 ? s : INFINITY;
}

bool sam_near_solid(const struct world *world, const struct vantage *apex, vec3 direction,
                    enum matter self)
{
    bool near = (self != MATTER_SAMPLE && may_meet(&apex->sample, direction, -1))
                || may_meet(&apex->post, direction, -1);
    for (int i = 0; i < world->scene->patches && !near; i++)
        near = may_meet(&apex->slab[i], direction, -1);
    for (int i = 0; i < world->scene->things.count && !near; i++)
        near = may_meet(&apex->thing[i], direction, -1);
    return near;
}

static bool papers_block(const struct world *world, struct ray ray, double far)
{
    for (int i = 0; i < world->planes; i++) {
        const struct paper_plane *plane = &world->plane[i];
        double s = sam_cross_plane(ray, plane->origin, plane->normal, CLEAR);
        bool white;
        if (s < far && find_paper(world, plane, sam_at(ray, s), &white) >= 0)
            return true;
    }
    return false;
}

bool sam_blocked(const struct world *world, const struct vantage *apex, struct ray ray, double far)
{
    if (may_meet(&apex->sample, ray.direction, -1) && cross_sample(world, ray).s < far)
        return true;
    if (may_meet(&apex->post, ray.direction, -1) && world->post.radius > 0
        && sam_cross_rod(ray, &world->post, CLEAR).s < far)
        return true;
    for (int i = 0; i < world->scene->patches; i++)
        if (may_meet(&apex->slab[i], ray.direction, -1)
            && sam_cross_box(ray, &world->slab[i], CLEAR).s < far)
            return true;
    for (int i = 0; i < world->scene->things.count; i++)
        if (may_meet(&apex->thing[i], ray.direction, -1)
            && sam_cross_thing(ray, &world->scene->things.item[i], CLEAR).s < far)
            return true;
    return papers_block(world, ray, far) || cross_sheet(world, ray) < far;
}

// ---- the first thing on a ray

/** The nearest crossing so far, and what it belongs to. */
struct nearest {
    struct crossing crossing;
    enum matter matter;
    int index, white;
    double albedo;
};

static void keep(struct nearest *nearest, struct crossing c, enum matter matter, int index,
                 double albedo)
{
    if (c.s < nearest->crossing.s)
        *nearest = (struct nearest){c, matter, index, 0, albedo};
}

static void meet_papers(const struct world *world, struct ray ray, struct nearest *nearest)
{
    const struct scene_board *board = &world->scene->board;
    for (int i = 0; i < world->planes; i++) {
        const struct paper_plane *plane = &world->plane[i];
        struct crossing c = {.normal = plane->normal};
        c.s = sam_cross_plane(ray, plane->origin, plane->normal, CLEAR);
        bool white = true;
        if (c.s < nearest->crossing.s && find_paper(world, plane, sam_at(ray, c.s), &white) >= 0) {
            keep(nearest, c, MATTER_PAPER, i, white ? board->white : board->black);
            nearest->white = white;
        }
    }
}

struct spot sam_spot(const struct world *world, const struct vantage *from, struct ray ray)
{
    const struct scene *scene = world->scene;
    struct nearest n = {.crossing = {.s = INFINITY}};
    if (may_meet(&from->sample, ray.direction, 1))
        keep(&n, cross_sample(world, ray), MATTER_SAMPLE, 0, 0);
    if (may_meet(&from->post, ray.direction, 1) && world->post.radius > 0)
        keep(&n, sam_cross_rod(ray, &world->post, CLEAR), MATTER_POST, 0, scene->post.albedo);
    for (int i = 0; i < scene->patches; i++)
        if (may_meet(&from->slab[i], ray.direction, 1))
            keep(&n, sam_cross_box(ray, &world->slab[i], CLEAR), MATTER_PATCH, i,
                 scene->patch[i].patch.albedo);
    for (int i = 0; i < scene->things.count; i++)
        if (may_meet(&from->thing[i], ray.direction, 1))
            keep(&n, sam_cross_thing(ray, &scene->things.item[i], CLEAR), MATTER_THING, i, 0);
    meet_papers(world, ray, &n);
    struct crossing sheet = {.s = cross_sheet(world, ray), .normal = {0, 0, 1}};
    keep(&n, sheet, MATTER_SHEET, 0, scene->board.albedo);
    if (n.matter == MATTER_NONE)
        return (struct spot){0};
    int surface = (((int)n.matter * 1000 + n.index) * 8 + n.crossing.face) * 2 + n.white;
    return (struct spot){n.matter,          surface,  sam_at(ray, n.crossing.s),
                         n.crossing.normal, n.albedo, n.index};
}

const struct material *sam_spot_material(const struct world *world, const struct spot *spot)
{
    if (spot->matter == MATTER_THING)
        return &world->scene->things.item[spot->index].material;
    return spot->matter == MATTER_SAMPLE ? &world->scene->sample.material : NULL;
}
