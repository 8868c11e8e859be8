/* bounce.c -- light that board and sample throw on each other.
 *
 * Method.   The board (sheet, paper, patches) is cut into cells, each a matt emitter of the direct
 *           light's mean radiance in it. What the ball sends to the board (bounce_ball.c) lies on a
 *           grid over the board; with `bounces: 2` it holds the board's own light off the ball, and
 *           the cells shine with it. What the board sends to the ball,
 *               L(p -> eye) = sum over directions of f(wi, wo) B cos(theta_i) dw,
 *           in rings about the mirror direction, lies on a grid of normals of the sphere. Between
 *           grid points the former is linear, the latter cubic. The post stands in the way; light
 *           that the post, things or a patch's sides reflect is left out.
 * Accuracy. Cells and grids are finer than the blur of a lobe of width 0.1 some 50 mm away, and the
 *           test against the closed form of a wide, even board holds to 1e-3. What a mirror would
 *           show of the board is blurred to cells and to the grid.
 */
#include "bounce.h"

#include "bounce_ball.h"
#include "polar.h"

#include <stdlib.h>

enum { SUB = 3 };  // a cell's radiance is the mean of SUB x SUB spots
// Cells of the board, mm: below the bits of a tag. The irradiance of the board, mm: a ball some
// 20 mm above it makes nothing finer; what it sends back of the board's light is smoother.
static const double CELL = 2.5, STEP = 4;
enum { COARSE = 4 };

/** The board by cells: radiance [rows][columns][3], and albedo/pi [rows][columns]. */
struct cells {
    struct board_glow glow;
    double *radiance, *reflectance;
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
                       double radiance[3], double *reflectance)
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
        radiance[c] += rgb[c] / (SUB * SUB);
    *reflectance += spot.albedo / CAP_PI / (SUB * SUB);
}

static bool cut_board(struct cells *cells, const struct shot_view *view, int threads)
{
    struct extent e = board_extent(view->world->scene);
    struct board_glow *glow = &cells->glow;
    *glow = (struct board_glow){.x0 = e.low[0],
                                .y0 = e.low[1],
                                .cell = CELL,
                                .columns = (int)ceil((e.high[0] - e.low[0]) / CELL),
                                .rows = (int)ceil((e.high[1] - e.low[1]) / CELL)};
    double z = above_board(view->world->scene), sub = CELL / SUB;
    size_t count = (size_t)glow->columns * (size_t)glow->rows;
    cells->radiance = calloc(3 * count + 1, sizeof(double));
    cells->reflectance = calloc(count + 1, sizeof(double));
    glow->radiance = cells->radiance;
    if (!cells->radiance || !cells->reflectance)
        return false;
#pragma omp parallel for num_threads(threads)
    for (int i = 0; i < glow->columns * glow->rows; i++) {
        int row = i / glow->columns, column = i % glow->columns;
        double x = e.low[0] + column * CELL, y = e.low[1] + row * CELL;
        for (int j = 0; j < SUB; j++)
            for (int k = 0; k < SUB; k++)
                add_direct(view, x + (k + 0.5) * sub, y + (j + 0.5) * sub, z,
                           &cells->radiance[3 * i], &cells->reflectance[i]);
    }
    return true;
}

static void cells_free(struct cells *cells)
{
    free(cells->radiance);
    free(cells->reflectance);
}

/** The board's light, reflected at a spot of the sample towards wo: by the cells, and for narrow
 *  lobes by directions about the mirror's. */
static void gather_board(const struct bounce *bounce, const struct board_glow *board,
                         const struct spot *spot, vec3 wo, double rgb[3])
{
    const struct world *world = bounce->view->world;
    vec3 z = vec3_sub(vec3_scale(spot->normal, 2 * vec3_dot(spot->normal, wo)), wo);
    rgb[0] = rgb[1] = rgb[2] = 0;
    for (int i = 0; i < board->columns * board->rows; i++) {
        const double *radiance = &board->radiance[3 * i];
        int row = i / board->columns;
        vec3 cell = {board->x0 + (i % board->columns + 0.5) * board->cell,
                     board->y0 + (row + 0.5) * board->cell, 0};
        vec3 to = vec3_sub(cell, spot->point);
        double d2 = vec3_dot(to, to), d = sqrt(d2), cos_q = -to.z / d;
        vec3 wi = vec3_scale(to, 1 / d);
        double cos_p = vec3_dot(wi, spot->normal);
        if (cos_p <= 0 || cos_q <= 0 || radiance[0] + radiance[1] + radiance[2] <= 0
            || sam_post_between(world, spot->point, wi, d))
            continue;
        double f[3], own = d2 / (cos_q * board->cell * board->cell);
        double weight = sam_rule_weight(own, sam_polar_density(SAM_FINEST_SKY, wi, z)) / own;
        sam_reflectance(world, spot, wi, wo, f);
        for (int c = 0; c < 3; c++)
            rgb[c] += f[c] * radiance[c] * cos_p * weight;
    }
    sam_board_mirrored(bounce->view, board, spot, wo, false, rgb);
}

/** The largest angle between a visible point's normal and z: where the camera's rays graze. */
static double theta_limb(const struct bounce *bounce)
{
    const struct sample_place *place = &bounce->view->world->scene->sample.place;
    return acos(place->radius / vec3_length(vec3_sub(bounce->view->eye, place->center)));
}

static void fill_sample_node(const struct bounce *bounce, const struct board_glow *board, int node)
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

// ---- the maps

static bool allocate(struct bounce *bounce)
{
    struct extent e = board_extent(bounce->view->world->scene);
    bounce->x0 = e.low[0];
    bounce->y0 = e.low[1];
    bounce->step = STEP;
    bounce->columns = (int)ceil((e.high[0] - e.low[0]) / STEP) + 2;
    bounce->rows = (int)ceil((e.high[1] - e.low[1]) / STEP) + 2;
    bounce->on_sample = calloc((size_t)BOUNCE_THETA * BOUNCE_PHI * 3, sizeof(double));
    bounce->on_board = calloc((size_t)bounce->columns * (size_t)bounce->rows * 3, sizeof(double));
    return bounce->on_sample && bounce->on_board;
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

static void look_up_board(const struct bounce *bounce, double px, double py, double rgb[3])
{
    double x = (px - bounce->x0) / bounce->step, y = (py - bounce->y0) / bounce->step;
    int column = (int)fmin(fmax(floor(x), 0), bounce->columns - 2);
    int row = (int)fmin(fmax(floor(y), 0), bounce->rows - 2);
    interpolate(bounce->on_board, bounce->columns, row, column, column + 1, y - row, x - column,
                rgb);
}

static vec3 board_place(const struct bounce *b, int node)
{
    int row = node / b->columns, column = node % b->columns;
    return (vec3){b->x0 + column * b->step, b->y0 + row * b->step, 0};
}

/** What the ball sends to the board of the lamp's light. */
static void light_board(struct bounce *b, int threads)
{
#pragma omp parallel for schedule(dynamic, 16) num_threads(threads)
    for (int i = 0; i < b->columns * b->rows; i++)
        sam_ball_throws(b->view, board_place(b, i), &b->on_board[3 * i]);
}

/** The cells shine with the ball's light too. */
static void light_cells(struct cells *cells, const struct bounce *b)
{
    for (int i = 0; i < cells->glow.columns * cells->glow.rows; i++) {
        int row = i / cells->glow.columns;
        double x = cells->glow.x0 + (i % cells->glow.columns + 0.5) * CELL, more[3];
        look_up_board(b, x, cells->glow.y0 + (row + 0.5) * CELL, more);
        for (int c = 0; c < 3; c++)
            cells->radiance[3 * i + c] += cells->reflectance[i] * more[c];
    }
}

/** The board's light off the ball, at every COARSE-th node, and linear between. */
static bool return_light(struct bounce *b, const struct board_glow *glow, int threads)
{
    struct bounce coarse = *b;
    coarse.columns = (b->columns + COARSE - 1) / COARSE + 1;
    coarse.rows = (b->rows + COARSE - 1) / COARSE + 1;
    coarse.step = b->step * COARSE;
    coarse.on_board = calloc((size_t)coarse.columns * (size_t)coarse.rows * 3, sizeof(double));
    if (!coarse.on_board)
        return false;
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads)
    for (int i = 0; i < coarse.columns * coarse.rows; i++)
        sam_ball_returns(b->view, glow, board_place(&coarse, i), &coarse.on_board[3 * i]);
    for (int i = 0; i < b->columns * b->rows; i++) {
        vec3 at = board_place(b, i);
        double more[3];
        look_up_board(&coarse, at.x, at.y, more);
        for (int c = 0; c < 3; c++)
            b->on_board[3 * i + c] += more[c];
    }
    free(coarse.on_board);
    return true;
}

enum status sam_bounce_build(struct bounce *bounce, const struct shot_view *view, int threads,
                             struct error *err)
{
    vec3 center = view->world->scene->sample.place.center;
    struct bounce b = {.view = view, .z = vec3_normalize(vec3_sub(view->eye, center))};
    struct cells cells = {0}, lit = {0};
    bool twice = view->world->scene->bounces > 1;
    sam_frame(b.z, &b.x, &b.y);
    bool made = allocate(&b) && cut_board(&cells, view, threads)
                && (!twice || cut_board(&lit, view, threads));
    if (made)
        light_board(&b, threads);
    if (made && twice) {
        light_cells(&lit, &b);
        made = return_light(&b, &lit.glow, threads);
        light_cells(&cells, &b);
    }
    if (made) {
#pragma omp parallel for schedule(dynamic, 16) num_threads(threads)
        for (int i = 0; i < BOUNCE_THETA * BOUNCE_PHI; i++)
            fill_sample_node(&b, &cells.glow, i);
    }
    cells_free(&cells);
    cells_free(&lit);
    if (!made) {
        sam_bounce_free(&b);
        return cap_fail(err, STATUS_MEMORY, "interreflection: out of memory");
    }
    *bounce = b;
    return STATUS_OK;
}

void sam_bounce_free(struct bounce *bounce)
{
    free(bounce->on_sample);
    free(bounce->on_board);
    *bounce = (struct bounce){0};
}

/** A node of the sample's map, the row beyond the pole's being the first across it. */
static const double *sample_node(const struct bounce *bounce, int row, int column)
{
    if (row < 0) {
        row = -row;
        column += BOUNCE_PHI / 2;
    }
    column = (column + BOUNCE_PHI) % BOUNCE_PHI;
    return &bounce->on_sample[3 * (row * BOUNCE_PHI + column)];
}

/** Cubic between the nodes of a row. */
static void along_row(const struct bounce *bounce, int row, int column, const double weight[4],
                      double rgb[3])
{
    for (int c = 0; c < 3; c++)
        rgb[c] = 0;
    for (int k = 0; k < 4; k++) {
        const double *node = sample_node(bounce, row, column + k - 1);
        for (int c = 0; c < 3; c++)
            rgb[c] += weight[k] * node[c];
    }
}

// R. Keys, "Cubic Convolution Interpolation for Digital Image Processing", IEEE Transactions on
// ASSP 29, 1981: weights of four nodes in a row, at t from the second to the third.
static void cubic(double weight[4], double t)
{
    weight[0] = t * (-0.5 + t * (1 - 0.5 * t));
    weight[1] = 1 + t * t * (-2.5 + 1.5 * t);
    weight[2] = t * (0.5 + t * (2 - 1.5 * t));
    weight[3] = t * t * (-0.5 + 0.5 * t);
}

static void look_up_sample(const struct bounce *bounce, vec3 n, double rgb[3])
{
    double nx = vec3_dot(n, bounce->x), ny = vec3_dot(n, bounce->y), nz = vec3_dot(n, bounce->z);
    double theta = atan2(hypot(nx, ny), nz) / theta_limb(bounce) * (BOUNCE_THETA - 1);
    double phi = atan2(ny, nx) / (2 * CAP_PI);
    phi = (phi < 0 ? phi + 1 : phi) * BOUNCE_PHI;
    int row = (int)fmin(floor(theta), BOUNCE_THETA - 2), column = (int)phi % BOUNCE_PHI;
    double across[4], along[4], nodes[4][3];
    cubic(across, fmin(theta - row, 1));
    cubic(along, phi - floor(phi));
    for (int k = 0; k < 4; k++)
        if (row + k - 1 < BOUNCE_THETA)
            along_row(bounce, row + k - 1, column, along, nodes[k]);
    for (int c = 0; c < 3; c++) {
        if (row + 2 == BOUNCE_THETA)  // none beyond the limb: on as straight as before it
            nodes[3][c] = 2 * nodes[2][c] - nodes[1][c];
        rgb[c] = 0;
        for (int k = 0; k < 4; k++)
            rgb[c] += across[k] * nodes[k][c];
        rgb[c] = fmax(rgb[c], 0);
    }
}

void sam_bounce_add(const struct bounce *bounce, const struct spot *spot, double rgb[3])
{
    double more[3] = {0, 0, 0};
    if (spot->matter == MATTER_SAMPLE) {
        look_up_sample(bounce, spot->normal, more);
    } else if (spot->matter != MATTER_NONE && spot->matter != MATTER_POST
               && spot->matter != MATTER_THING && spot->normal.z > 0.5) {
        look_up_board(bounce, spot->point.x, spot->point.y, more);
        for (int c = 0; c < 3; c++)
            more[c] *= spot->albedo / CAP_PI;
    }
    for (int c = 0; c < 3; c++)
        rgb[c] += more[c];
}
