/* outline.c -- where a sphere's image ends, to a hundredth of a pixel.
 *
 * Method.   Photosites near the predicted outline get a signed distance d across it (outwards) and
 *           an azimuth along it; about six pixels of azimuth make one edge. Across an edge at e,
 *           with x = e - d the depth inside it, radiance is
 *
 *               b0 + b1 sqrt(x) + b2 x   inside (x > 0),      o0 + o1 x   outside,
 *
 *           averaged over the photosite. The square root is the limb: near the outline the normal
 *           turns as sqrt(x), and with it all reflectance. For each e of a fine scan the five
 *           coefficients are solved linearly; the parabola through the least chi^2 gives e and,
 *           by its curvature, sigma. Either side may be the brighter one.
 * Accuracy. Unbiased for any smooth reflectance; the 50 % level is off by 0.05 mm and the steepest
 *           gradient by 0.017 mm where this model is off by 0.009 mm (../shared/facts.md).
 */
#include "outline.h"
#include "view_map.h"
#include "dense.h"

#include <assert.h>
#include <float.h>
#include <stdlib.h>
#include <string.h>

enum {
    EDGE_PX = 6,      // length of outline that makes one edge
    TERMS = 5,        // coefficients of the limb model
    SITES_MAX = 512,  // photosites of one edge
};
static const double INSIDE_PX = 7, OUTSIDE_PX = 4.5;  // what the limb model spans
static const double SCAN_PX = 2.5, STEP_PX = 0.125;
static const double TEXTURE = 0.004;     // what a surface's own structure adds to noise, relative
static const double SIGMA_MAX_PX = 0.3;  // an edge less sure than this says nothing
static const double EXPLAINED = 0.95;    // of the variance across an edge, by the model

/** A photosite near the outline. */
struct site {
    double d;  // pixels outwards from the predicted outline
    double value, variance;
};
/** The photosites of one edge. */
struct sector {
    struct site site[SITES_MAX];
    int count;
};

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

/** The terms of the limb model at depth x, averaged over a box (photosite and blur): the mean of
 *  x_+^p over it is ((x + w/2)_+^(p+1) - (x - w/2)_+^(p+1)) / ((p+1) w). */
static void limb_terms(double x, double width, double t[TERMS])
{
    double a = x / width + 0.5, b = x / width - 0.5;  // in box widths
    a = a > 0 ? a : 0;
    b = b > 0 ? b : 0;
    double inside = a - b;
    t[0] = inside;
    t[1] = (a * sqrt(a) - b * sqrt(b)) * (2.0 / 3) * sqrt(width);
    t[2] = (a * a - b * b) * 0.5 * width;
    t[3] = 1 - inside;
    t[4] = x - t[2];
}

/** chi^2 of the limb model with its edge at e; DBL_MAX where it cannot be fitted. */
static double limb_chi2(const struct sector *s, double e, double width)
{
    double a[TERMS * TERMS] = {0}, y[TERMS] = {0}, yy = 0;
    for (int n = 0; n < s->count; n++) {
        double t[TERMS], w = 1 / s->site[n].variance, value = s->site[n].value;
        limb_terms(e - s->site[n].d, width, t);
        for (int i = 0; i < TERMS; i++) {
            for (int j = 0; j <= i; j++)
                a[i * TERMS + j] += w * t[i] * t[j];
            y[i] += w * t[i] * value;
        }
        yy += w * value * value;
    }
    double c[TERMS];
    memcpy(c, y, sizeof c);
    if (!dense_cholesky(TERMS, a))
        return DBL_MAX;
    dense_solve(TERMS, a, c);
    for (int i = 0; i < TERMS; i++)
        yy -= c[i] * y[i];
    return yy > 0 ? yy : 0;
}

/** chi^2 of a sector about its weighted mean. */
static double about_mean(const struct sector *s)
{
    double w = 0, wv = 0, wvv = 0;
    for (int n = 0; n < s->count; n++) {
        double weight = 1 / s->site[n].variance, value = s->site[n].value;
        w += weight;
        wv += weight * value;
        wvv += weight * value * value;
    }
    return wvv - wv * wv / w;
}

/** The edge of one sector by the limb model. false: none is there, or it is not sure. */
static bool fine_edge(const struct sector *s, double width, double *e, double *sigma)
{
    enum { STEPS = 41 };
    double chi2[STEPS];
    int best = 0;
    for (int i = 0; i < STEPS; i++) {
        chi2[i] = limb_chi2(s, -SCAN_PX + i * STEP_PX, width);
        if (chi2[i] < chi2[best])
            best = i;
    }
    if (best == 0 || best == STEPS - 1 || chi2[best - 1] == DBL_MAX || chi2[best + 1] == DBL_MAX)
        return false;
    double curvature = chi2[best - 1] - 2 * chi2[best] + chi2[best + 1];
    if (curvature <= 0)
        return false;
    double shift = 0.5 * (chi2[best - 1] - chi2[best + 1]) / curvature;
    double misfit = chi2[best] / (s->count - TERMS - 1);
    *e = -SCAN_PX + (best + shift) * STEP_PX;
    // chi^2 rises by 1 (by the misfit, where the model is not perfect) at one sigma.
    *sigma = STEP_PX * sqrt(2 * (misfit > 1 ? misfit : 1) / curvature);
    return *sigma < SIGMA_MAX_PX && chi2[best] < (1 - EXPLAINED) * about_mean(s);
}

/** The steepest step of one sector within `search` pixels, over three pixels on each side. */
static bool coarse_edge(const struct sector *s, double search, double *e, double *sigma)
{
    const double side = 3;
    double best = 0;
    for (double at = -search; at <= search; at += 0.5) {
        double sum[2] = {0}, var[2] = {0};
        int n[2] = {0};
        for (int i = 0; i < s->count; i++) {
            double x = s->site[i].d - at;
            if (fabs(x) > side)
                continue;
            sum[x > 0] += s->site[i].value;
            var[x > 0] += s->site[i].variance;
            n[x > 0]++;
        }
        if (n[0] < 4 || n[1] < 4)
            continue;
        double a = sum[0] / n[0], b = sum[1] / n[1];
        double noise = var[0] / ((double)n[0] * n[0]) + var[1] / ((double)n[1] * n[1]);
        double step = fabs(a - b) / (fabs(a) + fabs(b) + 6 * sqrt(noise));
        if (step > best) {
            best = step;
            *e = at;
        }
    }
    *sigma = 1;
    return best > 0.3;
}

/** Sort the photosites around the outline into sectors [count]. */
static void gather(struct sector *sector, int count, const struct radiance *map,
                   const struct camera *camera, const mat3 *rotation, const struct cone *cone,
                   const double box_px[4], double inside, double outside)
{
    double scale[64];  // pixels a radian, over the azimuth
    for (int i = 0; i < 64; i++)
        scale[i] = pixels_per_radian(camera, rotation, cone, (i + 0.5) * CAP_PI / 32);
    for (int y = (int)box_px[1]; y <= (int)box_px[3]; y++) {
        for (int x = (int)box_px[0]; x <= (int)box_px[2]; x++) {
            const double pixel[2] = {x, y};
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
            const size_t at = 3 * ((size_t)y * (size_t)map->width + (size_t)x);
            double value, variance;
            if (s->count == SITES_MAX || !cal_gray(map, at, &value, &variance))
                continue;
            s->site[s->count++] =
                (struct site){d, value, variance + TEXTURE * TEXTURE * value * value};
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

/** The width of the box that photosite and lens blur to, which fits these sectors best. */
static double best_width(const struct sector *sector, int count)
{
    static const double widths[] = {1, 1.35, 1.8, 2.4, 3.2};
    double best = widths[0], least = DBL_MAX;
    for (size_t w = 0; w < sizeof widths / sizeof *widths; w++) {
        double sum = 0;
        for (int k = 0; k < count; k += 3) {  // a third of them tell
            double least_k = DBL_MAX;
            if (sector[k].count > 4 * TERMS)
                for (double e = -SCAN_PX; e <= SCAN_PX; e += 0.25)
                    least_k = fmin(least_k, limb_chi2(&sector[k], e, widths[w]));
            if (least_k < DBL_MAX)
                sum += fmin(least_k / sector[k].count, 20);  // a wild sector decides nothing
        }
        if (sum < least) {
            least = sum;
            best = widths[w];
        }
    }
    return best;
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
    double inside = fine ? INSIDE_PX : search + 4, outside = fine ? OUTSIDE_PX : search + 4;
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
    double width = fine ? best_width(sector, sectors) : 1;
    for (int k = 0; k < sectors; k++) {
        double e = 0, sigma = 0, phi = (k + 0.5) * 2 * CAP_PI / sectors;
        if (sector[k].count < 4 * TERMS
            || !(fine ? fine_edge(&sector[k], width, &e, &sigma)
                      : coarse_edge(&sector[k], search, &e, &sigma)))
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
