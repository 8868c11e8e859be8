/* surface.c -- rays against a sphere and a cylinder, the nearer root of a quadratic; and a mesh.
 *
 * Method.   A cylinder is a circle to what is left of the ray and the eye without what lies along
 *           its axis; of a sphere that is all.
 * Accuracy. q, the discriminant, is a difference of numbers near |eye - center|^2: at a metre its
 *           rounding is 1e-10 mm^2, far below what a photosite spans at the outline.
 */
#include "surface.h"

#include <assert.h>

/** A sphere or cylinder seen from an eye. The caps of a cylinder are not sample, and what enters
 *  through one has not met it. */
struct round_body {
    vec3 axis;               // unit; 0 for a sphere
    vec3 center, m;          // m: from the center to the eye
    vec3 mp;                 // m without what lies along the axis
    double curvature, half;  // 1 / radius; half of the height, or infinity
    double c;                // |mp|^2 - radius^2
};

static struct round_body body_of(const struct sample *s, vec3 eye)
{
    bool cylinder = s->shape == SHAPE_CYLINDER;
    struct round_body b = {
        .center = s->center, .m = vec3_sub(eye, s->center), .curvature = 1 / s->radius};
    if (cylinder)
        b.axis = vec3_normalize(s->axis);
    b.half = cylinder ? s->height / 2 : INFINITY;
    b.mp = vec3_sub(b.m, vec3_scale(b.axis, vec3_dot(b.m, b.axis)));
    b.c = vec3_dot(b.mp, b.mp) - s->radius * s->radius;
    return b;
}

WIDE static void meet_sphere(struct meetings *restrict to, const struct round_body *of,
                             const vec3_lanes *restrict d, lane_span span)
{
    const struct round_body b = *of;
    FOR_LANES (i, span) {
        double slope = d->x[i] * b.m.x + d->y[i] * b.m.y + d->z[i] * b.m.z;
        double q = slope * slope - b.c, s = -slope - sqrt(q > 0 ? q : 0);
        double x = b.m.x + s * d->x[i], y = b.m.y + s * d->y[i], z = b.m.z + s * d->z[i];
        to->hit[i] = ((q > 0) & (slope <= 0)) ? 1 : 0;
        to->point.x[i] = b.center.x + x;
        to->point.y[i] = b.center.y + y;
        to->point.z[i] = b.center.z + z;
        to->normal.x[i] = x * b.curvature;
        to->normal.y[i] = y * b.curvature;
        to->normal.z[i] = z * b.curvature;
    }
}

WIDE static void meet_cylinder(struct meetings *restrict to, const struct round_body *of,
                               const vec3_lanes *restrict d, lane_span span)
{
    const struct round_body b = *of;
    FOR_LANES (i, span) {
        double dx = d->x[i], dy = d->y[i], dz = d->z[i];
        double along = dx * b.axis.x + dy * b.axis.y + dz * b.axis.z;
        double px = dx - along * b.axis.x, py = dy - along * b.axis.y, pz = dz - along * b.axis.z;
        double a = px * px + py * py + pz * pz;
        double slope = px * b.mp.x + py * b.mp.y + pz * b.mp.z;
        double q = slope * slope - a * b.c;
        double s = (-slope - sqrt(q > 0 ? q : 0)) / (a > 0 ? a : 1);
        double x = b.m.x + s * dx, y = b.m.y + s * dy, z = b.m.z + s * dz;
        double up = x * b.axis.x + y * b.axis.y + z * b.axis.z;
        bool met = (q > 0) & (slope <= 0) & (a > 0) & (up <= b.half) & (-up <= b.half);
        to->hit[i] = met ? 1 : 0;
        to->point.x[i] = b.center.x + x;
        to->point.y[i] = b.center.y + y;
        to->point.z[i] = b.center.z + z;
        to->normal.x[i] = (x - up * b.axis.x) * b.curvature;
        to->normal.y[i] = (y - up * b.axis.y) * b.curvature;
        to->normal.z[i] = (z - up * b.axis.z) * b.curvature;
    }
}

void rec_meet_all(struct meetings *m, const struct sample *sample, vec3 eye, const vec3_lanes *ray,
                  lane_span span)
{
    assert(sample->shape != SHAPE_MESH);
    struct round_body body = body_of(sample, eye);
    if (sample->shape == SHAPE_CYLINDER)
        meet_cylinder(m, &body, ray, span);
    else
        meet_sphere(m, &body, ray, span);
}

static meeting meet_mesh(const struct mesh *mesh, vec3 eye, vec3 direction)
{
    mesh_hit hit = cal_mesh_meet(mesh, eye, direction);
    bool met = hit.s < INFINITY;
    return (meeting){met, vec3_add(eye, vec3_scale(direction, met ? hit.s : 0)), hit.normal};
}

meeting rec_meet(const struct sample *sample, vec3 eye, vec3 direction)
{
    struct meetings m;
    vec3_lanes ray;
    if (sample->shape == SHAPE_MESH)
        return meet_mesh(sample->mesh, eye, direction);
    for (int i = 0; i < BLOCK; i++)
        rec_lane_set(&ray, i, direction);
    rec_meet_all(&m, sample, eye, &ray, (lane_span){0, BLOCK});
    return (meeting){m.hit[0] > 0, rec_lane(&m.point, 0), rec_lane(&m.normal, 0)};
}
