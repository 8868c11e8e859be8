/* outline.c -- where a sphere's image ends, to a hundredth of a pixel.
 *
 * Method.   Photosites near the predicted outline get a signed distance d across it (outwards) and
 *           an azimuth along it; about six pixels of azimuth make one edge (limb.c).
 */
#include "outline.h"
#include "limb.h"

#include <assert.h>
#include <float.h>
#include <stdlib.h>
#include <string.h>

struct cone cal_outline_cone(vec3 eye, vec3 center, double radius)
{
    vec3 to = vec3_sub(center, eye);
    double distance = vec3_length(to);
    assert(distance > radius);
    vec3 axis = vec3_scale(to, 1 / distance);
    vec3 away = fabs(axis.x) < 0.8 ? (vec3){1, 0, 0} : (vec3){0, 1, 0};
    vec3 u = vec3_normalize(vec3_cross(axis, away));
    return (struct cone){eye, axis, u, vec3_cross(axis, u), asin(radius / distance)};
}

vec3 cal_cone_ray(const struct cone *cone, double from_axis, double phi)
{
    vec3 across = vec3_add(vec3_scale(cone->u, cos(phi)), vec3_scale(cone->v, sin(phi)));
    return vec3_add(vec3_scale(cone->axis, cos(from_axis)), vec3_scale(across, sin(from_axis)));
}

bool cal_direction_pixel(const struct camera *camera, const mat3 *view_from_world, vec3 direction,
                         double pixel[2])
{
    vec3 p = mat3_mul(view_from_world, direction);
    if (p.z <= 0.05 * vec3_length(p))
        return false;
    cal_project(camera, p, pixel);
    return true;
}

/** Pixels that the outline moves when the half angle grows by one radian, at azimuth phi. */
static double pixels_per_radian(const struct camera *camera, const mat3 *rotation,
                                const struct cone *cone, double phi)
{
    const double step = 1e-5;
    double a[2], b[2];
    if (!cal_direction_pixel(camera, rotation, cal_cone_ray(cone, cone->half_angle, phi), a)
        || !cal_direction_pixel(camera, rotation, cal_cone_ray(cone, cone->half_angle + step, phi),
                                b))
        return 0;
    return hypot(b[0] - a[0], b[1] - a[1]) / step;
}

/** A ring of pixels that holds all photosites near the outline, and not many more. */
struct annulus {
    double center[2], low2, high2;  // squares of the radii
};

static struct annulus annulus_of(const struct camera *camera, const mat3 *rotation,
                                 const struct cone *cone, double inside, double outside)
{
    struct annulus a = {.low2 = 0, .high2 = DBL_MAX};
    double low = DBL_MAX, high = 0, pixel[2];
    if (!cal_direction_pixel(camera, rotation, cone->axis, a.center))
        return a;
    for (int i = 0; i < 64; i++) {
        vec3 ray = cal_cone_ray(cone, cone->half_angle, i * CAP_PI / 32);
        if (!cal_direction_pixel(camera, rotation, ray, pixel))
            return a;
        double r = hypot(pixel[0] - a.center[0], pixel[1] - a.center[1]);
        low = fmin(low, r);
        high = fmax(high, r);
    }
    // Between two of the points the outline strays by 0.1 % of its radius.
    low = fmax(0.99 * low - 1.2 * inside - 2, 0);
    high = 1.01 * high + 1.2 * outside + 2;
    a.low2 = low * low;
    a.high2 = high * high;
    return a;
}

static bool in_annulus(const struct annulus *a, const double pixel[2])
{
    double dx = pixel[0] - a->center[0], dy = pixel[1] - a->center[1], r2 = dx * dx + dy * dy;
    return r2 >= a->low2 && r2 <= a->high2;
}

/** Sort the photosites around the outline into sectors [count]. */
static void gather(struct sector *sector, int count, const struct radiance *map,
                   const struct camera *camera, const mat3 *rotation, const struct cone *cone,
                   const double box_px[4], double inside, double outside)
{
    double scale[64];  // pixels a radian, over the azimuth
    for (int i = 0; i < 64; i++)
        scale[i] = pixels_per_radian(camera, rotation, cone, (i + 0.5) * CAP_PI / 32);
    const int stride = limb_stride(inside + outside);
    struct annulus about = annulus_of(camera, rotation, cone, inside, outside);
    for (int y = (int)box_px[1]; y <= (int)box_px[3]; y += stride) {
        for (int x = (int)box_px[0]; x <= (int)box_px[2]; x += stride) {
            const double pixel[2] = {x, y};
            if (!in_annulus(&about, pixel))
                continue;
            vec3 ray = mat3_mul_t(rotation, cal_ray(camera, pixel));
            double along = vec3_dot(ray, cone->axis);
            double ru = vec3_dot(ray, cone->u), rv = vec3_dot(ray, cone->v);
            double turn = atan2(rv, ru) / (2 * CAP_PI);
            turn -= floor(turn);
            double d =
                (atan2(hypot(ru, rv), along) - cone->half_angle) * scale[(int)(turn * 64) & 63];
            if (d < -inside || d > outside)
                continue;
            int k = (int)(turn * count);
            struct sector *s = &sector[k < count ? k : count - 1];
            limb_add(s, map, x, y, d);
        }
    }
}

/** Bounding box of the outline in pixels, grown by margin and cut to the map; false: off it. */
static bool outline_box(double b[4], const struct radiance *map, const struct camera *camera,
                        const mat3 *rotation, const struct cone *cone, double margin)
{
    b[0] = b[1] = DBL_MAX;
    b[2] = b[3] = -DBL_MAX;
    for (int i = 0; i < 64; i++) {
        double p[2];
        vec3 ray = cal_cone_ray(cone, cone->half_angle, i * CAP_PI / 32);
        if (!cal_direction_pixel(camera, rotation, ray, p))
            return false;
        b[0] = fmin(b[0], p[0] - margin);
        b[1] = fmin(b[1], p[1] - margin);
        b[2] = fmax(b[2], p[0] + margin);
        b[3] = fmax(b[3], p[1] + margin);
    }
    b[0] = fmax(ceil(b[0]), 0);
    b[1] = fmax(ceil(b[1]), 0);
    b[2] = fmin(floor(b[2]), map->width - 1);
    b[3] = fmin(floor(b[3]), map->height - 1);
    return b[0] < b[2] && b[1] < b[3];
}

enum status cal_outline_edges(struct edge **edges, int *count, const struct radiance *map,
                              const struct camera *camera, const struct view *view, int view_index,
                              vec3 center, double radius, double search, bool fine,
                              struct error *err)
{
    mat3 rotation = cal_rotation(view->view_from_world.rotation);
    vec3 eye = cal_eye(view->view_from_world);
    if (vec3_length(vec3_sub(center, eye)) <= 1.05 * radius)
        return STATUS_OK;
    struct cone cone = cal_outline_cone(eye, center, radius);
    double inside = fine ? LIMB_INSIDE_PX : search + 4,
           outside = fine ? LIMB_OUTSIDE_PX : search + 4;
    double b[4];
    if (!outline_box(b, map, camera, &rotation, &cone, outside + 1))
        return STATUS_OK;
    double px = pixels_per_radian(camera, &rotation, &cone, 0);
    int sectors = (int)(2 * CAP_PI * sin(cone.half_angle) * px / EDGE_PX);
    if (sectors < 8)
        return STATUS_OK;
    struct sector *sector = calloc((size_t)sectors, sizeof *sector);
    struct edge *grown = realloc(*edges, (size_t)(*count + sectors) * sizeof *grown);
    if (grown)
        *edges = grown;
    if (!sector || !grown) {
        free(sector);
        return cap_fail(err, STATUS_MEMORY, "%s: %d outline edges", view->name, sectors);
    }
    gather(sector, sectors, map, camera, &rotation, &cone, b, inside, outside);
    for (int k = 0; k < sectors; k++)
        sector[k].bend = fmin(1 / (tan(cone.half_angle) * px), LIMB_BEND_MAX);
    struct limb_lens lens;
    if (fine)
        limb_lens_find(&lens, sector, sectors, view->blur_px);
    for (int k = 0; k < sectors; k++) {
        double e = 0, sigma = 0, phi = (k + 0.5) * 2 * CAP_PI / sectors;
        if (sector[k].count < LIMB_SITES_ENOUGH
            || !(fine ? limb_edge(&sector[k], &lens, &e, &sigma)
                      : limb_step(&sector[k], search, &e, &sigma)))
            continue;
        struct edge edge = {.view = view_index, .sigma_px = sigma};
        double scale = pixels_per_radian(camera, &rotation, &cone, phi);
        vec3 ray = cal_cone_ray(&cone, cone.half_angle + e / scale, phi);
        if (scale > 0 && cal_direction_pixel(camera, &rotation, ray, edge.pixel))
            (*edges)[(*count)++] = edge;
    }
    free(sector);
    return STATUS_OK;
}
