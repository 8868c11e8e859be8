/* raster.c -- a view of a mesh.
 *
 * Method.   One ray a photosite, and one from where it meets the mesh to the lamp. What a photosite
 *           spans is told by its neighbours: derivatives of place and normal are half of the
 *           difference between the next photosites each way (H. Igehy, "Tracing Ray Differentials",
 *           SIGGRAPH 1999, by differences). So a facet's smooth normals are as smooth as they are,
 *           and no ray more is traced.
 * Edges.    A neighbour lies on the same piece of surface where the way to it keeps near the
 *           tangent plane and its normal near the photosite's own: what does not is past an
 *           outline, before or behind, or over a crease. A photosite with such a neighbour is left
 *           out, or with one as far as what it has a part of (raster_spread.c).
 * Accuracy. Derivatives err by a sixth of the third ones; places by 1e-7 of the mesh's radius.
 */
#include "raster.h"

#include <stdlib.h>

static const double steep = 0.71;   // of the way to a neighbour, off the mean tangent plane
static const double crease = 0.87;  // cosine of the largest turn, 30 degrees, to a neighbour

// The ways to the lamp, unit, from places on the mesh, and how far it is; of those that it may
// light.
struct to_lamp {
    vec3 from[MESH_RAYS], way[MESH_RAYS];
    double far[MESH_RAYS];
    int of[MESH_RAYS], count;  // which ray it was
};

static void add_way(struct to_lamp *to, const struct viewing *v, vec3 point, vec3 normal, int of)
{
    vec3 way = v->lamp->at_infinity ? v->lamp->direction : vec3_sub(v->lamp_position, point);
    double distance = vec3_length(way);
    if (vec3_dot(way, normal) <= 0)
        return;  // dark, for a better reason than a shadow
    to->from[to->count] = point;
    to->way[to->count] = vec3_scale(way, 1 / distance);
    to->far[to->count] = v->lamp->at_infinity ? INFINITY : distance;
    to->of[to->count++] = of;
}

// Where rays beside each other meet the mesh, into the planes.
static void look(const struct raster *r, size_t at, const struct viewing *v, const vec3 *ray,
                 int count)
{
    vec3 eye[MESH_RAYS];
    mesh_hit hit[MESH_RAYS];
    struct to_lamp to = {.count = 0};
    for (int i = 0; i < count; i++)
        eye[i] = v->eye;
    cal_mesh_meet_all(hit, v->sample->mesh, eye, ray, count);
    for (int i = 0; i < count; i++) {
        if (!(hit[i].s < INFINITY))
            continue;
        vec3 point = vec3_add(v->eye, vec3_scale(ray[i], hit[i].s)), n = hit[i].normal;
        vec3 p = vec3_sub(point, v->sample->center);
        const double told[6] = {p.x, p.y, p.z, n.x, n.y, n.z};
        for (int k = 0; k < 6; k++)
            r->plane[RASTER_POINT + k][at + (size_t)i] = (float)told[k];
        r->plane[RASTER_HIT][at + (size_t)i] = 1;
        add_way(&to, v, point, n, i);
    }
    if (to.count > 0)
        cal_mesh_meet_all(hit, v->sample->mesh, to.from, to.way, to.count);
    for (int i = 0; i < to.count; i++)
        r->plane[RASTER_SHADOWED][at + (size_t)to.of[i]] = hit[i].s < to.far[i] ? 1 : 0;
}

// A strip's photosites [from, to).
static void look_along(const struct raster *r, const struct viewing *v, int x0, int y, int from,
                       int to)
{
    struct lens_row lens;
    vec3 ray[MESH_RAYS];
    rec_lens_row(&lens, v->lens, x0, y);
    for (int begin = from; begin < to; begin += MESH_RAYS) {
        const int count = to - begin < MESH_RAYS ? to - begin : MESH_RAYS;
        for (int i = 0; i < count; i++) {
            vec3 way = {lens.at[0][begin + i], lens.at[1][begin + i], 1};
            ray[i] = vec3_normalize(mat3_mul_t(&v->view_from_world, way));
        }
        const size_t row = (size_t)(y - r->y0) * (size_t)r->columns;
        look(r, row + (size_t)(x0 + begin - r->x0), v, ray, count);
    }
}

enum status rec_raster_make(struct raster *raster, const struct viewing *v, pixel_box box,
                            struct error *err)
{
    if (box.x1 <= box.x0 || box.y1 <= box.y0)
        return STATUS_OK;
    const int first = box.x0 / LANES, strips = (box.x1 - 1) / LANES - first + 1;
    struct raster r = {.x0 = first * LANES - 1,
                       .y0 = box.y0 - 1,
                       .columns = strips * LANES + 2,
                       .rows = box.y1 - box.y0 + 2};
    const size_t cells = (size_t)r.columns * (size_t)r.rows;
    float *planes = calloc(RASTER_PLANES * cells, sizeof *planes);
    if (!planes)
        return cap_fail(err, STATUS_MEMORY, "no memory for %d x %d rays", r.columns, r.rows);
    for (int k = 0; k < RASTER_PLANES; k++)
        r.plane[k] = planes + (size_t)k * cells;
    for (int y = box.y0; y < box.y1; y++)
        for (int x0 = first * LANES; x0 < box.x1; x0 += LANES)
            look_along(&r, v, x0, y, x0 < box.x0 ? box.x0 - x0 : 0,
                       box.x1 - x0 < LANES ? box.x1 - x0 : LANES);
    enum status status = rec_raster_spread(&r, v, box, err);
    if (status)
        rec_raster_free(&r);
    else
        *raster = r;
    return status;
}

void rec_raster_free(struct raster *raster)
{
    free(raster->plane[0]);
    *raster = (struct raster){0};
}

/** The planes of a strip from its first lane on. */
struct raster_row {
    const float *p[3], *n[3], *hit, *shadowed, *rim, *dusk;
};

static struct raster_row row_of(const struct raster *r, int x0, int y)
{
    const size_t at = (size_t)(y - r->y0) * (size_t)r->columns + (size_t)(x0 - r->x0);
    struct raster_row row = {.hit = r->plane[RASTER_HIT] + at,
                             .shadowed = r->plane[RASTER_SHADOWED] + at,
                             .rim = r->plane[RASTER_RIM] + at,
                             .dusk = r->plane[RASTER_DUSK] + at};
    for (int k = 0; k < 3; k++) {
        row.p[k] = r->plane[RASTER_POINT + k] + at;
        row.n[k] = r->plane[RASTER_NORMAL + k] + at;
    }
    return row;
}

WIDE static void take_own(struct patches *restrict to, const struct raster_row *row, vec3 center,
                          lane_span span)
{
    const float *px = row->p[0], *py = row->p[1], *pz = row->p[2];
    const float *nx = row->n[0], *ny = row->n[1], *nz = row->n[2];
    const float *hit = row->hit, *shadowed = row->shadowed, *rim = row->rim, *dusk = row->dusk;
    FOR_LANES (i, span) {
        to->center.point.x[i] = center.x + (double)px[i];
        to->center.point.y[i] = center.y + (double)py[i];
        to->center.point.z[i] = center.z + (double)pz[i];
        to->center.normal.x[i] = (double)nx[i];
        to->center.normal.y[i] = (double)ny[i];
        to->center.normal.z[i] = (double)nz[i];
        to->center.hit[i] = (double)hit[i];
        to->shadowed[i] = (double)shadowed[i];
        to->rim[i] = (double)rim[i];
        to->dusk[i] = shadowed[i] > dusk[i] ? (double)shadowed[i] : (double)dusk[i];
        to->curvature[i] = 0;
    }
}

// The neighbour `step` cells on: is it of the same piece, and in shadow? Lengths are compared by
// their squares; m is twice the mean normal.
WIDE static void compare(struct patches *restrict to, const struct raster_row *row, ptrdiff_t step,
                         lane_span span)
{
    const float *px = row->p[0], *py = row->p[1], *pz = row->p[2];
    const float *nx = row->n[0], *ny = row->n[1], *nz = row->n[2];
    const float *hit = row->hit + step, *shadowed = row->shadowed + step;
    const float least = (float)crease, most = (float)(steep * steep);
    FOR_LANES (i, span) {
        float ax = nx[i], ay = ny[i], az = nz[i];
        float bx = nx[i + step], by = ny[i + step], bz = nz[i + step];
        float mx = ax + bx, my = ay + by, mz = az + bz;
        float wx = px[i + step] - px[i], wy = py[i + step] - py[i], wz = pz[i + step] - pz[i];
        float along = wx * mx + wy * my + wz * mz;
        float bound = most * (wx * wx + wy * wy + wz * wz) * (mx * mx + my * my + mz * mz);
        bool same = (hit[i] > 0) & (ax * bx + ay * by + az * bz > least) & (along * along <= bound);
        to->rim[i] = same ? to->rim[i] : 1;
        to->dusk[i] = (same & (shadowed[i] > 0)) ? 1 : to->dusk[i];
    }
}

// Half of the difference of the neighbours each way, `step` cells off, k: 0 x, 1 y; 0 where one of
// the eight around is past an edge.
WIDE static void differ(struct patches *restrict to, const struct raster_row *row, ptrdiff_t step,
                        int k, lane_span span)
{
    const float *px = row->p[0], *py = row->p[1], *pz = row->p[2];
    const float *nx = row->n[0], *ny = row->n[1], *nz = row->n[2];
    vec3_lanes *restrict point = &to->point_by[k], *restrict normal = &to->normal_by[k];
    FOR_LANES (i, span) {
        double half = ((to->rim[i] > 0) | !(to->center.hit[i] > 0)) ? 0 : 0.5;
        double x = half * ((double)px[i + step] - (double)px[i - step]);
        double y = half * ((double)py[i + step] - (double)py[i - step]);
        double z = half * ((double)pz[i + step] - (double)pz[i - step]);
        double u = half * ((double)nx[i + step] - (double)nx[i - step]);
        double v = half * ((double)ny[i + step] - (double)ny[i - step]);
        double w = half * ((double)nz[i + step] - (double)nz[i - step]);
        double length2 = x * x + y * y + z * z, turn2 = u * u + v * v + w * w;
        double curvature = sqrt(turn2 / (length2 > 1e-24 ? length2 : 1e-24));
        point->x[i] = x;
        point->y[i] = y;
        point->z[i] = z;
        normal->x[i] = u;
        normal->y[i] = v;
        normal->z[i] = w;
        to->curvature[i] = curvature > to->curvature[i] ? curvature : to->curvature[i];
    }
}

// A ray that meets nothing has no edges.
WIDE static void forget_missed(struct patches *to, lane_span span)
{
    FOR_LANES (i, span) {
        to->rim[i] = to->center.hit[i] > 0 ? to->rim[i] : 0;
        to->dusk[i] = to->center.hit[i] > 0 ? to->dusk[i] : 0;
    }
}

void rec_raster_patches(struct patches *to, const struct raster *r, const struct viewing *v, int x0,
                        int y, lane_span span)
{
    const struct raster_row row = row_of(r, x0, y);
    take_own(to, &row, v->sample->center, span);
    for (int k = 0; k < 9; k++)
        if (k != 4)
            compare(to, &row, (ptrdiff_t)(k / 3 - 1) * r->columns + k % 3 - 1, span);
    differ(to, &row, 1, 0, span);
    differ(to, &row, r->columns, 1, span);
    forget_missed(to, span);
}

WIDE void rec_patches_meet(struct meetings *m, const struct patches *p, double du, double dv,
                           lane_span span)
{
    FOR_LANES (i, span) {
        double x = p->center.normal.x[i] + du * p->normal_by[0].x[i] + dv * p->normal_by[1].x[i];
        double y = p->center.normal.y[i] + du * p->normal_by[0].y[i] + dv * p->normal_by[1].y[i];
        double z = p->center.normal.z[i] + du * p->normal_by[0].z[i] + dv * p->normal_by[1].z[i];
        double length2 = x * x + y * y + z * z, s = 1 / sqrt(length2 > 0 ? length2 : 1);
        m->hit[i] = p->center.hit[i];
        m->normal.x[i] = s * x;
        m->normal.y[i] = s * y;
        m->normal.z[i] = s * z;
        m->point.x[i] = p->center.point.x[i] + du * p->point_by[0].x[i] + dv * p->point_by[1].x[i];
        m->point.y[i] = p->center.point.y[i] + du * p->point_by[0].y[i] + dv * p->point_by[1].y[i];
        m->point.z[i] = p->center.point.z[i] + du * p->point_by[0].z[i] + dv * p->point_by[1].z[i];
    }
}
