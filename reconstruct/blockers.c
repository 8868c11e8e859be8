/* blockers.c -- segments against the solids that stand in the way.
 *
 * Method.   A cylinder is the meeting of a tube and a slab, a box that of three slabs: of each, the
 *           segment's parameters inside are an interval, and it is blocked where all intervals have
 *           a part in common. A margin makes solids larger: where a photosite's square, or the
 *           lens's blur, may touch their edge.
 */
#include "blockers.h"

#include <stdlib.h>

/** The balls, for which there is room. */
static void add_balls(struct blockers *to, const struct capture *capture,
                      const struct calibration *c)
{
    for (int i = 0; i < (c->balls ? c->balls : capture->balls); i++)
        to->blocker[to->count++] =
            c->balls ? (struct blocker){.center = c->ball[i].center, .radius = c->ball[i].radius}
                     : (struct blocker){.center = capture->ball[i].center,
                                        .radius = capture->ball[i].radius};
}

enum status rec_blockers_make(struct blockers *blockers, const struct capture *capture,
                              const struct calibration *calibration, struct error *err)
{
    struct blockers made = {
        .blocker = calloc((size_t)capture->occluders + BALLS_MAX, sizeof *made.blocker)};
    enum status status =
        made.blocker ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "no memory for occluders");
    for (int i = 0; i < capture->occluders && !status; i++) {
        const struct occluder *of = &capture->occluder[i];
        struct blocker *b = &made.blocker[made.count++];
        b->of = of;
        b->box_from_world = cal_rotation(vec3_scale(of->rotation, -1));
        if (of->shape == OCCLUDER_MESH)
            status = cal_mesh_read(&b->mesh, of->file, 1, (pose){of->rotation, of->center}, err);
    }
    if (!status)
        add_balls(&made, capture, calibration);
    if (status)
        rec_blockers_free(&made);
    else
        *blockers = made;
    return status;
}

void rec_blockers_free(struct blockers *blockers)
{
    for (int i = 0; i < blockers->count; i++)
        cal_mesh_free(blockers->blocker[i].mesh);
    free(blockers->blocker);
    *blockers = (struct blockers){0};
}

/** Parameters of a segment, 0 at its begin and 1 at its end; empty where low > high. */
typedef struct {
    double low, high;
} interval;

// Where from + t step lies in [-half, half].
static interval slab(interval in, double from, double step, double half)
{
    if (step == 0)
        return fabs(from) <= half ? in : (interval){1, 0};
    double s = (-half - from) / step, t = (half - from) / step;
    return (interval){fmax(in.low, fmin(s, t)), fmin(in.high, fmax(s, t))};
}

static bool meets_cylinder(const struct occluder *o, vec3 a, vec3 step, double margin)
{
    vec3 from = vec3_sub(a, o->center);
    double along = vec3_dot(from, o->axis), rise = vec3_dot(step, o->axis);
    interval in = slab((interval){0, 1}, along, rise, o->height / 2 + margin);
    vec3 p = vec3_sub(from, vec3_scale(o->axis, along));
    vec3 d = vec3_sub(step, vec3_scale(o->axis, rise));
    double radius = o->radius + margin, dd = vec3_dot(d, d), pd = vec3_dot(p, d);
    double c = vec3_dot(p, p) - radius * radius;
    if (dd <= 0)
        return c <= 0 && in.low <= in.high;
    double q = pd * pd - dd * c;
    if (q < 0)
        return false;
    return fmax(in.low, (-pd - sqrt(q)) / dd) <= fmin(in.high, (-pd + sqrt(q)) / dd);
}

static bool meets_box(const struct blocker *b, vec3 a, vec3 step, double margin)
{
    vec3 from = mat3_mul(&b->box_from_world, vec3_sub(a, b->of->center));
    vec3 d = mat3_mul(&b->box_from_world, step);
    interval in = slab((interval){0, 1}, from.x, d.x, b->of->size.x / 2 + margin);
    in = slab(in, from.y, d.y, b->of->size.y / 2 + margin);
    in = slab(in, from.z, d.z, b->of->size.z / 2 + margin);
    return in.low <= in.high;
}

static bool meets_ball(const struct blocker *b, vec3 a, vec3 step, double margin)
{
    vec3 to = vec3_sub(b->center, a);
    double along = fmin(fmax(vec3_dot(to, step) / vec3_dot(step, step), 0), 1);
    return vec3_length(vec3_sub(to, vec3_scale(step, along))) <= b->radius + margin;
}

static bool meets_mesh(const struct blocker *b, vec3 a, vec3 step)
{
    double length = vec3_length(step);
    return cal_mesh_meet(b->mesh, a, vec3_scale(step, 1 / length)).s < length;
}

bool rec_blocked(const struct blockers *blockers, vec3 a, vec3 b, double margin)
{
    vec3 step = vec3_sub(b, a);
    bool blocked = false;
    for (int i = 0; i < blockers->count && !blocked; i++) {
        const struct blocker *k = &blockers->blocker[i];
        blocked = !k->of                              ? meets_ball(k, a, step, margin)
                  : k->of->shape == OCCLUDER_CYLINDER ? meets_cylinder(k->of, a, step, margin)
                  : k->of->shape == OCCLUDER_BOX      ? meets_box(k, a, step, margin)
                                                      : meets_mesh(k, a, step);
    }
    return blocked;
}
