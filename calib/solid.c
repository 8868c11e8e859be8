/* solid.c -- the sample as a solid: where rays meet it, what it hides.
 *
 * Method.   Sphere and cylinder are met at the nearer root of a quadratic, solved about the point
 *           of the ray that is nearest to the centre, so that no square of the viewing distance
 *           cancels; the cylinder's caps are a slab (Kay and Kajiya 1986). Meshes: mesh.c.
 */
#include "solid.h"

static const solid_hit miss = {.s = INFINITY};

/* ---- rays ------------------------------------------------------------------------------------ */

static solid_hit meet_sphere(const struct sample *s, vec3 origin, vec3 direction)
{
    vec3 m = vec3_sub(origin, s->center);
    double middle = -vec3_dot(m, direction);
    vec3 nearest = vec3_add(m, vec3_scale(direction, middle));
    double q = s->radius * s->radius - vec3_dot(nearest, nearest), half = sqrt(fmax(q, 0));
    if (q < 0 || middle <= half)
        return miss;
    vec3 out = vec3_sub(nearest, vec3_scale(direction, half));
    return (solid_hit){middle - half, vec3_normalize(out), false};
}

static solid_hit meet_cylinder(const struct sample *s, vec3 origin, vec3 direction)
{
    vec3 axis = vec3_normalize(s->axis), m = vec3_sub(origin, s->center);
    double along = vec3_dot(direction, axis), start = vec3_dot(m, axis);
    vec3 d = vec3_sub(direction, vec3_scale(axis, along));
    vec3 o = vec3_sub(m, vec3_scale(axis, start));
    double dd = vec3_dot(d, d), middle = dd > 0 ? -vec3_dot(o, d) / dd : 0;
    vec3 nearest = vec3_add(o, vec3_scale(d, middle));
    double q = s->radius * s->radius - vec3_dot(nearest, nearest);
    if (q < 0)
        return miss;
    double half = dd > 0 ? sqrt(q / dd) : INFINITY, entry = middle - half, exit = middle + half;
    bool cap = false;
    if (along != 0) {
        double a = (-s->height / 2 - start) / along, b = (s->height / 2 - start) / along;
        cap = fmin(a, b) > entry;
        entry = fmax(entry, fmin(a, b));
        exit = fmin(exit, fmax(a, b));
    } else if (fabs(start) > s->height / 2) {
        return miss;
    }
    if (entry > exit || entry <= 0)
        return miss;
    vec3 out = vec3_add(nearest, vec3_scale(d, entry - middle));
    return (solid_hit){entry, cap ? vec3_scale(axis, along < 0 ? 1 : -1) : vec3_normalize(out),
                       cap};
}

solid_hit cal_solid_meet(const struct sample *s, vec3 origin, vec3 direction)
{
    switch (s->shape) {
    case SHAPE_SPHERE:
        return meet_sphere(s, origin, direction);
    case SHAPE_CYLINDER:
        return meet_cylinder(s, origin, direction);
    case SHAPE_MESH: {
        mesh_hit hit = cal_mesh_meet(s->mesh, origin, direction);
        return (solid_hit){hit.s, hit.normal, false};
    }
    default:
        return miss;
    }
}

double cal_solid_reach(const struct sample *s)
{
    return s->shape == SHAPE_CYLINDER ? hypot(s->radius, s->height / 2) : s->radius;
}

/* ---- what it hides --------------------------------------------------------------------------- */

static double clamp01(double x)
{
    return fmin(fmax(x, 0), 1);
}

/** Distance between the pieces a + s u and b + t v, s and t in [0, 1] (Ericson 2005, 5.1.9). */
static double between_pieces(vec3 a, vec3 u, vec3 b, vec3 v)
{
    vec3 r = vec3_sub(a, b);
    double uu = vec3_dot(u, u), vv = vec3_dot(v, v), uv = vec3_dot(u, v);
    double ur = vec3_dot(u, r), vr = vec3_dot(v, r), area = uu * vv - uv * uv;
    double s = area > 1e-12 * uu * vv ? clamp01((uv * vr - ur * vv) / area) : 0;
    double t = vv > 0 ? clamp01((uv * s + vr) / vv) : 0;
    s = uu > 0 ? clamp01((uv * t - ur) / uu) : 0;
    return vec3_length(vec3_sub(vec3_add(a, vec3_scale(u, s)), vec3_add(b, vec3_scale(v, t))));
}

/** Does the piece from a to b meet it? Where a lies on the surface, only what is beyond counts. */
static bool meets(const struct sample *s, vec3 a, vec3 b)
{
    vec3 ab = vec3_sub(b, a);
    double length = vec3_length(ab);
    solid_hit hit = cal_solid_meet(s, a, vec3_scale(ab, 1 / length));
    return hit.s > 1e-6 * s->radius && hit.s < length - 1e-6 * s->radius;
}

/** A mesh with a margin: parallel pieces all around. */
static bool mesh_within(const struct sample *s, vec3 a, vec3 b, double margin)
{
    enum { AROUND = 8 };
    vec3 way = vec3_normalize(vec3_sub(b, a));
    vec3 away = fabs(way.x) < 0.8 ? (vec3){1, 0, 0} : (vec3){0, 1, 0};
    vec3 u = vec3_normalize(vec3_cross(way, away)), v = vec3_cross(way, u);
    bool met = meets(s, a, b);
    for (int k = 0; k < AROUND && !met; k++) {
        double turn = 2 * CAP_PI * k / AROUND;
        vec3 by = vec3_add(vec3_scale(u, margin * cos(turn)), vec3_scale(v, margin * sin(turn)));
        met = meets(s, vec3_add(a, by), vec3_add(b, by));
    }
    return met;
}

bool cal_sample_between(const struct sample *s, vec3 a, vec3 b, double margin)
{
    if (s->shape == SHAPE_NONE)
        return false;
    vec3 ab = vec3_sub(b, a), ac = vec3_sub(s->center, a);
    double length = vec3_length(ab), along = fmin(fmax(vec3_dot(ac, ab) / length, 0), length);
    double nearest = vec3_length(vec3_sub(ac, vec3_scale(ab, along / length)));
    if (s->shape == SHAPE_SPHERE || nearest >= cal_solid_reach(s) + margin)
        return nearest < cal_solid_reach(s) + margin;
    if (s->shape == SHAPE_MESH)
        return mesh_within(s, a, b, margin);
    if (margin <= 0)
        return meets(s, a, b);
    vec3 axis = vec3_scale(vec3_normalize(s->axis), s->height);
    vec3 end = vec3_sub(s->center, vec3_scale(axis, 0.5));
    return between_pieces(a, ab, end, axis) < s->radius + margin;
}

/* ---- points on it ---------------------------------------------------------------------------- */

void cal_solid_point(const struct sample *s, int k, vec3 *point, vec3 *normal, double *area)
{
    const double turn = k * 2.399963229728653;  // the golden angle: a Fibonacci spiral
    const double part = (2 * k + 1.0) / SOLID_POINTS - 1;
    if (s->shape == SHAPE_MESH) {
        cal_mesh_point(s->mesh, k, point, normal, area);
    } else if (s->shape == SHAPE_CYLINDER) {
        vec3 axis = vec3_normalize(s->axis);
        vec3 away = fabs(axis.x) < 0.8 ? (vec3){1, 0, 0} : (vec3){0, 1, 0};
        vec3 u = vec3_normalize(vec3_cross(axis, away)), v = vec3_cross(axis, u);
        *normal = vec3_add(vec3_scale(u, cos(turn)), vec3_scale(v, sin(turn)));
        *point = vec3_add(s->center, vec3_add(vec3_scale(*normal, s->radius),
                                              vec3_scale(axis, part * s->height / 2)));
        *area = 2 * CAP_PI * s->radius * s->height / SOLID_POINTS;
    } else {
        double flat = sqrt(1 - part * part);
        *normal = (vec3){flat * cos(turn), flat * sin(turn), -part};
        *point = vec3_add(s->center, vec3_scale(*normal, s->radius));
        *area = 4 * CAP_PI * s->radius * s->radius / SOLID_POINTS;
    }
}

/* ---- moved ----------------------------------------------------------------------------------- */

vec3 cal_rotation_vector(const mat3 *r)
{
    // The quaternion of largest part (Shepperd 1978): exact for small and for half turns.
    const double d[3] = {r->m[0][0], r->m[1][1], r->m[2][2]}, trace = d[0] + d[1] + d[2];
    double q[4];  // w, x, y, z
    int k = d[0] > d[1] ? (d[0] > d[2] ? 0 : 2) : (d[1] > d[2] ? 1 : 2);
    int i = (k + 1) % 3, j = (k + 2) % 3;
    if (trace > d[k]) {
        q[0] = 1 + trace;
        q[1] = r->m[2][1] - r->m[1][2];
        q[2] = r->m[0][2] - r->m[2][0];
        q[3] = r->m[1][0] - r->m[0][1];
    } else {
        q[0] = r->m[j][i] - r->m[i][j];
        q[1 + k] = 1 + d[k] - d[i] - d[j];
        q[1 + i] = r->m[i][k] + r->m[k][i];
        q[1 + j] = r->m[j][k] + r->m[k][j];
    }
    double sign = q[0] < 0 ? -1 : 1;
    vec3 v = vec3_scale((vec3){q[1], q[2], q[3]}, sign);
    double sine = vec3_length(v);
    return sine > 0 ? vec3_scale(v, 2 * atan2(sine, fabs(q[0])) / sine) : v;
}

static mat3 product(const mat3 *a, const mat3 *b)
{
    mat3 c = {{{0}}};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++)
                c.m[i][j] += a->m[i][k] * b->m[k][j];
    return c;
}

enum status cal_solid_move(struct sample *s, vec3 turn, vec3 shift, struct error *err)
{
    mat3 r = cal_rotation(turn);
    enum status status = STATUS_OK;
    if (s->shape == SHAPE_CYLINDER)
        s->axis = vec3_normalize(mat3_mul(&r, s->axis));
    if (s->shape == SHAPE_MESH) {
        pose *at = &s->world_from_file;
        mat3 file = cal_rotation(at->rotation), both = product(&r, &file);
        vec3 from_center = vec3_sub(at->translation, s->center);
        status = cal_mesh_turn(s->mesh, &r, err);
        at->rotation = cal_rotation_vector(&both);
        at->translation = vec3_add(vec3_add(s->center, mat3_mul(&r, from_center)), shift);
        cal_mesh_move(s->mesh, shift);
    }
    s->center = vec3_add(s->center, shift);
    return status;
}

enum status cal_solid_return(struct sample *s, const struct sample *to, struct error *err)
{
    enum status status = STATUS_OK;
    if (s->shape == SHAPE_MESH) {
        mat3 is = cal_rotation(s->world_from_file.rotation), back;
        mat3 wanted = cal_rotation(to->world_from_file.rotation);
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                back.m[i][j] = is.m[j][i];
        back = product(&wanted, &back);
        status =
            cal_solid_move(s, cal_rotation_vector(&back), vec3_sub(to->center, s->center), err);
    }
    if (!status)
        *s = *to;
    return status;
}
