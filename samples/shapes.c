/* shapes.c -- rays against sphere, cylinder, box and plane.
 *
 * Method.   Each solid is the part of the ray between an entry and an exit: the roots of a
 *           quadratic for the curved ones, slabs (Kay and Kajiya 1986) for flat pairs. The entry is
 *           taken when it lies ahead, else the exit: a ray that starts inside meets the far wall.
 * Accuracy. The quadratic is solved about the point of the ray nearest to the centre, so no
 *           square of the viewing distance cancels: a hit at 1000 mm is good to about 1e-12 mm,
 *           where q = (m.d)^2 - m.m + R^2 would keep 1e-9.
 */
#include "shapes.h"

#include <assert.h>

static const struct crossing miss = {.s = INFINITY};

/** What a ray has in common with a solid: entry <= exit, or none when entry > exit. */
struct span {
    double entry, exit;
    int entry_face, exit_face;
};

struct crossing sam_cross_sphere(struct ray ray, vec3 center, double radius, double nearest)
{
    vec3 m = vec3_sub(ray.origin, center);
    double middle = -vec3_dot(m, ray.direction);
    vec3 closest = vec3_add(m, vec3_scale(ray.direction, middle));
    double q = radius * radius - vec3_dot(closest, closest);
    if (q < 0)
        return miss;
    double half = sqrt(q);
    double s = middle - half > nearest ? middle - half : middle + half;
    if (s <= nearest)
        return miss;
    vec3 from_center = vec3_add(closest, vec3_scale(ray.direction, s - middle));
    return (struct crossing){.s = s, .normal = vec3_normalize(from_center)};
}

/** Narrow the span to the slab |p.axis| <= half. */
static void cut_by_slab(struct span *span, double start, double slope, double half, int face)
{
    if (slope == 0) {
        if (fabs(start) > half)
            span->exit = -INFINITY;
        return;
    }
    double at_low = (-half - start) / slope, at_high = (half - start) / slope;
    double entry = fmin(at_low, at_high), exit = fmax(at_low, at_high);
    if (entry > span->entry) {
        span->entry = entry;
        span->entry_face = slope > 0 ? face : face + 1;
    }
    if (exit < span->exit) {
        span->exit = exit;
        span->exit_face = slope > 0 ? face + 1 : face;
    }
}

/** The crossing of a span that lies ahead: s and face, the normal left to the caller. */
static struct crossing ahead(const struct span *span, double nearest)
{
    struct crossing c = miss;
    if (span->entry > span->exit || span->exit <= nearest)
        return c;
    bool enters = span->entry > nearest;
    c.s = enters ? span->entry : span->exit;
    c.face = enters ? span->entry_face : span->exit_face;
    return c;
}

struct crossing sam_cross_rod(struct ray ray, const struct rod *rod, double nearest)
{
    vec3 m = vec3_sub(ray.origin, rod->center);
    double along = vec3_dot(ray.direction, rod->axis), start = vec3_dot(m, rod->axis);
    vec3 d = vec3_sub(ray.direction, vec3_scale(rod->axis, along));
    vec3 o = vec3_sub(m, vec3_scale(rod->axis, start));
    double dd = vec3_dot(d, d), middle = dd > 0 ? -vec3_dot(o, d) / dd : 0;
    vec3 closest = vec3_add(o, vec3_scale(d, middle));
    double q = rod->radius * rod->radius - vec3_dot(closest, closest);
    if (q < 0)
        return miss;
    double half = dd > 0 ? sqrt(q / dd) : INFINITY;  // along the axis: only the caps bound it
    struct span span = {.entry = middle - half, .exit = middle + half};
    cut_by_slab(&span, start, along, rod->half, 1);
    struct crossing c = ahead(&span, nearest);
    if (c.s == INFINITY)
        return miss;
    if (c.face)
        c.normal = vec3_scale(rod->axis, c.face == 2 ? 1 : -1);
    else
        c.normal = vec3_normalize(vec3_add(closest, vec3_scale(d, c.s - middle)));
    return c;
}

struct crossing sam_cross_box(struct ray ray, const struct box *box, double nearest)
{
    vec3 m = vec3_sub(ray.origin, box->center);
    struct span span = {.entry = -INFINITY, .exit = INFINITY};
    for (int k = 0; k < 3; k++)
        cut_by_slab(&span, vec3_dot(m, box->axis[k]), vec3_dot(ray.direction, box->axis[k]),
                    box->half[k], 2 * k);
    struct crossing c = ahead(&span, nearest);
    if (c.s < INFINITY)
        c.normal = vec3_scale(box->axis[c.face / 2], c.face % 2 ? 1 : -1);
    return c;
}

double sam_cross_plane(struct ray ray, vec3 point, vec3 normal, double nearest)
{
    double slope = vec3_dot(ray.direction, normal);
    if (slope == 0)
        return INFINITY;
    double s = vec3_dot(vec3_sub(point, ray.origin), normal) / slope;
    return s > nearest ? s : INFINITY;
}

void sam_frame(vec3 z, vec3 *x, vec3 *y)
{
    double sign = copysign(1, z.z), a = -1 / (sign + z.z), b = z.x * z.y * a;
    *x = (vec3){1 + sign * z.x * z.x * a, sign * b, -sign * z.x};
    *y = (vec3){b, sign + z.y * z.y * a, -z.y};
}
