/* photometry.c -- what the lit surfaces of a scene say of its lamps.
 *
 * Method.   Means over pieces of surface that are of one material: the white bits of the tags,
 *           the patches, blocks of the sample. A photosite counts only where a margin of blur
 *           around it is of that material too.
 * Accuracy. A facet's sigma holds the noise of its mean (facet_sums.c) and, for the curved sample,
 *           what is left when the mean over a block is made the radiance in its middle.
 */
#include "photometry.h"
#include "facet_sums.h"
#include "view_map.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

// What of a photosite, and of what lies beside it, its lens mixes in: half its own width, and
// sigmas of the lens.
static const double MARGIN_PX = 1.75, HALF_PX = 0.5, TAIL = 2.5;
static const double SPREAD_MAX = 0.08;  // of one material, relative: more is a shadow's edge
static const double OCCLUSION_MM = 3;   // distance from the sample's shadow and outline
static const double SMOOTH_COS = 0.8;   // normals of one block agree to this
enum { SITES_MIN = 6, PATCH_FACETS = 4 };

static enum status append(struct facets *facets, const struct facet *facet, struct error *err)
{
    if (facets->count == facets->room) {
        int room = facets->room ? 2 * facets->room : 256;
        struct facet *grown = realloc(facets->facet, (size_t)room * sizeof *grown);
        if (!grown)
            return cap_fail(err, STATUS_MEMORY, "%d photometric facets", room);
        facets->facet = grown;
        facets->room = room;
    }
    facets->facet[facets->count++] = *facet;
    return STATUS_OK;
}

/* ---- quadrilaterals in an image -------------------------------------------------------------- */

/** pixel -> (s, t) on a flat quadrilateral: (0,0) bottom left, (1,0) bottom right, (1,1) top right.
 *  The homography of its corners; the lens bends less within a tag than a facet's margin. */
struct quadrilateral {
    double m[3][3];  // (s, t, 1) ~ m (x, y, 1)
    double box[4];
};

static void adjugate(double a[3][3], double m[3][3])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            int r = (j + 1) % 3, s = (j + 2) % 3, u = (i + 1) % 3, v = (i + 2) % 3;
            a[i][j] = m[r][u] * m[s][v] - m[r][v] * m[s][u];
        }
}

/** Heckbert's closed form of the square-to-quadrilateral map, inverted (1989). */
static struct quadrilateral quad_of(const double p[4][2])
{
    struct quadrilateral q;
    double dx1 = p[1][0] - p[2][0], dx2 = p[3][0] - p[2][0];
    double dx3 = p[0][0] - p[1][0] + p[2][0] - p[3][0];
    double dy1 = p[1][1] - p[2][1], dy2 = p[3][1] - p[2][1];
    double dy3 = p[0][1] - p[1][1] + p[2][1] - p[3][1];
    double det = dx1 * dy2 - dx2 * dy1;
    double g = (dx3 * dy2 - dx2 * dy3) / det, h = (dx1 * dy3 - dx3 * dy1) / det;
    double to_pixel[3][3] = {
        {p[1][0] - p[0][0] + g * p[1][0], p[3][0] - p[0][0] + h * p[3][0], p[0][0]},
        {p[1][1] - p[0][1] + g * p[1][1], p[3][1] - p[0][1] + h * p[3][1], p[0][1]},
        {g, h, 1}};
    adjugate(q.m, to_pixel);
    q.box[0] = q.box[1] = DBL_MAX;
    q.box[2] = q.box[3] = -DBL_MAX;
    for (int k = 0; k < 4; k++)
        for (int a = 0; a < 2; a++) {
            q.box[a] = fmin(q.box[a], p[k][a]);
            q.box[2 + a] = fmax(q.box[2 + a], p[k][a]);
        }
    return q;
}

static void quad_at(const struct quadrilateral *q, double x, double y, double st[2])
{
    double w = q->m[2][0] * x + q->m[2][1] * y + q->m[2][2];
    st[0] = (q->m[0][0] * x + q->m[0][1] * y + q->m[0][2]) / w;
    st[1] = (q->m[1][0] * x + q->m[1][1] * y + q->m[1][2]) / w;
}

/** The part of a quadrilateral's box, grown by `grow` of its size, that lies in the map. */
static void quad_range(const struct quadrilateral *q, const struct radiance *map, double grow,
                       int range[4])
{
    double mx = grow * (q->box[2] - q->box[0]), my = grow * (q->box[3] - q->box[1]);
    range[0] = (int)fmax(q->box[0] - mx, 0);
    range[1] = (int)fmax(q->box[1] - my, 0);
    range[2] = (int)fmin(q->box[2] + mx + 1, map->width - 1);
    range[3] = (int)fmin(q->box[3] + my + 1, map->height - 1);
}

static struct lattice lattice_of(const struct radiance *map, const int range[4])
{
    return cal_lattice(map, (range[2] - range[0] + 1.0) * (range[3] - range[1] + 1.0));
}

/** How far (s, t) moves in a photosite's margin, in x and y. blur_px: of the lens, 1 sigma. */
static void quad_margin(const struct quadrilateral *q, double x, double y, double blur_px,
                        double margin[2])
{
    const double reach = fmax(MARGIN_PX, HALF_PX + TAIL * blur_px);
    double a[2], b[2], c[2];
    quad_at(q, x, y, a);
    quad_at(q, x + reach, y, b);
    quad_at(q, x, y + reach, c);
    margin[0] = fabs(b[0] - a[0]) + fabs(c[0] - a[0]);
    margin[1] = fabs(b[1] - a[1]) + fabs(c[1] - a[1]);
}

/* ---- the paper of the tags --------------------------------------------------------------------
 */

/** Is the printed tag white at (s, t)? Beyond the pattern nothing is known to be. */
static bool white_at(const struct tag_pattern *p, double s, double t)
{
    int column = (int)floor(p->begin + s * p->side), row = (int)floor(p->begin + (1 - t) * p->side);
    return column >= 0 && column < p->width && row >= 0 && row < p->width
           && p->cell[row][column] == CELL_WHITE;
}

/** Is it white all over the margin around (s, t)? Looked at in steps that no bit fits between. */
static bool all_white(const struct tag_pattern *pattern, const double st[2], const double margin[2])
{
    int steps[2];
    for (int a = 0; a < 2; a++)
        steps[a] = 1 + (int)(2 * margin[a] * pattern->side);
    for (int j = 0; j <= steps[1]; j++)
        for (int i = 0; i <= steps[0]; i++)
            if (!white_at(pattern, st[0] + margin[0] * (2.0 * i / steps[0] - 1),
                          st[1] + margin[1] * (2.0 * j / steps[1] - 1)))
                return false;
    return true;
}

static const struct tag_place *place_of(const struct capture *capture, int id)
{
    for (int i = 0; i < capture->tags; i++)
        if (capture->tag[i].id == id)
            return &capture->tag[i];
    return NULL;
}

static enum status paper_facets(struct facets *facets, const struct radiance *map,
                                const struct calibration *c, int v, const struct seen_tag *seen,
                                int tag, const struct tag_place *place,
                                const struct tag_pattern *pattern, struct error *err)
{
    struct quadrilateral q = quad_of(seen->corner);
    struct facet_sums quarter[4];
    memset(quarter, 0, sizeof quarter);
    int range[4];
    quad_range(&q, map, 0.2, range);
    double margin[2];
    quad_margin(&q, 0.5 * (q.box[0] + q.box[2]), 0.5 * (q.box[1] + q.box[3]), c->view[v].blur_px,
                margin);
    const struct lattice lattice = lattice_of(map, range);
    for (int y = range[1]; y <= range[3]; y++)
        for (int x = range[0]; x <= range[2] && cal_on_lattice(lattice, y); x++) {
            double st[2];
            if (!cal_on_lattice(lattice, x))
                continue;
            quad_at(&q, x, y, st);
            if (all_white(pattern, st, margin))
                facet_sums_add(&quarter[(st[0] > 0.5) + 2 * (st[1] > 0.5)], map, x, y, st[0],
                               st[1]);
        }
    vec3 eye = cal_eye(c->view[v].view_from_world);
    vec3 normal = vec3_cross(place->x_axis, place->y_axis);
    vec3 right = vec3_scale(place->x_axis, place->size);
    vec3 up = vec3_scale(place->y_axis, place->size);
    vec3 corner = vec3_sub(place->center, vec3_scale(vec3_add(right, up), 0.5));
    for (int k = 0; k < 4; k++) {
        const struct facet_sums *s = &quarter[k];
        struct facet facet = {
            .view = v, .material = MATERIAL_PAPER, .place = 4 * tag + k, .normal = normal};
        if (s->count < SITES_MIN || !facet_of_sums(s, SPREAD_MAX, &facet) || !facet.bright)
            continue;
        facet_of_place(s, corner, right, up, &facet);
        double reach = 0.35 * place->size + OCCLUSION_MM;
        if (cal_in_the_way(c, eye, facet.point, reach))
            continue;
        enum status status = append(facets, &facet, err);
        if (status)
            return status;
    }
    return STATUS_OK;
}

/* ---- the patches ------------------------------------------------------------------------------
 */

static vec3 on_patch(const struct patch *p, double s, double t)
{
    vec3 low = vec3_add(vec3_scale(p->corner[0], 1 - s), vec3_scale(p->corner[1], s));
    vec3 high = vec3_add(vec3_scale(p->corner[3], 1 - s), vec3_scale(p->corner[2], s));
    return vec3_add(vec3_scale(low, 1 - t), vec3_scale(high, t));
}

/** Where a facet's photosites lie on a patch, which is flat there. */
static void place_on_patch(const struct patch *p, const struct facet_sums *sums,
                           struct facet *facet)
{
    double s = sums->place[0] / sums->count, t = sums->place[1] / sums->count;
    vec3 middle = on_patch(p, s, t), right = vec3_sub(on_patch(p, 1, t), on_patch(p, 0, t));
    vec3 up = vec3_sub(on_patch(p, s, 1), on_patch(p, s, 0));
    vec3 origin = vec3_sub(middle, vec3_add(vec3_scale(right, s), vec3_scale(up, t)));
    facet_of_place(sums, origin, right, up, facet);
}

static enum status patch_facets(struct facets *facets, const struct radiance *map,
                                const struct calibration *c, int v, const struct patch *patch,
                                int material, int first, struct error *err)
{
    const struct view *view = &c->view[v];
    vec3 eye = cal_eye(view->view_from_world);
    vec3 normal = vec3_normalize(vec3_cross(vec3_sub(patch->corner[1], patch->corner[0]),
                                            vec3_sub(patch->corner[3], patch->corner[0])));
    double corner[4][2];
    for (int k = 0; k < 4; k++) {
        vec3 p = cal_to_view(view->view_from_world, patch->corner[k]);
        if (p.z <= 0 || vec3_dot(vec3_sub(eye, patch->corner[k]), normal) <= 0)
            return STATUS_OK;
        cal_project(&c->camera[view->camera], p, corner[k]);
    }
    struct quadrilateral q = quad_of((const double(*)[2])corner);
    struct facet_sums sums[PATCH_FACETS * PATCH_FACETS];
    memset(sums, 0, sizeof sums);
    int range[4];
    quad_range(&q, map, 0, range);
    const struct lattice lattice = lattice_of(map, range);
    for (int y = range[1]; y <= range[3]; y++)
        for (int x = range[0]; x <= range[2] && cal_on_lattice(lattice, y); x++) {
            double st[2], margin[2];
            if (!cal_on_lattice(lattice, x))
                continue;
            quad_at(&q, x, y, st);
            quad_margin(&q, x, y, view->blur_px, margin);
            if (st[0] < margin[0] || st[0] > 1 - margin[0] || st[1] < margin[1]
                || st[1] > 1 - margin[1])
                continue;
            int i = (int)(st[0] * PATCH_FACETS), j = (int)(st[1] * PATCH_FACETS);
            facet_sums_add(&sums[j * PATCH_FACETS + i], map, x, y, st[0], st[1]);
        }
    double reach = vec3_length(vec3_sub(patch->corner[2], patch->corner[0])) / PATCH_FACETS / 2;
    for (int k = 0; k < PATCH_FACETS * PATCH_FACETS; k++) {
        struct facet facet = {
            .view = v, .material = material, .place = first + k, .normal = normal};
        if (sums[k].count < SITES_MIN || !facet_of_sums(&sums[k], SPREAD_MAX, &facet)
            || !facet.bright)
            continue;
        place_on_patch(patch, &sums[k], &facet);
        if (cal_in_the_way(c, eye, facet.point, reach + OCCLUSION_MM))
            continue;
        enum status status = append(facets, &facet, err);
        if (status)
            return status;
    }
    return STATUS_OK;
}

enum status cal_board_facets(struct facets *facets, const struct radiance *map,
                             const struct calibration *c, int v, const struct capture *capture,
                             const struct tag_family *family, struct error *err)
{
    const struct view *view = &c->view[v];
    enum status status = STATUS_OK;
    for (int i = 0; i < view->tags && !status; i++) {
        struct tag_pattern pattern;
        const struct tag_place *place = place_of(capture, view->tag[i].id);
        if (place && !(status = pattern_of(&pattern, family, place->id, err)))
            status = paper_facets(facets, map, c, v, &view->tag[i], (int)(place - capture->tag),
                                  place, &pattern, err);
    }
    for (int k = 0; k < capture->patches && !status; k++)
        status = patch_facets(facets, map, c, v, &capture->patch[k], MATERIAL_PATCH + k,
                              4 * capture->tags + PATCH_FACETS * PATCH_FACETS * k, err);
    return status;
}

/* ---- the sample -------------------------------------------------------------------------------
 */

/** The sample's bounding square in the map, in pixels; false: it is not in it. */
static bool sample_range(const struct calibration *c, const struct view *view,
                         const struct radiance *map, int range[4], double *radius_px)
{
    const struct camera *camera = &c->camera[view->camera];
    vec3 p = cal_to_view(view->view_from_world, c->sample.center);
    const double reach = cal_solid_reach(&c->sample);
    if (p.z <= 1.05 * reach)
        return false;
    double pixel[2];
    cal_project(camera, p, pixel);
    *radius_px = camera->focal[0] * reach / (vec3_length(p) - reach);
    range[0] = (int)fmax(pixel[0] - 1.3 * *radius_px, 0);
    range[1] = (int)fmax(pixel[1] - 1.3 * *radius_px, 0);
    range[2] = (int)fmin(pixel[0] + 1.3 * *radius_px, map->width - 1);
    range[3] = (int)fmin(pixel[1] + 1.3 * *radius_px, map->height - 1);
    return range[0] < range[2] && range[1] < range[3];
}

/** One block of side x side photosites from (x, y), all of which must show the sample. */
static bool sample_block(const struct radiance *map, int x, int y, int side, double blur_px,
                         struct facet *facet)
{
    struct facet_sums s = {.count = 0};
    for (int j = 0; j < side; j++)
        for (int i = 0; i < side; i++)
            facet_sums_add(&s, map, x + i, y + j, 0, 0);
    if (s.count < side * side || !facet_of_sums(&s, 0.25, facet))
        return false;
    double bend[3] = {0, 0, 0};
    if (facet->bright)
        facet_bend(map, x, y, side, blur_px, bend);
    // A geometry wrong by a tenth of a photosite moves radiance by that part of its slope; and a
    // block's mean differs from its middle by a part of the spread.
    double spread = (s.high - s.low) / (0.5 * (s.high + s.low));
    for (int c = 0; c < 3 && facet->bright; c++) {
        facet->log_value[c] = facet->log_seen[c] = log(facet->mean[c] - bend[c]);
        facet->sigma[c] = facet->sigma_seen[c] =
            hypot(facet->sigma[c], 0.1 * spread / side + 0.05 * spread);
    }
    return true;
}

/** The sample in one view. */
struct sample_look {
    const struct calibration *c;
    const struct camera *camera;
    mat3 rotation;
    vec3 eye;
    double radius_px;
};

static solid_hit meet_at(const struct sample_look *l, double x, double y, vec3 *ray)
{
    const double pixel[2] = {x, y};
    *ray = mat3_mul_t(&l->rotation, cal_ray(l->camera, pixel));
    return cal_solid_meet(&l->c->sample, l->eye, *ray);
}

/** Do a block about (x, y) and two photosites of blur around it lie on the sample? Of a sphere the
 *  outline's distance tells: at cos_o it is R (1 - sin) away. Of others, the corners: they must
 *  show the same smooth piece. */
static bool lies_on(const struct sample_look *l, double x, double y, int side, solid_hit middle,
                    vec3 ray)
{
    if (l->c->sample.shape == SHAPE_SPHERE) {
        double cos_o = -vec3_dot(middle.normal, ray);
        return l->radius_px * (1 - sqrt(fmax(1 - cos_o * cos_o, 0))) >= 0.75 * side + 2;
    }
    for (int k = 0; k < 4; k++) {
        double off = 0.5 * side + 2;
        vec3 unused;
        solid_hit hit = meet_at(l, x + (k % 2 ? off : -off), y + (k / 2 ? off : -off), &unused);
        if (hit.s == INFINITY || hit.cap || vec3_dot(hit.normal, middle.normal) < SMOOTH_COS
            || fabs(hit.s - middle.s) > 0.5 * l->c->sample.radius)
            return false;
    }
    return true;
}

enum status cal_sample_facets(struct facets *facets, const struct radiance *map,
                              const struct calibration *c, int v, int wanted, struct error *err)
{
    const struct view *view = &c->view[v];
    struct sample_look look = {.c = c,
                               .camera = &c->camera[view->camera],
                               .rotation = cal_rotation(view->view_from_world.rotation),
                               .eye = cal_eye(view->view_from_world)};
    int range[4];
    if (!sample_range(c, view, map, range, &look.radius_px))
        return STATUS_OK;
    int side = (int)ceil(sqrt(CAP_PI * look.radius_px * look.radius_px / wanted));
    int cell = *map->cfa ? cap_cfa_side(map->cfa) : 1;
    side = (side + cell - 1) / cell * cell;  // whole cells of a mosaic
    for (int y = range[1]; y + side <= range[3] + 1; y += side)
        for (int x = range[0]; x + side <= range[2] + 1; x += side) {
            struct facet facet = {.view = v, .material = MATERIAL_SAMPLE, .place = -1};
            double middle[2] = {x + 0.5 * (side - 1), y + 0.5 * (side - 1)};
            vec3 ray;
            solid_hit hit = meet_at(&look, middle[0], middle[1], &ray);
            if (hit.s == INFINITY || hit.cap
                || !lies_on(&look, middle[0], middle[1], side, hit, ray)
                || !sample_block(map, x, y, side, view->blur_px, &facet))
                continue;
            facet.point = vec3_add(look.eye, vec3_scale(ray, hit.s));
            facet.normal = hit.normal;
            if (cal_ball_between(c, look.eye, facet.point, OCCLUSION_MM))
                continue;
            enum status status = append(facets, &facet, err);
            if (status)
                return status;
        }
    return STATUS_OK;
}
