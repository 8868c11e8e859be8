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
 *           out.
 * Accuracy. Derivatives err by a sixth of the third ones; places by 1e-7 of the mesh's radius.
 */
#include "raster.h"

#include <stdlib.h>

static const double steep = 0.71;   // of the way to a neighbour, off the mean tangent plane
static const double crease = 0.87;  // cosine of the largest turn, 30 degrees, to a neighbour

static bool in_shadow(const struct viewing *v, vec3 point, vec3 normal)
{
    vec3 way = v->lamp->at_infinity ? v->lamp->direction : vec3_sub(v->lamp_position, point);
    double distance = vec3_length(way);
    way = vec3_scale(way, 1 / distance);
    if (vec3_dot(way, normal) <= 0)
        return false;  // dark, for a better reason
    double far = v->lamp->at_infinity ? INFINITY : distance;
    return cal_mesh_meet(v->sample->mesh, point, way).s < far;
}

static struct raster_cell look(const struct viewing *v, vec3 ray)
{
    struct raster_cell cell = {0};
    mesh_hit hit = cal_mesh_meet(v->sample->mesh, v->eye, ray);
    if (!(hit.s < INFINITY))
        return cell;
    vec3 point = vec3_add(v->eye, vec3_scale(ray, hit.s));
    vec3 from = vec3_sub(point, v->sample->center);
    const double p[3] = {from.x, from.y, from.z}, n[3] = {hit.normal.x, hit.normal.y, hit.normal.z};
    for (int k = 0; k < 3; k++) {
        cell.point[k] = (float)p[k];
        cell.normal[k] = (float)n[k];
    }
    cell.hit = true;
    cell.shadowed = in_shadow(v, point, hit.normal);
    return cell;
}

enum status rec_raster_make(struct raster *raster, const struct viewing *v, pixel_box box,
                            struct error *err)
{
    struct raster r = {.x0 = box.x0 - 1,
                       .y0 = box.y0 - 1,
                       .columns = box.x1 - box.x0 + 2,
                       .rows = box.y1 - box.y0 + 2};
    if (box.x1 <= box.x0 || box.y1 <= box.y0)
        return STATUS_OK;
    r.cell = calloc((size_t)r.columns * (size_t)r.rows, sizeof *r.cell);
    if (!r.cell)
        return cap_fail(err, STATUS_MEMORY, "no memory for %d x %d rays", r.columns, r.rows);
    for (int y = box.y0; y < box.y1; y++)
        for (int x0 = box.x0 / LANES * LANES; x0 < box.x1; x0 += LANES) {
            struct lens_row lens;
            rec_lens_row(&lens, v->lens, x0, y);
            for (int x = x0 > box.x0 ? x0 : box.x0; x < x0 + LANES && x < box.x1; x++) {
                vec3 ray = {lens.at[0][x - x0], lens.at[1][x - x0], 1};
                ray = vec3_normalize(mat3_mul_t(&v->view_from_world, ray));
                r.cell[(size_t)(y - r.y0) * (size_t)r.columns + (size_t)(x - r.x0)] = look(v, ray);
            }
        }
    *raster = r;
    return STATUS_OK;
}

void rec_raster_free(struct raster *raster)
{
    free(raster->cell);
    *raster = (struct raster){0};
}

static const struct raster_cell *cell_at(const struct raster *r, int x, int y)
{
    static const struct raster_cell none = {0};
    x -= r->x0;
    y -= r->y0;
    bool inside = r->cell && x >= 0 && y >= 0 && x < r->columns && y < r->rows;
    return inside ? &r->cell[(size_t)y * (size_t)r->columns + (size_t)x] : &none;
}

static vec3 to_vec3(const float v[3])
{
    return (vec3){(double)v[0], (double)v[1], (double)v[2]};
}

static bool same_piece(const struct raster_cell *a, const struct raster_cell *b)
{
    if (!b->hit || vec3_dot(to_vec3(a->normal), to_vec3(b->normal)) <= crease)
        return false;
    vec3 n = vec3_normalize(vec3_add(to_vec3(a->normal), to_vec3(b->normal)));
    vec3 way = vec3_sub(to_vec3(b->point), to_vec3(a->point));
    return fabs(vec3_dot(way, n)) <= steep * vec3_length(way);
}

// Half of the difference of the neighbours each way, k: 0 x, 1 y.
static void differ(struct patches *to, const struct raster_cell *before,
                   const struct raster_cell *after, int lane, int k)
{
    vec3 point = vec3_sub(to_vec3(after->point), to_vec3(before->point));
    vec3 normal = vec3_sub(to_vec3(after->normal), to_vec3(before->normal));
    rec_lane_set(&to->point_by[k], lane, vec3_scale(point, 0.5));
    rec_lane_set(&to->normal_by[k], lane, vec3_scale(normal, 0.5));
    double turn = vec3_length(normal) / fmax(vec3_length(point), 1e-12);
    to->curvature[lane] = fmax(to->curvature[lane], turn);
}

static void take_patch(struct patches *to, const struct raster *r, const struct viewing *v, int x,
                       int y, int lane)
{
    const struct raster_cell *own = cell_at(r, x, y);
    vec3 point = vec3_add(v->sample->center, to_vec3(own->point));
    rec_lane_set(&to->center.point, lane, point);
    rec_lane_set(&to->center.normal, lane, to_vec3(own->normal));
    to->center.hit[lane] = own->hit;
    to->shadowed[lane] = own->shadowed;
    to->rim[lane] = to->dusk[lane] = to->curvature[lane] = 0;
    if (!own->hit)
        return;
    for (int k = 0; k < 9; k++) {
        const struct raster_cell *next = cell_at(r, x + k % 3 - 1, y + k / 3 - 1);
        if (!same_piece(own, next))
            to->rim[lane] = 1;
        else if (next->shadowed)
            to->dusk[lane] = 1;
    }
    if (to->rim[lane] > 0)
        return;
    differ(to, cell_at(r, x - 1, y), cell_at(r, x + 1, y), lane, 0);
    differ(to, cell_at(r, x, y - 1), cell_at(r, x, y + 1), lane, 1);
}

void rec_raster_patches(struct patches *to, const struct raster *r, const struct viewing *v, int x0,
                        int y)
{
    *to = (struct patches){0};
    for (int i = 0; i < LANES; i++)
        take_patch(to, r, v, x0 + i, y, i);
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
