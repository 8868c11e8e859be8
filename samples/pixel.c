/* pixel.c -- the mean of a scene over the square of a pixel.
 *
 * Method.   A square whose corners and middle see one surface is integrated by the rule
 *           (corners + 8 middle) / 12, which is exact for cubics (Stroud 1971, C2: 3-2), and
 *           quartered while middle and corners disagree. Where one edge cuts two sides of a
 *           square, it is found there by bisection and taken for straight between, after a look
 *           at both sides of the chord's middle; each part counts by its area with the radiance
 *           of its centroid. Edges of curved surfaces are taken so only in sixteenths of a pixel,
 *           for radiance goes with the root of the distance from an outline. Squares with more
 *           going on are quartered down to 1/32.
 * Accuracy. Straight edges are placed within 1/512 px by bisection, 5e-4 of the contrast at one
 *           sigma; the chord of an outline of radius R px cuts off 1/(12 R) px, 1/16 of that where
 *           it is curved. A smooth surface: about the square of the tolerance. What lies inside a
 *           square and touches neither its corners nor its middle is missed: callers pass a
 *           depth where they know of such places.
 */
#include "pixel.h"

#include <math.h>

enum { DEPTH_ROUGH = 1, DEPTH_CURVED = 2, DEPTH_MAX = 5, BISECTIONS = 8 };
// A chord must have one surface this far to its left, in sides of the square, and the other as far
// to its right: an edge that bends more is cut shorter first.
static const double STRAIGHT = 0.01;

/** A square of the image and what its corners see, in the order of sam_pixel_mean. */
struct cell {
    double x, y, size;
    struct sight corner[4];
};

static const double corner_x[4] = {-0.5, 0.5, 0.5, -0.5}, corner_y[4] = {-0.5, -0.5, 0.5, 0.5};

static struct sight look(const struct image_plane *plane, double x, double y)
{
    return plane->look(plane->scene, x, y, 1);
}

static int id_at(const struct image_plane *plane, double x, double y)
{
    return plane->look(plane->scene, x, y, 0).id;
}

/** Is the middle what the corners promise? Then the square is smooth enough for the rule. */
static int is_smooth(const struct image_plane *plane, const struct cell *cell,
                     const struct sight *middle)
{
    for (int k = 0; k < 3; k++) {
        double sum = 0;
        for (int i = 0; i < 4; i++)
            sum += cell->corner[i].rgb[k];
        if (fabs(sum / 4 - middle->rgb[k]) > plane->tolerance * fabs(middle->rgb[k]) + plane->floor)
            return 0;
    }
    return 1;
}

static void add_rule(const struct cell *cell, const struct sight *middle, double rgb[3])
{
    double area = cell->size * cell->size;
    for (int k = 0; k < 3; k++) {
        double sum = 8 * middle->rgb[k];
        for (int i = 0; i < 4; i++)
            sum += cell->corner[i].rgb[k];
        rgb[k] += area * sum / 12;
    }
}

/** Where the id changes on the side from corner a to corner b, as a fraction of the way. */
static double find_edge(const struct image_plane *plane, const struct cell *cell, int a, int b)
{
    double low = 0, high = 1;
    for (int i = 0; i < BISECTIONS; i++) {
        double t = (low + high) / 2;
        double x = cell->x + cell->size * (corner_x[a] + t * (corner_x[b] - corner_x[a]));
        double y = cell->y + cell->size * (corner_y[a] + t * (corner_y[b] - corner_y[a]));
        if (id_at(plane, x, y) == cell->corner[a].id)
            low = t;
        else
            high = t;
    }
    return (low + high) / 2;
}

/** A polygon in units of the cell: at most the four corners, less one, and two edge points. */
struct part {
    double x[6], y[6];
    int points;
};

static void part_add(struct part *part, double x, double y)
{
    part->x[part->points] = x;
    part->y[part->points++] = y;
}

/** Area and centroid of a polygon (Green's theorem). */
static double part_area(const struct part *part, double *cx, double *cy)
{
    double area = 0, sx = 0, sy = 0;
    for (int i = 0; i < part->points; i++) {
        int j = (i + 1) % part->points;
        double cross = part->x[i] * part->y[j] - part->x[j] * part->y[i];
        area += cross / 2;
        sx += cross * (part->x[i] + part->x[j]) / 6;
        sy += cross * (part->y[i] + part->y[j]) / 6;
    }
    *cx = area != 0 ? sx / area : part->x[0];
    *cy = area != 0 ? sy / area : part->y[0];
    return fabs(area);
}

/** Radiance at the centroid of the part; where another surface is seen there (a curved edge),
 *  that of the part's first own corner. */
static void add_part(const struct image_plane *plane, const struct cell *cell,
                     const struct part *part, const struct sight *own, double rgb[3])
{
    double cx, cy, area = part_area(part, &cx, &cy) * cell->size * cell->size;
    struct sight s = look(plane, cell->x + cx * cell->size, cell->y + cy * cell->size);
    for (int k = 0; k < 3; k++)
        rgb[k] += area * (s.id == own->id ? s.rgb[k] : own->rgb[k]);
}

/** Does one edge between two surfaces cut two sides of the cell? They start at cut[0], cut[1]. */
static int is_one_edge(const struct cell *cell, const struct sight *middle, int cut[2])
{
    int cuts = 0;
    for (int i = 0; i < 4; i++)
        if (cell->corner[i].id != cell->corner[(i + 1) % 4].id) {
            if (cuts == 2)
                return 0;
            cut[cuts++] = i;
        }
    return cuts == 2
           && (middle->id == cell->corner[cut[0]].id || middle->id == cell->corner[cut[1]].id);
}

/** Is the edge where the chord says, in the chord's middle? The inner part is to its right. */
static int is_straight(const struct image_plane *plane, const struct cell *cell, const double x[2],
                       const double y[2], int inner, int outer)
{
    double dx = x[1] - x[0], dy = y[1] - y[0], length = sqrt(dx * dx + dy * dy);
    if (length < 2 * STRAIGHT)
        return 1;  // a clipped corner, smaller than what is asked
    double px = (x[0] + x[1]) / 2, py = (y[0] + y[1]) / 2;
    double nx = dy / length * STRAIGHT, ny = -dx / length * STRAIGHT;
    return id_at(plane, cell->x + (px + nx) * cell->size, cell->y + (py + ny) * cell->size) == inner
           && id_at(plane, cell->x + (px - nx) * cell->size, cell->y + (py - ny) * cell->size)
                  == outer;
}

/** Split the cell along a straight edge. 0: it is not straight; nothing is added. */
static int add_split(const struct image_plane *plane, const struct cell *cell, const int cut[2],
                     double rgb[3])
{
    double edge_x[2], edge_y[2];
    const struct sight *own_inner = &cell->corner[cut[1]], *own_outer = &cell->corner[cut[0]];
    for (int e = 0; e < 2; e++) {
        int a = cut[e], b = (a + 1) % 4;
        double t = find_edge(plane, cell, a, b);
        edge_x[e] = corner_x[a] + t * (corner_x[b] - corner_x[a]);
        edge_y[e] = corner_y[a] + t * (corner_y[b] - corner_y[a]);
    }
    if (!is_straight(plane, cell, edge_x, edge_y, own_inner->id, own_outer->id))
        return 0;
    // Corners cut[0] + 1 .. cut[1] lie between the two edge points; the others complete the rest.
    struct part inner = {.points = 0}, outer = {.points = 0};
    part_add(&inner, edge_x[0], edge_y[0]);
    for (int i = cut[0] + 1; i <= cut[1]; i++)
        part_add(&inner, corner_x[i], corner_y[i]);
    part_add(&inner, edge_x[1], edge_y[1]);
    part_add(&outer, edge_x[1], edge_y[1]);
    for (int i = cut[1] + 1; i <= cut[0] + 4; i++)
        part_add(&outer, corner_x[i % 4], corner_y[i % 4]);
    part_add(&outer, edge_x[0], edge_y[0]);
    add_part(plane, cell, &inner, own_inner, rgb);
    add_part(plane, cell, &outer, own_outer, rgb);
    return 1;
}

static void add_cell(const struct image_plane *plane, const struct cell *cell, int level, int depth,
                     double rgb[3]);

static void add_quarters(const struct image_plane *plane, const struct cell *cell,
                         const struct sight *middle, int level, int depth, double rgb[3])
{
    struct sight side[4];  // side i joins corner i and i + 1
    for (int i = 0; i < 4; i++) {
        int j = (i + 1) % 4;
        side[i] = look(plane, cell->x + cell->size * (corner_x[i] + corner_x[j]) / 2,
                       cell->y + cell->size * (corner_y[i] + corner_y[j]) / 2);
    }
    for (int i = 0; i < 4; i++) {
        struct cell quarter = {.x = cell->x + cell->size * corner_x[i] / 2,
                               .y = cell->y + cell->size * corner_y[i] / 2,
                               .size = cell->size / 2};
        quarter.corner[i] = cell->corner[i];
        quarter.corner[(i + 1) % 4] = side[i];
        quarter.corner[(i + 2) % 4] = *middle;
        quarter.corner[(i + 3) % 4] = side[(i + 3) % 4];
        add_cell(plane, &quarter, level + 1, depth, rgb);
    }
}

static void add_cell(const struct image_plane *plane, const struct cell *cell, int level, int depth,
                     double rgb[3])
{
    struct sight middle = look(plane, cell->x, cell->y);
    int cut[2] = {0, 0}, one_id = 1, curved = middle.curved, rough = middle.rough;
    for (int i = 0; i < 4; i++) {
        one_id &= cell->corner[i].id == middle.id;
        curved |= cell->corner[i].curved;
        rough |= cell->corner[i].rough;
    }
    int enough = rough && level >= DEPTH_ROUGH;
    if (level >= DEPTH_MAX
        || (one_id && level >= depth && (enough || is_smooth(plane, cell, &middle))))
        add_rule(cell, &middle, rgb);
    else if (one_id || level < depth || (curved && level < DEPTH_CURVED)
             || !is_one_edge(cell, &middle, cut) || !add_split(plane, cell, cut, rgb))
        add_quarters(plane, cell, &middle, level, depth, rgb);
}

void sam_pixel_mean(const struct image_plane *plane, double x, double y, double size, int depth,
                    const struct sight corner[4], double rgb[3])
{
    struct cell cell = {.x = x, .y = y, .size = size};
    double sum[3] = {0, 0, 0};
    for (int i = 0; i < 4; i++)
        cell.corner[i] = corner[i];
    add_cell(plane, &cell, 0, depth, sum);
    for (int k = 0; k < 3; k++)
        rgb[k] = sum[k] / (size * size);
}
