/* film.c -- the radiance image of one shot: a ray per corner and middle of every pixel, more where
 * the image is not smooth (pixel.c).
 *
 * The image is worked on in tiles, each on its own with its corners, so that the result does not
 * depend on who computes what. Where a corner of a printed bit, sheet or patch falls, the pixel is
 * divided further from the start: such a corner may touch none of the places a pixel looks at.
 */
#include "film.h"

#include "bounce.h"
#include "pixel.h"
#include "shade.h"

#include <stdlib.h>
#include <string.h>

enum { TILE = 32, CORNER_DEPTH = 2 };

// Relative disagreement of a pixel's middle with its corners that calls for more rays. The rule's
// own error is about its square, 1e-6: the closed form is met well within 1e-4.
static const double TOLERANCE = 2e-3;
// Of the radiance of white under the lamp: the photon noise of a full well of 50000 is 4e-3.
static const double FLOOR = 2e-5;

// ---- rays

enum { NODES = 4 };
/** The lens over one tile: undistorted coordinates at NODES x NODES places, between which they are
 *  cubic. Newton's method would take half of a ray's time. Over 11 px between nodes the error is
 *  1e-5 px at most for a lens of k = 1 and f = 500 px, less for any milder one. */
struct tile_lens {
    double x0, y0, step;  // pixel of the first node, pixels between nodes
    double xy[NODES][NODES][2];
};

/** What image_plane.look works on. */
struct tile {
    const struct shot_view *view;
    const struct bounce *bounce;  // NULL: direct light only
    struct tile_lens lens;
};

static struct tile_lens tile_lens(const struct camera *camera, int x0, int y0)
{
    struct tile_lens lens = {x0 - 0.5, y0 - 0.5, (double)TILE / (NODES - 1), {{{0}}}};
    for (int j = 0; j < NODES; j++)
        for (int i = 0; i < NODES; i++) {
            const double pixel[2] = {lens.x0 + i * lens.step, lens.y0 + j * lens.step};
            vec3 d = cal_ray(camera, pixel);
            lens.xy[j][i][0] = d.x / d.z;
            lens.xy[j][i][1] = d.y / d.z;
        }
    return lens;
}

/** Lagrange's weights of four nodes at 0, 1, 2, 3. */
static void weights(double t, double w[NODES])
{
    double a = t - 1, b = t - 2, c = t - 3;
    w[0] = -a * b * c / 6;
    w[1] = t * b * c / 2;
    w[2] = -t * a * c / 2;
    w[3] = t * a * b / 6;
}

static vec3 direction(const struct tile_lens *lens, double x, double y)
{
    double wx[NODES], wy[NODES], sum[2] = {0, 0};
    weights((x - lens->x0) / lens->step, wx);
    weights((y - lens->y0) / lens->step, wy);
    for (int j = 0; j < NODES; j++)
        for (int k = 0; k < 2; k++)
            sum[k] += wy[j]
                      * (wx[0] * lens->xy[j][0][k] + wx[1] * lens->xy[j][1][k]
                         + wx[2] * lens->xy[j][2][k] + wx[3] * lens->xy[j][3][k]);
    return vec3_normalize((vec3){sum[0], sum[1], 1});
}

static struct sight see(const struct tile *tile, const struct vantage *from, struct ray ray,
                        int shade, int mirrors);

/** A ball-shaped lamp on a ray that a mirror sent, before it meets anything: radiance I / (pi a^2),
 *  even over the ball. Cameras themselves do not see lamps: they are outside of the picture. */
static bool sees_lamp(const struct lighting *light, struct ray ray, const struct spot *spot,
                      double rgb[3])
{
    double a = light->radius;
    if (!(a > 0))
        return false;
    double s = sam_cross_sphere(ray, light->position, a, 0).s;
    if (s == INFINITY
        || (spot->matter != MATTER_NONE && vec3_length(vec3_sub(spot->point, ray.origin)) < s))
        return false;
    for (int c = 0; c < 3; c++)
        rgb[c] = light->intensity[c] / (CAP_PI * a * a);
    return true;
}

enum { MIRRORS_MAX = 3 };

/** Add what a mirror shows. The image in it has its own edges, which its id tells apart. */
static void add_mirrored(const struct tile *tile, const struct spot *spot, vec3 wo, int shade,
                         int mirrors, struct sight *sight)
{
    const struct material *material = sam_spot_material(tile->view->world, spot);
    if (!material || !sam_material_mirrors(material) || mirrors == MIRRORS_MAX)
        return;
    struct vantage nowhere = sam_vantage_nowhere();
    vec3 n = vec3_scale(spot->normal, 2 * vec3_dot(wo, spot->normal));
    struct ray ray = {spot->point, vec3_normalize(vec3_sub(n, wo))};
    struct sight seen = see(tile, &nowhere, ray, shade, mirrors + 1);
    sight->id = (int)((unsigned)sight->id * 1000003u + (unsigned)seen.id);
    sight->rough |= seen.rough;
    for (int c = 0; c < 3; c++)
        sight->rgb[c] += material->mirror[c] * seen.rgb[c];
}

/** What a ray sees that has met so many mirrors before. */
static struct sight see(const struct tile *tile, const struct vantage *from, struct ray ray,
                        int shade, int mirrors)
{
    const struct shot_view *view = tile->view;
    struct spot spot = sam_spot(view->world, from, ray);
    vec3 wo = vec3_scale(ray.direction, -1);
    struct sight sight = {.id = -1};
    if (mirrors > 0 && sees_lamp(&view->light, ray, &spot, sight.rgb))
        return sight;
    enum lit lit = sam_lit(view, &spot, wo);
    sight.id = spot.surface * 2 + (lit != LIT_NOT);
    sight.curved = spot.matter == MATTER_SAMPLE || spot.matter == MATTER_THING;
    sight.rough = lit == LIT_PARTLY;
    if (shade)
        sam_shade(view, &spot, lit, wo, sight.rgb);
    if (shade && tile->bounce)
        sam_bounce_add(tile->bounce, &spot, sight.rgb);
    if (shade && view->ambient)
        sam_ambient_add(view, &spot, wo, sight.rgb);
    add_mirrored(tile, &spot, wo, shade, mirrors, &sight);
    return sight;
}

static struct sight look(const void *scene, double x, double y, int shade)
{
    const struct tile *tile = scene;
    const struct shot_view *view = tile->view;
    struct ray ray = {view->eye, mat3_mul_t(&view->rotation, direction(&tile->lens, x, y))};
    return see(tile, &view->eye_vantage, ray, shade, 0);
}

// ---- pixels with a corner in them

/** The depths that pixels begin with, [height][width]. */
struct marks {
    unsigned char *depth;
    const struct camera *camera;
    pose view_from_world;
};

static void mark(struct marks *marks, vec3 p_world)
{
    vec3 p = cal_to_view(marks->view_from_world, p_world);
    if (p.z <= 0)
        return;
    double pixel[2];
    cal_project(marks->camera, p, pixel);
    double x = floor(pixel[0] + 0.5), y = floor(pixel[1] + 0.5);
    if (x >= 0 && y >= 0 && x < marks->camera->width && y < marks->camera->height)
        marks->depth[(size_t)y * (size_t)marks->camera->width + (size_t)x] = CORNER_DEPTH;
}

static void mark_on_tag(struct marks *marks, const struct tag_place *tag, double x, double y)
{
    mark(marks,
         vec3_add(tag->center, vec3_add(vec3_scale(tag->x_axis, x), vec3_scale(tag->y_axis, y))));
}

/** Corners between the bits of a tag, and those of its paper. */
static void mark_tag(struct marks *marks, const struct world *world, const struct tag_place *tag)
{
    double bit = tag->size / world->family.border, half = 0.5 * world->family.total;
    double paper = tag->size / 2 + world->scene->board.margin;
    for (int j = 0; j <= world->family.total; j++)
        for (int i = 0; i <= world->family.total; i++)
            mark_on_tag(marks, tag, (i - half) * bit, (j - half) * bit);
    for (int k = 0; k < 4; k++)
        mark_on_tag(marks, tag, k & 1 ? paper : -paper, k & 2 ? paper : -paper);
}

static void mark_all(struct marks *marks, const struct world *world)
{
    const struct scene *scene = world->scene;
    for (int i = 0; i < scene->board.tags; i++)
        mark_tag(marks, world, &scene->board.tag[i]);
    for (int k = 0; k < 4; k++) {
        double sx = k & 1 ? 0.5 : -0.5, sy = k & 2 ? 0.5 : -0.5;
        mark(marks,
             (vec3){sx * scene->board.size[0], sy * scene->board.size[1], -scene->board.thickness});
        for (int i = 0; i < scene->patches; i++) {
            vec3 top = scene->patch[i].patch.corner[k];
            mark(marks, top);
            mark(marks, (vec3){top.x, top.y, top.z - scene->patch[i].thickness});
        }
    }
}

// ---- tiles

/** Everything that the tiles of a shot share. */
struct exposure {
    const struct shot_view *view;
    const struct bounce *bounce;
    const struct camera *camera;
    const unsigned char *depth;
    double floor;
    float *value;
};

static void expose_tile(const struct exposure *e, int x0, int y0)
{
    struct sight corner[TILE + 1][TILE + 1];
    struct tile tile = {e->view, e->bounce, tile_lens(e->camera, x0, y0)};
    struct image_plane plane = {look, &tile, TOLERANCE, e->floor};
    int width = e->camera->width - x0 < TILE ? e->camera->width - x0 : TILE;
    int height = e->camera->height - y0 < TILE ? e->camera->height - y0 : TILE;
    for (int j = 0; j <= height; j++)
        for (int i = 0; i <= width; i++)
            corner[j][i] = look(&tile, x0 + i - 0.5, y0 + j - 0.5, 1);
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            const struct sight four[4] = {corner[j][i], corner[j][i + 1], corner[j + 1][i + 1],
                                          corner[j + 1][i]};
            size_t at = (size_t)(y0 + j) * (size_t)e->camera->width + (size_t)(x0 + i);
            double rgb[3];
            sam_pixel_mean(&plane, x0 + i, y0 + j, 1, e->depth[at], four, rgb);
            for (int c = 0; c < 3; c++)
                e->value[3 * at + (size_t)c] = (float)rgb[c];
        }
}

/** Radiance of white at the origin, where the board is: the scale of what matters. */
static double white_radiance(const struct lighting *light)
{
    struct incidence in = sam_light_part(light, (vec3){0, 0, 0}, 0, 1);
    return fmax(fmax(in.irradiance[0], in.irradiance[1]), in.irradiance[2]) / CAP_PI;
}

static void expose_tiles(const struct exposure *e, int threads)
{
    int columns = (e->camera->width + TILE - 1) / TILE;
    int rows = (e->camera->height + TILE - 1) / TILE;
#pragma omp parallel for schedule(dynamic) num_threads(threads)
    for (int t = 0; t < rows * columns; t++)
        expose_tile(e, t % columns * TILE, t / columns * TILE);
}

/** Directional albedos of the sample and the things, where there is ambient light; else none. */
static bool list_ambient(struct ambient_albedo **list, const struct scene *scene, int threads)
{
    if (scene->ambient[0] + scene->ambient[1] + scene->ambient[2] == 0)
        return true;
    *list = malloc((size_t)(1 + scene->things.count) * sizeof **list);
    if (!*list)
        return false;
#pragma omp parallel for num_threads(threads)
    for (int i = 0; i <= scene->things.count; i++)
        sam_ambient_albedo(i == 0 ? &scene->sample.material : &scene->things.item[i - 1].material,
                           &(*list)[i]);
    return true;
}

enum status sam_film_expose(const struct world *world, const struct scene_shot *shot, int threads,
                            float *value, struct error *err)
{
    const struct camera *camera = &world->scene->camera;
    struct shot_view view = sam_shot_view(world, shot);
    struct bounce bounce = {0};
    struct ambient_albedo *ambient = NULL;
    unsigned char *depth = calloc((size_t)camera->width * (size_t)camera->height, 1);
    enum status status = STATUS_OK;
    if (!depth || !list_ambient(&ambient, world->scene, threads))
        status =
            cap_fail(err, STATUS_MEMORY, "a picture of %d x %d", camera->width, camera->height);
    view.ambient = ambient;
    if (!status && world->scene->bounces)
        status = sam_bounce_build(&bounce, &view, threads, err);
    if (!status) {
        struct marks marks = {depth, camera, shot->view_from_world};
        struct exposure e = {&view, world->scene->bounces ? &bounce : NULL, camera,
                             depth, FLOOR * white_radiance(&view.light),    value};
        mark_all(&marks, world);
        expose_tiles(&e, threads);
    }
    sam_bounce_free(&bounce);
    free(ambient);
    free(depth);
    return status;
}
