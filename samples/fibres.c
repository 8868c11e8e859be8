/* fibres.c -- a pile of fibres on a plane, as of velvet: prisms with smooth sides, at random
 * places, tilted at random. */
#include "random.h"
#include "shapes.h"
#include "surface.h"

#include <stdlib.h>

enum {
    SIDES = 6,
    POINTS = 2 * SIDES + 1,
    TRIANGLES = 3 * SIDES
};  // rings at foot and tip; the tip

// One fibre from its foot along a unit axis.
static void put_fibre(struct geometry *g, int k, vec3 foot, vec3 axis, double radius, double length)
{
    vec3 u, v, *point = g->point + 4 + k * POINTS, *normal = g->normal + 4 + k * POINTS;
    unsigned first = (unsigned)(4 + k * POINTS), (*t)[3] = g->triangle + 2 + k * TRIANGLES;
    sam_frame(axis, &u, &v);
    for (int i = 0; i < 2 * SIDES; i++) {
        double phi = 2 * CAP_PI * (i % SIDES) / SIDES;
        vec3 out = vec3_add(vec3_scale(u, cos(phi)), vec3_scale(v, sin(phi)));
        vec3 middle = vec3_add(foot, vec3_scale(axis, i < SIDES ? 0 : length));
        normal[i] = out;
        point[i] = vec3_add(middle, vec3_scale(out, radius));
    }
    point[2 * SIDES] = vec3_add(foot, vec3_scale(axis, length + radius));
    normal[2 * SIDES] = axis;
    for (unsigned i = 0; i < SIDES; i++) {
        unsigned a = first + i, b = first + (i + 1) % SIDES;
        unsigned *p = t[3 * i], *q = t[3 * i + 1], *r = t[3 * i + 2];
        p[0] = a, p[1] = b, p[2] = b + SIDES;
        q[0] = a, q[1] = b + SIDES, q[2] = a + SIDES;
        r[0] = a + SIDES, r[1] = b + SIDES, r[2] = first + 2 * SIDES;
    }
}

static void put_plane(struct geometry *g)
{
    static const double corner[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    static const unsigned triangle[2][3] = {{0, 1, 2}, {0, 2, 3}};
    for (int i = 0; i < 4; i++) {
        g->point[i] = (vec3){corner[i][0], corner[i][1], 0};
        g->normal[i] = (vec3){0, 0, 1};
    }
    for (int i = 0; i < 6; i++)
        g->triangle[i / 3][i % 3] = triangle[i / 3][i % 3];
}

struct geometry sam_fibres(const struct surface *surface)
{
    struct geometry g = {.points = 4 + surface->fibres * POINTS,
                         .triangles = 2 + surface->fibres * TRIANGLES};
    g.point = malloc((size_t)g.points * sizeof *g.point);
    g.normal = malloc((size_t)g.points * sizeof *g.normal);
    g.triangle = malloc((size_t)g.triangles * sizeof *g.triangle);
    if (!g.point || !g.normal || !g.triangle)
        return g;
    put_plane(&g);
    for (int k = 0; k < surface->fibres; k++) {
        struct random random = sam_random_at(surface->seed, 2, (uint64_t)k);
        vec3 foot = {2 * sam_uniform(&random) - 1, 2 * sam_uniform(&random) - 1, 0};
        // Axes are even over the cap of directions within the tilt.
        double z = 1 - sam_uniform(&random) * (1 - cos(surface->tilt));
        double phi = 2 * CAP_PI * sam_uniform(&random), flat = sqrt(1 - z * z);
        vec3 axis = {flat * cos(phi), flat * sin(phi), z};
        put_fibre(&g, k, foot, axis, 2 * surface->radius, 2 * surface->length);
    }
    return g;
}
