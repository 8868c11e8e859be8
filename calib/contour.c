/* contour.c -- the outline of a solid of any shape in one photograph.
 *
 * Method.   Rays on a grid tell which pixels see the solid. Between neighbours that differ, the
 *           outline is found by bisection; where it crosses a ring around that place gives its
 *           direction and its bend. Photosites around it then make an edge (limb.c). Nothing needs
 *           to be known of the shape but where rays meet it.
 *
 *           The plane through the eye and the outline's tangent touches the solid. When the solid
 *           moves by v where it is touched, so does the plane, by v's part along its normal; what
 *           slides within the plane does not show.
 * Accuracy. The outline's places are good to BISECTIONS halvings of a grid step, 1e-4 px.
 */
#include "contour.h"
#include "limb.h"

#include <stdlib.h>
#include <string.h>

enum {
    GRID = 120,        // rays across the solid's box
    POINTS_MAX = 240,  // of an outline: more tell no more
    RING = 24,
    BISECTIONS = 14,
};
static const double RING_PX = 0.5 * EDGE_PX;
static const double CORNER_PX = 0.6;  // of bend within a ring: it is a corner
static const double INWARDS_PX = 0.01;

/** One view of a solid. */
struct look {
    const struct sample *sample;
    const struct camera *camera;
    mat3 rotation;
    vec3 eye;
};

static vec3 ray_at(const struct look *l, double x, double y)
{
    const double pixel[2] = {x, y};
    return mat3_mul_t(&l->rotation, cal_ray(l->camera, pixel));
}

static bool sees(const struct look *l, double x, double y)
{
    return cal_solid_meet(l->sample, l->eye, ray_at(l, x, y)).s < INFINITY;
}

/** The pixels that the grid's rays go through. */
struct grid {
    double left, top, step;
    int columns, rows;
    bool *seen;  // [rows][columns]
};

static bool grid_make(struct grid *g, const struct look *l, const struct view *view)
{
    const struct camera *camera = l->camera;
    double reach = cal_solid_reach(l->sample), pixel[2];
    vec3 at = cal_to_view(view->view_from_world, l->sample->center);
    double distance = vec3_length(at);
    if (at.z <= 0 || distance <= 1.05 * reach)
        return false;
    cal_project(camera, at, pixel);
    double radius = 1.1 * camera->focal[0] * reach / (distance - reach) + 4;
    double right = fmin(pixel[0] + radius, camera->width - 1);
    double bottom = fmin(pixel[1] + radius, camera->height - 1);
    g->left = fmax(pixel[0] - radius, 0);
    g->top = fmax(pixel[1] - radius, 0);
    g->step = fmax(fmax(right - g->left, bottom - g->top) / GRID, 1);
    g->columns = (int)((right - g->left) / g->step) + 1;
    g->rows = (int)((bottom - g->top) / g->step) + 1;
    if (right <= g->left || bottom <= g->top)
        return false;
    g->seen = calloc((size_t)g->columns * (size_t)g->rows, sizeof *g->seen);
    for (int k = 0; g->seen && k < g->columns * g->rows; k++) {
        int row = k / g->columns, column = k % g->columns;
        g->seen[k] = sees(l, g->left + column * g->step, g->top + row * g->step);
    }
    return g->seen != NULL;
}

/** Halve the way between a place that sees the solid and one that does not. */
static void bisect(const struct look *l, const double in[2], const double out[2], double at[2])
{
    double low = 0, high = 1;
    for (int k = 0; k < BISECTIONS; k++) {
        double t = 0.5 * (low + high);
        bool inside = sees(l, in[0] + t * (out[0] - in[0]), in[1] + t * (out[1] - in[1]));
        *(inside ? &low : &high) = t;
    }
    for (int a = 0; a < 2; a++)
        at[a] = in[a] + 0.5 * (low + high) * (out[a] - in[a]);
}

/** The same on the ring around a place, between two angles. */
static void bisect_ring(const struct look *l, const double center[2], double in, double out,
                        double at[2])
{
    for (int k = 0; k < BISECTIONS; k++) {
        double turn = 0.5 * (in + out);
        bool inside = sees(l, center[0] + RING_PX * cos(turn), center[1] + RING_PX * sin(turn));
        *(inside ? &in : &out) = turn;
    }
    at[0] = center[0] + RING_PX * cos(0.5 * (in + out));
    at[1] = center[1] + RING_PX * sin(0.5 * (in + out));
}

/** Direction and bend of the outline at p->pixel; false: a corner, or more than one outline. */
static bool direct(struct contour_point *p, const struct look *l)
{
    bool seen[RING];
    double cross[2][2], out[2] = {0, 0};
    int crossings = 0;
    for (int k = 0; k < RING; k++) {
        double turn = 2 * CAP_PI * k / RING;
        double way[2] = {cos(turn), sin(turn)};
        seen[k] = sees(l, p->pixel[0] + RING_PX * way[0], p->pixel[1] + RING_PX * way[1]);
        for (int a = 0; a < 2; a++)
            out[a] += seen[k] ? 0 : way[a];
    }
    for (int k = 0; k < RING; k++) {
        int next = (k + 1) % RING;
        if (seen[k] == seen[next])
            continue;
        if (crossings == 2)
            return false;
        double here = 2 * CAP_PI * k / RING, there = 2 * CAP_PI * (k + 1) / RING;
        bisect_ring(l, p->pixel, seen[k] ? here : there, seen[k] ? there : here,
                    cross[crossings++]);
    }
    if (crossings != 2)
        return false;
    double t[2] = {cross[1][0] - cross[0][0], cross[1][1] - cross[0][1]},
           length = hypot(t[0], t[1]);
    p->normal[0] = -t[1] / length;
    p->normal[1] = t[0] / length;
    if (p->normal[0] * out[0] + p->normal[1] * out[1] < 0)
        for (int a = 0; a < 2; a++)
            p->normal[a] = -p->normal[a];
    double rise =
        (p->pixel[0] - cross[0][0]) * p->normal[0] + (p->pixel[1] - cross[0][1]) * p->normal[1];
    p->bend = -rise / (RING_PX * RING_PX);
    return fabs(rise) < CORNER_PX && length > RING_PX;
}

/** Where the solid is touched, and how it moves the outline; false: rays slip by. */
static bool touch(struct contour_point *p, const struct look *l)
{
    const double *n = p->normal;
    vec3 ray = ray_at(l, p->pixel[0] - INWARDS_PX * n[0], p->pixel[1] - INWARDS_PX * n[1]);
    solid_hit hit = cal_solid_meet(l->sample, l->eye, ray);
    if (hit.s == INFINITY)
        return false;
    vec3 along = vec3_sub(ray_at(l, p->pixel[0] - n[1], p->pixel[1] + n[0]),
                          ray_at(l, p->pixel[0] + n[1], p->pixel[1] - n[0]));
    vec3 outwards = vec3_scale(vec3_sub(ray_at(l, p->pixel[0] + n[0], p->pixel[1] + n[1]),
                                        ray_at(l, p->pixel[0] - n[0], p->pixel[1] - n[1])),
                               0.5);
    p->across = vec3_normalize(vec3_cross(ray, along));
    double per_px = vec3_dot(outwards, p->across);
    if (per_px < 0) {
        p->across = vec3_scale(p->across, -1);
        per_px = -per_px;
    }
    p->point = vec3_add(l->eye, vec3_scale(ray, hit.s));
    p->px_per_mm = 1 / (hit.s * per_px);
    return true;
}

static bool near_others(const struct contour_point *p, int count, const double pixel[2],
                        double spacing)
{
    for (int k = 0; k < count; k++)
        if (hypot(p[k].pixel[0] - pixel[0], p[k].pixel[1] - pixel[1]) < spacing)
            return true;
    return false;
}

/** Where neighbours of the grid differ: pairs [.][2] of indices, inside first; NULL: no memory. */
static int (*borders(const struct grid *g, int *count))[2]
{
    int all = g->columns * g->rows;
    int(*pair)[2] = calloc(2 * (size_t)all + 1, sizeof *pair);
    *count = 0;
    for (int k = 0; pair && k < all; k++)
        for (int down = 0; down < 2; down++) {
            int other = down ? k + g->columns : k + 1;
            bool there = down ? other < all : other % g->columns != 0;
            if (!there || g->seen[k] == g->seen[other])
                continue;
            pair[*count][0] = g->seen[k] ? k : other;
            pair[(*count)++][1] = g->seen[k] ? other : k;
        }
    return pair;
}

enum status cal_contour(struct contour_point **point, int *count, const struct sample *sample,
                        const struct camera *camera, const struct view *view, struct error *err)
{
    struct look l = {sample, camera, cal_rotation(view->view_from_world.rotation),
                     cal_eye(view->view_from_world)};
    struct grid g = {.seen = NULL};
    *point = NULL;
    *count = 0;
    if (!grid_make(&g, &l, view))
        return STATUS_OK;  // not in this view
    int pairs, (*pair)[2] = borders(&g, &pairs);
    struct contour_point *p = calloc((size_t)pairs + 1, sizeof *p);
    double spacing = fmax(EDGE_PX, 0.8 * pairs * g.step / POINTS_MAX);
    int n = 0;
    for (int k = 0; pair && p && k < pairs; k++) {
        double end[2][2];
        for (int a = 0; a < 2; a++) {
            end[a][0] = g.left + pair[k][a] % g.columns * g.step;
            end[a][1] = g.top + pair[k][a] / g.columns * g.step;
        }
        bisect(&l, end[0], end[1], p[n].pixel);
        if (!near_others(p, n, p[n].pixel, spacing) && direct(&p[n], &l) && touch(&p[n], &l))
            n++;
    }
    free(g.seen);
    enum status status = pair && p
                             ? STATUS_OK
                             : cap_fail(err, STATUS_MEMORY, "%s: the sample's outline", view->name);
    free(pair);
    if (status) {
        free(p);
    } else {
        *point = p;
        *count = n;
    }
    return status;
}

/* ---- edges ----------------------------------------------------------------------------------- */

/** The photosites around a place on the outline. */
static void gather(struct sector *s, const struct radiance *map, const struct contour_point *p,
                   double inside, double outside)
{
    const double half = 0.5 * EDGE_PX, reach = fmax(inside, outside) + half;
    int left = (int)fmax(ceil(p->pixel[0] - reach), 0),
        top = (int)fmax(ceil(p->pixel[1] - reach), 0);
    int right = (int)fmin(p->pixel[0] + reach, map->width - 1);
    int bottom = (int)fmin(p->pixel[1] + reach, map->height - 1);
    const int stride = limb_stride(inside + outside);
    s->count = 0;
    for (int y = top; y <= bottom; y += stride)
        for (int x = left; x <= right; x += stride) {
            double dx = x - p->pixel[0], dy = y - p->pixel[1];
            double t = dy * p->normal[0] - dx * p->normal[1];
            double d = dx * p->normal[0] + dy * p->normal[1] - p->bend * t * t;
            if (fabs(t) <= half && d >= -inside && d <= outside)
                limb_add(s, map, x, y, d);
        }
}

enum status cal_contour_edges(struct contour_edge **edge, int *count, const struct radiance *map,
                              const struct sample *sample, const struct camera *camera,
                              const struct view *view, int view_index, double search, bool fine,
                              struct error *err)
{
    struct contour_point *point;
    int points, n = 0;
    enum status status = cal_contour(&point, &points, sample, camera, view, err);
    if (status)
        return status;
    struct sector *sector = calloc((size_t)points + 1, sizeof *sector);
    struct contour_edge *found = calloc((size_t)points + 1, sizeof *found);
    if (!sector || !found) {
        status = cap_fail(err, STATUS_MEMORY, "%s: %d outline edges", view->name, points);
        goto done;
    }
    for (int k = 0; k < points; k++) {
        gather(&sector[k], map, &point[k], fine ? LIMB_INSIDE_PX : search + 4,
               fine ? LIMB_OUTSIDE_PX : search + 4);
        if (sample->shape != SHAPE_MESH)  // whose bend differs from place to place
            sector[k].bend = fmin(1 / (sample->radius * point[k].px_per_mm), LIMB_BEND_MAX);
    }
    struct limb_lens lens;
    if (fine)
        limb_lens_find(&lens, sector, points, view->blur_px);
    for (int k = 0; k < points; k++) {
        double off, sigma;
        if (sector[k].count >= LIMB_SITES_ENOUGH
            && (fine ? limb_edge(&sector[k], &lens, &off, &sigma)
                     : limb_step(&sector[k], search, &off, &sigma)))
            found[n++] = (struct contour_edge){point[k], view_index, off, sigma};
    }
    *edge = found;
    *count = n;
    found = NULL;
done:
    free(point);
    free(sector);
    free(found);
    return status;
}
