/* bounce.c -- light that board and sample throw on each other, once.
 *
 * Method.   The board (sheet, paper, patches) is cut into cells, each a small matt emitter of the
 *           direct light's mean radiance in it:
 *               L(p -> eye) = sum over cells of f(wi, wo) B cos_p cos_q A / d^2
 *           on a grid of normals of the sphere; and the sphere into points of equal area:
 *               E(q) = sum over points of f(wi, wo) E_p cos_i cos_p cos_q A / d^2
 *           on a grid over the board. Between grid points both are linear. The post stands in the
 *           way; light that the post, things or a patch's sides reflect, and second bounces, are
 * left out. Accuracy. Cells and grids are finer than the blur of a lobe of width 0.1 some 50 mm
 * away, and the test against the closed form of a wide, even board holds to 1e-3. What a mirror
 *           would show of the board is blurred to cells.
 */
#include "bounce.h"

#include <stdlib.h>

enum { SUB = 3 };  // a cell's radiance is the mean of SUB x SUB spots
// Cells of the board, mm: below the bits of a tag. The irradiance of the board, mm: a ball some
// 20 mm above it makes nothing finer. Points on the sphere.
static const double CELL = 2.5, STEP = 4;
enum { SPHERE_POINTS = 4096 };

/** A small flat piece that shines evenly, or a point that is lit. */
struct emitter {
    vec3 point;
    double area;
    double radiance[3];
};

struct emitters {
    struct emitter *item;
    int count;
};

/** The rectangle of the world's plane that the board takes up. */
struct extent {
    double low[2], high[2];
};

static struct extent board_extent(const struct scene *scene)
{
    const struct scene_board *board = &scene->board;
    struct extent e = {{-board->size[0] / 2, -board->size[1] / 2},
                       {board->size[0] / 2, board->size[1] / 2}};
    for (int i = 0; i < board->tags; i++) {
        const struct tag_place *tag = &board->tag[i];
        double reach = (tag->size / 2 + board->margin) * sqrt(2);
        const double at[2] = {tag->center.x, tag->center.y};
        for (int k = 0; k < 2; k++) {
            e.low[k] = fmin(e.low[k], at[k] - reach);
            e.high[k] = fmax(e.high[k], at[k] + reach);
        }
    }
    return e;
}

// ---- the board as emitters

/** Just above the highest patch: from here down there is the board alone, and the post. */
static double above_board(const struct scene *scene)
{
    double z = 0.5;
    for (int i = 0; i < scene->patches; i++)
        z = fmax(z, scene->patch[i].patch.corner[0].z + 0.5);
    return z;
}

static void add_direct(const struct shot_view *view, double x, double y, double z,
                       struct emitter *cell)
{
    static const vec3 up = {0, 0, 1};
    struct vantage nowhere = sam_vantage_nowhere();
    struct spot spot = sam_spot(view->world, &nowhere, (struct ray){{x, y, z}, vec3_scale(up, -1)});
    if (spot.matter == MATTER_NONE || spot.matter == MATTER_POST
        || sam_spot_material(view->world, &spot))
        return;
    double rgb[3];
    sam_shade(view, &spot, sam_lit(view, &spot, up), up, rgb);
    for (int c = 0; c < 3; c++)
        cell->radiance[c] += rgb[c] / (SUB * SUB);
    cell->point.z += spot.point.z / (SUB * SUB);
}

static bool list_board(struct emitters *list, const struct shot_view *view, int threads)
{
    struct extent e = board_extent(view->world->scene);
    int columns = (int)ceil((e.high[0] - e.low[0]) / CELL);
    int rows = (int)ceil((e.high[1] - e.low[1]) / CELL);
    double z = above_board(view->world->scene), sub = CELL / SUB;
    list->item = calloc((size_t)columns * (size_t)rows + 1, sizeof *list->item);
    if (!list->item)
        return false;
#pragma omp parallel for num_threads(threads)
    for (int i = 0; i < columns * rows; i++) {
        struct emitter *cell = &list->item[i];
        int row = i / columns, column = i % columns;
        double x = e.low[0] + column * CELL, y = e.low[1] + row * CELL;
        cell->point = (vec3){x + CELL / 2, y + CELL / 2, 0};
        cell->area = CELL * CELL;
        for (int j = 0; j < SUB; j++)
            for (int k = 0; k < SUB; k++)
                add_direct(view, x + (k + 0.5) * sub, y + (j + 0.5) * sub, z, cell);
    }
    for (int i = 0; i < columns * rows; i++)  // dark cells, and those beside the board, are none
        if (list->item[i].radiance[0] + list->item[i].radiance[1] + list->item[i].radiance[2] > 0)
            list->item[list->count++] = list->item[i];
    return true;
}

static bool post_between(const struct world *world, vec3 from, vec3 direction, double far)
{
    return world->post.radius > 0
           && sam_cross_rod((struct ray){from, direction}, &world->post, 1e-6).s < far;
}

/** The board's light, reflected at a spot of the sample towards wo. */
static void gather_board(const struct bounce *bounce, const struct emitters *board,
                         const struct spot *spot, vec3 wo, double rgb[3])
{
    rgb[0] = rgb[1] = rgb[2] = 0;
    for (int i = 0; i < board->count; i++) {
        const struct emitter *cell = &board->item[i];
        vec3 to = vec3_sub(cell->point, spot->point);
        double d2 = vec3_dot(to, to), d = sqrt(d2), cos_q = -to.z / d;
        vec3 wi = vec3_scale(to, 1 / d);
        double cos_p = vec3_dot(wi, spot->normal);
        if (cos_p <= 0 || cos_q <= 0 || post_between(bounce->view->world, spot->point, wi, d))
            continue;
        double f[3], form = cos_p * cos_q * cell->area / d2;
        sam_reflectance(bounce->view->world, spot, wi, wo, f);
        for (int c = 0; c < 3; c++)
            rgb[c] += f[c] * cell->radiance[c] * form;
    }
}

/** The largest angle between a visible point's normal and z: where the camera's rays graze. */
static double theta_limb(const struct bounce *bounce)
{
    const struct sample_place *place = &bounce->view->world->scene->sample.place;
    return acos(place->radius / vec3_length(vec3_sub(bounce->view->eye, place->center)));
}

static void fill_sample_node(const struct bounce *bounce, const struct emitters *board, int node)
{
    const struct sample_place *place = &bounce->view->world->scene->sample.place;
    int row = node / BOUNCE_PHI, column = node % BOUNCE_PHI;
    double theta = theta_limb(bounce) * row / (BOUNCE_THETA - 1);
    double phi = 2 * CAP_PI * column / BOUNCE_PHI;
    vec3 n = vec3_add(vec3_scale(bounce->z, cos(theta)),
                      vec3_add(vec3_scale(bounce->x, sin(theta) * cos(phi)),
                               vec3_scale(bounce->y, sin(theta) * sin(phi))));
    struct spot spot = {.matter = MATTER_SAMPLE,
                        .normal = n,
                        .point = vec3_add(place->center, vec3_scale(n, place->radius))};
    vec3 wo = vec3_normalize(vec3_sub(bounce->view->eye, spot.point));
    double cos_o = vec3_dot(wo, n);
    if (cos_o < 1e-3)  // the last row looks along the surface: take it from just inside
        wo = vec3_normalize(vec3_add(wo, vec3_scale(n, 1e-3 - cos_o)));
    gather_board(bounce, board, &spot, wo, &bounce->on_sample[3 * node]);
}

// ---- the sample as emitters

/** Irradiance of the lamp on points of equal area of the sphere, kept as `radiance`; f is not in
 *  it yet, for it depends on where the light goes. */
static bool list_sphere(struct emitters *list, const struct shot_view *view)
{
    const struct sample_place *place = &view->world->scene->sample.place;
    list->item = calloc(SPHERE_POINTS, sizeof *list->item);
    if (!list->item)
        return false;
    for (int i = 0; i < SPHERE_POINTS; i++) {
        double z = 1 - 2 * (i + 0.5) / SPHERE_POINTS, r = sqrt(1 - z * z);
        double turn = i * 2.39996322972865332;  // the golden angle
        vec3 n = {r * cos(turn), r * sin(turn), z};
        struct emitter point = {.point = vec3_add(place->center, vec3_scale(n, place->radius)),
                                .area = 4 * CAP_PI * place->radius * place->radius / SPHERE_POINTS};
        struct spot spot = {.matter = MATTER_SAMPLE, .point = point.point, .normal = n};
        struct incidence in = sam_light_part(&view->light, spot.point, 0, 1);
        double cos_i = vec3_dot(in.wi, n);
        if (cos_i <= 0 || sam_lit(view, &spot, n) == LIT_NOT)
            continue;
        for (int c = 0; c < 3; c++)
            point.radiance[c] = in.irradiance[c] * cos_i;
        list->item[list->count++] = point;
    }
    return true;
}

static void fill_board_node(const struct bounce *bounce, const struct emitters *sphere, int node)
{
    const struct shot_view *view = bounce->view;
    const struct sample_place *place = &view->world->scene->sample.place;
    double *rgb = &bounce->on_board[3 * node];
    int row = node / bounce->columns, column = node % bounce->columns;
    vec3 q = {bounce->x0 + column * STEP, bounce->y0 + row * STEP, 0};
    for (int i = 0; i < sphere->count; i++) {
        const struct emitter *p = &sphere->item[i];
        vec3 to = vec3_sub(q, p->point);
        double d2 = vec3_dot(to, to), d = sqrt(d2), cos_q = -to.z / d;
        vec3 wo = vec3_scale(to, 1 / d);
        vec3 n = vec3_scale(vec3_sub(p->point, place->center), 1 / place->radius);
        double cos_p = vec3_dot(wo, n);
        if (cos_p <= 0 || cos_q <= 0 || post_between(view->world, p->point, wo, d))
            continue;
        struct spot spot = {.matter = MATTER_SAMPLE, .point = p->point, .normal = n};
        struct incidence in = sam_light_part(&view->light, p->point, 0, 1);
        double f[3], form = cos_p * cos_q * p->area / d2;
        sam_reflectance(view->world, &spot, in.wi, wo, f);
        for (int c = 0; c < 3; c++)
            rgb[c] += f[c] * p->radiance[c] * form;
    }
}

// ---- the maps

static bool allocate(struct bounce *bounce)
{
    struct extent e = board_extent(bounce->view->world->scene);
    bounce->x0 = e.low[0];
    bounce->y0 = e.low[1];
    bounce->columns = (int)ceil((e.high[0] - e.low[0]) / STEP) + 2;
    bounce->rows = (int)ceil((e.high[1] - e.low[1]) / STEP) + 2;
    bounce->on_sample = calloc((size_t)BOUNCE_THETA * BOUNCE_PHI * 3, sizeof(double));
    bounce->on_board = calloc((size_t)bounce->columns * (size_t)bounce->rows * 3, sizeof(double));
    return bounce->on_sample && bounce->on_board;
}

enum status sam_bounce_build(struct bounce *bounce, const struct shot_view *view, int threads,
                             struct error *err)
{
    vec3 center = view->world->scene->sample.place.center;
    struct bounce b = {.view = view, .z = vec3_normalize(vec3_sub(view->eye, center))};
    struct emitters board = {0}, sphere = {0};
    sam_frame(b.z, &b.x, &b.y);
    enum status status = STATUS_OK;
    if (!allocate(&b) || !list_board(&board, view, threads) || !list_sphere(&sphere, view)) {
        status = cap_fail(err, STATUS_MEMORY, "interreflection: out of memory");
    } else {
#pragma omp parallel for schedule(dynamic, 16) num_threads(threads)
        for (int i = 0; i < BOUNCE_THETA * BOUNCE_PHI; i++)
            fill_sample_node(&b, &board, i);
#pragma omp parallel for schedule(dynamic, 16) num_threads(threads)
        for (int i = 0; i < b.columns * b.rows; i++)
            fill_board_node(&b, &sphere, i);
    }
    free(board.item);
    free(sphere.item);
    if (status)
        sam_bounce_free(&b);
    else
        *bounce = b;
    return status;
}

void sam_bounce_free(struct bounce *bounce)
{
    free(bounce->on_sample);
    free(bounce->on_board);
    *bounce = (struct bounce){0};
}

/** Linear between four nodes of a map with `columns` a row. */
static void interpolate(const double *map, int columns, int row, int column, int next_column,
                        double down, double right, double rgb[3])
{
    const double *top = &map[3 * row * columns], *bottom = top + 3 * columns;
    for (int c = 0; c < 3; c++)
        rgb[c] =
            (1 - down) * ((1 - right) * top[3 * column + c] + right * top[3 * next_column + c])
            + down * ((1 - right) * bottom[3 * column + c] + right * bottom[3 * next_column + c]);
}

static void look_up_sample(const struct bounce *bounce, vec3 n, double rgb[3])
{
    double nx = vec3_dot(n, bounce->x), ny = vec3_dot(n, bounce->y), nz = vec3_dot(n, bounce->z);
    double theta = atan2(hypot(nx, ny), nz) / theta_limb(bounce) * (BOUNCE_THETA - 1);
    double phi = atan2(ny, nx) / (2 * CAP_PI);
    phi = (phi < 0 ? phi + 1 : phi) * BOUNCE_PHI;
    int row = (int)fmin(floor(theta), BOUNCE_THETA - 2), column = (int)phi % BOUNCE_PHI;
    interpolate(bounce->on_sample, BOUNCE_PHI, row, column, (column + 1) % BOUNCE_PHI,
                fmin(theta - row, 1), phi - floor(phi), rgb);
}

static void look_up_board(const struct bounce *bounce, vec3 p, double rgb[3])
{
    double x = (p.x - bounce->x0) / STEP, y = (p.y - bounce->y0) / STEP;
    int column = (int)fmin(fmax(floor(x), 0), bounce->columns - 2);
    int row = (int)fmin(fmax(floor(y), 0), bounce->rows - 2);
    interpolate(bounce->on_board, bounce->columns, row, column, column + 1, y - row, x - column,
                rgb);
}

void sam_bounce_add(const struct bounce *bounce, const struct spot *spot, double rgb[3])
{
    double more[3] = {0, 0, 0};
    if (spot->matter == MATTER_SAMPLE) {
        look_up_sample(bounce, spot->normal, more);
    } else if (spot->matter != MATTER_NONE && spot->matter != MATTER_POST
               && spot->matter != MATTER_THING && spot->normal.z > 0.5) {
        look_up_board(bounce, spot->point, more);
        for (int c = 0; c < 3; c++)
            more[c] *= spot->albedo / CAP_PI;
    }
    for (int c = 0; c < 3; c++)
        rgb[c] += more[c];
}
