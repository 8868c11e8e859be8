/* mesh.c -- a scanned object: triangles with smooth normals, met through Embree.
 *
 * Method.   Embree works in single precision: it is given points about the mesh's middle and rays
 *           that begin where they enter the ball about it, and tells the triangle. Where on it, and
 *           the normal between its corners', are computed again in double precision.
 * Accuracy. Points 1e-12 mm from the triangle's plane. Which of two neighbouring triangles is met
 *           within 1e-6 of the radius from their edge is Embree's choice.
 */
#include "solid.h"

#include <assert.h>
#include <embree3/rtcore.h>
#include <stdlib.h>

struct mesh {
    vec3 *point, *normal;     // [points]; points about the middle
    unsigned (*triangle)[3];  // [triangles]
    int points, triangles;
    vec3 center;
    double radius;
    vec3 spread_point[SOLID_POINTS], spread_normal[SOLID_POINTS];  // of cal_mesh_point
    double area;
    RTCDevice device;
    RTCScene scene;
};

void cal_mesh_free(struct mesh *mesh)
{
    if (!mesh)
        return;
    if (mesh->scene)
        rtcReleaseScene(mesh->scene);
    if (mesh->device)
        rtcReleaseDevice(mesh->device);
    free(mesh->point);
    free(mesh->normal);
    free(mesh->triangle);
    free(mesh);
}

// The middle of the box about the points.
static vec3 middle_of(const vec3 *point, int points)
{
    vec3 low = point[0], high = point[0];
    for (int i = 1; i < points; i++) {
        low = (vec3){fmin(low.x, point[i].x), fmin(low.y, point[i].y), fmin(low.z, point[i].z)};
        high = (vec3){fmax(high.x, point[i].x), fmax(high.y, point[i].y), fmax(high.z, point[i].z)};
    }
    return vec3_scale(vec3_add(low, high), 0.5);
}

// Twice the area of a triangle, along its normal.
static vec3 doubled_area(const struct mesh *mesh, int index)
{
    const unsigned *corner = mesh->triangle[index];
    vec3 a = mesh->point[corner[0]];
    return vec3_cross(vec3_sub(mesh->point[corner[1]], a), vec3_sub(mesh->point[corner[2]], a));
}

// Points at equal steps of the area, in the order of the triangles.
static void spread(struct mesh *mesh)
{
    double passed = 0;
    int k = 0;
    mesh->area = 0;
    for (int i = 0; i < mesh->triangles; i++)
        mesh->area += 0.5 * vec3_length(doubled_area(mesh, i));
    for (int i = 0; i < mesh->triangles && k < SOLID_POINTS; i++) {
        const unsigned *corner = mesh->triangle[i];
        vec3 face = doubled_area(mesh, i), sum = {0, 0, 0};
        passed += 0.5 * vec3_length(face);
        for (int a = 0; a < 3; a++)
            sum = vec3_add(sum, mesh->point[corner[a]]);
        for (; k < SOLID_POINTS && passed >= (k + 0.5) * mesh->area / SOLID_POINTS; k++) {
            mesh->spread_point[k] = vec3_scale(sum, 1.0 / 3);
            mesh->spread_normal[k] = vec3_normalize(face);
        }
    }
}

// Hand the triangles to Embree. One thread builds: the same tree on every machine.
static bool build(struct mesh *mesh)
{
    mesh->device = rtcNewDevice("threads=1");
    mesh->scene = mesh->device ? rtcNewScene(mesh->device) : NULL;
    RTCGeometry geometry =
        mesh->scene ? rtcNewGeometry(mesh->device, RTC_GEOMETRY_TYPE_TRIANGLE) : NULL;
    if (!geometry)
        return false;
    float *at = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                        3 * sizeof(float), (size_t)mesh->points);
    unsigned *index = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                              3 * sizeof(unsigned), (size_t)mesh->triangles);
    if (at && index) {
        for (int i = 0; i < mesh->points; i++) {
            at[3 * i] = (float)mesh->point[i].x;
            at[3 * i + 1] = (float)mesh->point[i].y;
            at[3 * i + 2] = (float)mesh->point[i].z;
        }
        for (int i = 0; i < 3 * mesh->triangles; i++)
            index[i] = mesh->triangle[i / 3][i % 3];
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(mesh->scene, geometry);
        rtcSetSceneFlags(mesh->scene, RTC_SCENE_FLAG_ROBUST);  // no ray slips between neighbours
        rtcCommitScene(mesh->scene);
    }
    rtcReleaseGeometry(geometry);
    return at && index && rtcGetDeviceError(mesh->device) == RTC_ERROR_NONE;
}

enum status cal_mesh_make(struct mesh **out, const vec3 *point, const vec3 *normal, int points,
                          const unsigned (*triangle)[3], int triangles, struct error *err)
{
    assert(points > 0 && triangles > 0);
    struct mesh *mesh = calloc(1, sizeof *mesh);
    bool made = mesh != NULL;
    if (made) {
        mesh->point = malloc((size_t)points * sizeof *mesh->point);
        mesh->normal = malloc((size_t)points * sizeof *mesh->normal);
        mesh->triangle = malloc((size_t)triangles * sizeof *mesh->triangle);
        made = mesh->point && mesh->normal && mesh->triangle;
    }
    if (made) {
        mesh->points = points;
        mesh->triangles = triangles;
        mesh->center = middle_of(point, points);
        for (int i = 0; i < points; i++) {
            mesh->point[i] = vec3_sub(point[i], mesh->center);
            mesh->normal[i] = vec3_normalize(normal[i]);
            mesh->radius = fmax(mesh->radius, vec3_length(mesh->point[i]));
        }
        for (int i = 0; i < 3 * triangles; i++)
            mesh->triangle[i / 3][i % 3] = triangle[i / 3][i % 3];
        spread(mesh);
        made = build(mesh);
    }
    if (!made) {
        cal_mesh_free(mesh);
        return cap_fail(err, STATUS_MEMORY, "a mesh of %d triangles: out of memory", triangles);
    }
    *out = mesh;
    return STATUS_OK;
}

void cal_mesh_reach(const struct mesh *mesh, vec3 *center, double *radius)
{
    *center = mesh->center;
    *radius = mesh->radius;
}

void cal_mesh_move(struct mesh *mesh, vec3 by)
{
    mesh->center = vec3_add(mesh->center, by);
}

enum status cal_mesh_turn(struct mesh *mesh, const mat3 *rotation, struct error *err)
{
    for (int i = 0; i < mesh->points; i++) {
        mesh->point[i] = mat3_mul(rotation, mesh->point[i]);
        mesh->normal[i] = mat3_mul(rotation, mesh->normal[i]);
    }
    spread(mesh);
    rtcReleaseScene(mesh->scene);
    rtcReleaseDevice(mesh->device);
    return build(mesh) ? STATUS_OK
                       : cap_fail(err, STATUS_MEMORY, "a mesh of %d triangles: out of memory",
                                  mesh->triangles);
}

void cal_mesh_point(const struct mesh *mesh, int k, vec3 *point, vec3 *normal, double *area)
{
    *point = vec3_add(mesh->center, mesh->spread_point[k]);
    *normal = mesh->spread_normal[k];
    *area = mesh->area / SOLID_POINTS;
}

int cal_mesh_triangles(const struct mesh *mesh)
{
    return mesh->triangles;
}

// The triangle that a ray from a place about the middle meets beyond `near`; -1: none.
static int find_triangle(const struct mesh *mesh, vec3 origin, vec3 direction, double near)
{
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    struct RTCRayHit hit = {
        .ray = {.org_x = (float)origin.x,
                .org_y = (float)origin.y,
                .org_z = (float)origin.z,
                .dir_x = (float)direction.x,
                .dir_y = (float)direction.y,
                .dir_z = (float)direction.z,
                .tnear = (float)near,
                .tfar = INFINITY,
                .mask = 0xFFFFFFFFu},
        .hit = {.geomID = RTC_INVALID_GEOMETRY_ID},
    };
    rtcIntersect1(mesh->scene, &context, &hit);
    return hit.hit.geomID == RTC_INVALID_GEOMETRY_ID ? -1 : (int)hit.hit.primID;
}

// Where the ray meets a triangle's plane, and the normal there between the corners'. Barycentric
// coordinates are Moeller and Trumbore's; Embree's rounding may leave the triangle by 1e-6, which
// is kept within.
static mesh_hit on_triangle(const struct mesh *mesh, vec3 origin, vec3 direction, int index)
{
    const unsigned *corner = mesh->triangle[index];
    vec3 a = mesh->point[corner[0]];
    vec3 ab = vec3_sub(mesh->point[corner[1]], a), ac = vec3_sub(mesh->point[corner[2]], a);
    vec3 from = vec3_sub(origin, a), across = vec3_cross(direction, ac);
    vec3 up = vec3_cross(from, ab);
    double scale = 1 / vec3_dot(ab, across);
    double u = fmin(fmax(vec3_dot(from, across) * scale, 0), 1);
    double v = fmin(fmax(vec3_dot(direction, up) * scale, 0), 1 - u);
    vec3 n = vec3_scale(mesh->normal[corner[0]], 1 - u - v);
    n = vec3_add(n, vec3_scale(mesh->normal[corner[1]], u));
    n = vec3_normalize(vec3_add(n, vec3_scale(mesh->normal[corner[2]], v)));
    vec3 flat = vec3_normalize(vec3_cross(ab, ac));
    if (vec3_dot(flat, direction) * vec3_dot(n, direction) < 0)  // the smooth back shows:
        n = flat;                                                // the facet's own face
    return (mesh_hit){.s = vec3_dot(ac, up) * scale, .normal = n};
}

/** A ray about the mesh's middle, from where it may meet the mesh on. */
typedef struct {
    vec3 origin, direction;
    double skip, near;  // so much of the way is done; nothing nearer is met
} local_ray;

static local_ray localize(const struct mesh *mesh, vec3 origin, vec3 direction)
{
    static const double CLEAR = 1e-4;  // of the radius: rounding in single precision is 1e-7
    vec3 local = vec3_sub(origin, mesh->center);
    double enter = -vec3_dot(local, direction) - mesh->radius;
    double skip = fmax(0, enter);  // up to where the ball about the mesh may begin
    local = vec3_add(local, vec3_scale(direction, skip));
    return (local_ray){local, direction, skip, skip > 0 ? 0 : CLEAR * mesh->radius};
}

static mesh_hit hit_of(const struct mesh *mesh, const local_ray *ray, int index)
{
    if (index < 0)
        return (mesh_hit){.s = INFINITY};
    mesh_hit hit = on_triangle(mesh, ray->origin, ray->direction, index);
    hit.s += ray->skip;
    return hit;
}

mesh_hit cal_mesh_meet(const struct mesh *mesh, vec3 origin, vec3 direction)
{
    local_ray ray = localize(mesh, origin, direction);
    return hit_of(mesh, &ray, find_triangle(mesh, ray.origin, ray.direction, ray.near));
}

void cal_mesh_meet_all(mesh_hit *hit, const struct mesh *mesh, const vec3 *origin,
                       const vec3 *direction, int count)
{
    assert(count > 0 && count <= MESH_RAYS);
    _Alignas(64) int valid[MESH_RAYS];
    struct RTCRayHit16 to = {0};
    local_ray ray[MESH_RAYS];
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    for (int i = 0; i < MESH_RAYS; i++) {
        valid[i] = i < count ? -1 : 0;
        ray[i] = localize(mesh, origin[i < count ? i : 0], direction[i < count ? i : 0]);
        to.ray.org_x[i] = (float)ray[i].origin.x;
        to.ray.org_y[i] = (float)ray[i].origin.y;
        to.ray.org_z[i] = (float)ray[i].origin.z;
        to.ray.dir_x[i] = (float)ray[i].direction.x;
        to.ray.dir_y[i] = (float)ray[i].direction.y;
        to.ray.dir_z[i] = (float)ray[i].direction.z;
        to.ray.tnear[i] = (float)ray[i].near;
        to.ray.tfar[i] = INFINITY;
        to.ray.mask[i] = 0xFFFFFFFFu;
        to.hit.geomID[i] = to.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
    rtcIntersect16(valid, mesh->scene, &context, &to);
    for (int i = 0; i < count; i++) {
        bool met = to.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
        hit[i] = hit_of(mesh, &ray[i], met ? (int)to.hit.primID[i] : -1);
    }
}
