/* film.c -- the radiance image of one shot: a ray per corner and middle of every pixel, more where
 * the image is not smooth (pixel.c).
 *
 * The image is worked on in tiles, each on its own with its corners, so that the result does not
 * depend on who computes what. Where a corner of a printed bit, sheet or patch falls, the pixel is
 * divided further from the start: such a corner may touch none of the places a pixel looks at.
 */
#include "film.h"
#include "pixel.h"

#include <stdlib.h>
#include <string.h>

enum { TILE = 32, CORNER_DEPTH = 2 };

// Relative disagreement of a pixel's middle with its corners that calls for more rays. The rule's
// own error is about its square, 1e-6: the closed form is met well within 1e-4.
static const double TOLERANCE = 2e-3;
// Of the radiance of white under the lamp: the photon noise of a full well of 50000 is 4e-3.
static const double FLOOR = 2e-5;

/** A shot, ready for rays: what image_plane.look works on. */
struct shot_view {
    const struct world *world;
    struct lighting light;
    mat3 rotation;
    vec3 eye;
};

static struct sight look(const void *scene, double x, double y, int shade)
{
    const struct shot_view *view = scene;
    const double pixel[2] = {x, y};
    vec3 direction = mat3_mul_t(&view->rotation, cal_ray(&view->world->scene->camera, pixel));
    struct spot spot = sam_spot(view->world, (struct ray){view->eye, direction}, &view->light);
    struct sight sight = {.id = spot.id, .curved = spot.matter == MATTER_SAMPLE};
    if (shade)
        sam_shade(view->world, &spot, &view->light, direction, sight.rgb);
    return sight;
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

static void expose_tile(const struct image_plane *plane, const struct camera *camera,
                        const unsigned char *depth, int tile_x, int tile_y, float *value)
{
    struct sight corner[TILE + 1][TILE + 1];
    int x0 = tile_x * TILE, y0 = tile_y * TILE;
    int width = camera->width - x0 < TILE ? camera->width - x0 : TILE;
    int height = camera->height - y0 < TILE ? camera->height - y0 : TILE;
    for (int j = 0; j <= height; j++)
        for (int i = 0; i <= width; i++)
            corner[j][i] = look(plane->scene, x0 + i - 0.5, y0 + j - 0.5, 1);
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            const struct sight four[4] = {corner[j][i], corner[j][i + 1], corner[j + 1][i + 1],
                                          corner[j + 1][i]};
            size_t at = (size_t)(y0 + j) * (size_t)camera->width + (size_t)(x0 + i);
            double rgb[3];
            sam_pixel_mean(plane, x0 + i, y0 + j, 1, depth[at], four, rgb);
            for (int c = 0; c < 3; c++)
                value[3 * at + (size_t)c] = (float)rgb[c];
        }
}

/** Radiance of white at the origin, where the board is: the scale of what matters. */
static double white_radiance(const struct lighting *light)
{
    double r2 = vec3_dot(light->position, light->position);
    return fmax(fmax(light->intensity[0], light->intensity[1]), light->intensity[2])
           / (CAP_PI * r2);
}

enum status sam_film_expose(const struct world *world, const struct scene_shot *shot, int threads,
                            float *value, struct error *err)
{
    const struct camera *camera = &world->scene->camera;
    struct shot_view view = {.world = world,
                             .light = sam_lighting(world->scene, shot),
                             .rotation = cal_rotation(shot->view_from_world.rotation),
                             .eye = cal_eye(shot->view_from_world)};
    struct image_plane plane = {.look = look,
                                .scene = &view,
                                .tolerance = TOLERANCE,
                                .floor = FLOOR * white_radiance(&view.light)};
    unsigned char *depth = calloc((size_t)camera->width * (size_t)camera->height, 1);
    if (!depth)
        return cap_fail(err, STATUS_MEMORY, "a picture of %d x %d", camera->width, camera->height);
    struct marks marks = {depth, camera, shot->view_from_world};
    mark_all(&marks, world);
    int columns = (camera->width + TILE - 1) / TILE, rows = (camera->height + TILE - 1) / TILE;
#pragma omp parallel for schedule(dynamic) num_threads(threads)
    for (int t = 0; t < rows * columns; t++)
        expose_tile(&plane, camera, depth, t % columns, t / columns, value);
    free(depth);
    return STATUS_OK;
}
