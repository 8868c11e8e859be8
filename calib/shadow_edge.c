/* shadow_edge.c -- the edge of a sphere's cast shadow on the board, piece by piece.
 *
 * Method.   Across the edge the board is lit by as much of the lamp's disc as stands out behind the
 *           sphere's limb, which is straight at that scale: a semicircle's integral F of half width
 *           w = spread radius, blurred by lens and photosite (normal, sigma b):
 *
 *               L(t) = D(t) + (B(t) - D(t)) F((t - off)/w, b),   D, B: straight lines
 *
 *           D is what else lights the shadow, B holds the lamp's fall-off. For each off the four
 *           numbers of the lines follow by linear least squares; off by search. Half of F lies at
 *           the disc's middle whatever its size.
 */
#include "shadow_edge.h"

#include "dense.h"
#include "outline.h"
#include "solid.h"

#include <string.h>

static const double FLAT_MM = 1;         // of the tags' plane
static const double REACH = 0.22;        // of the radius: photosites on each side of the edge
static const double REACH_PX = 5;        // and at least as many
static const double LENGTH_PX = 6;       // along the edge
static const double PAPER = 0.68;        // half a tag with its white margin, of its side
static const double CLEAR_MM = 2;        // from patches, and from the sample as the camera sees it
static const double UNEVEN = 0.003;      // of paper, from place to place
static const double CONTRAST_MIN = 0.4;  // of the shadow: what little is darker is something else
enum { NODES = 10, SCAN = 11, SITES_MIN = 30 };

bool shadow_board(struct board_plane *plane, const struct capture *capture)
{
    if (capture->tags < 1)
        return false;
    const struct tag_place *first = &capture->tag[0];
    struct board_plane p = {.point = first->center, .x = first->x_axis};
    p.normal = vec3_normalize(vec3_cross(first->x_axis, first->y_axis));
    p.y = vec3_cross(p.normal, p.x);
    for (int i = 0; i < capture->tags; i++)
        for (int k = 0; k < 4; k++) {
            vec3 off = vec3_sub(cap_tag_corner(&capture->tag[i], k), p.point);
            const double at[2] = {vec3_dot(off, p.x), vec3_dot(off, p.y)};
            if (fabs(vec3_dot(off, p.normal)) > FLAT_MM)
                return false;
            for (int a = 0; a < 2; a++) {
                p.low[a] = fmin(p.low[a], at[a]);
                p.high[a] = fmax(p.high[a], at[a]);
            }
        }
    *plane = p;
    return true;
}

/* ---- where it is looked for ------------------------------------------------------------------ */

/** Where the lamp's ray past the sphere's limb at azimuth phi meets the board; false: it does not.
 */
static bool shadow_point(vec3 *at, const struct cone *cone, double phi,
                         const struct board_plane *plane)
{
    vec3 ray = cal_cone_ray(cone, cone->half_angle, phi);
    double down = -vec3_dot(ray, plane->normal);
    double s = vec3_dot(vec3_sub(cone->eye, plane->point), plane->normal) / down;
    if (down < 0.05 || s <= 0)
        return false;
    *at = vec3_add(cone->eye, vec3_scale(ray, s));
    return true;
}

/** Is a place bare board, `margin` around it: within the tags' rectangle, but on no tag or patch?
 */
static bool is_bare(vec3 at, double margin, const struct capture *capture,
                    const struct board_plane *plane)
{
    vec3 off = vec3_sub(at, plane->point);
    const double place[2] = {vec3_dot(off, plane->x), vec3_dot(off, plane->y)};
    for (int a = 0; a < 2; a++)
        if (place[a] < plane->low[a] + margin || place[a] > plane->high[a] - margin)
            return false;
    for (int i = 0; i < capture->tags; i++) {
        const struct tag_place *tag = &capture->tag[i];
        vec3 from = vec3_sub(at, tag->center);
        double half = PAPER * tag->size + margin;
        if (fabs(vec3_dot(from, tag->x_axis)) < half && fabs(vec3_dot(from, tag->y_axis)) < half)
            return false;
    }
    for (int i = 0; i < capture->patches; i++) {
        const vec3 *corner = capture->patch[i].corner;
        vec3 middle = vec3_scale(vec3_add(corner[0], corner[2]), 0.5);
        double reach = 0.5 * vec3_length(vec3_sub(corner[2], corner[0])) + margin + CLEAR_MM;
        if (vec3_length(vec3_sub(at, middle)) < reach)
            return false;
    }
    return true;
}

/** A piece's frame in the image: its pixel, and pixels a millimetre across and along the edge. */
struct frame {
    double pixel[2], by_across[2], by_along[2];
};

static bool frame_at(struct frame *f, const struct shadow_piece *p, vec3 along,
                     const struct camera *camera, const struct view *view)
{
    double across[2], beside[2];
    vec3 at = cal_to_view(view->view_from_world, p->point);
    if (at.z <= 0)
        return false;
    cal_project(camera, at, f->pixel);
    cal_project(camera, cal_to_view(view->view_from_world, vec3_add(p->point, p->across)), across);
    cal_project(camera, cal_to_view(view->view_from_world, vec3_add(p->point, along)), beside);
    for (int a = 0; a < 2; a++) {
        f->by_across[a] = across[a] - f->pixel[a];
        f->by_along[a] = beside[a] - f->pixel[a];
    }
    return true;
}

/** Collect the photosites within reach (mm) across and half a length along; the edge bends by
 *  bend t^2 at t along it. */
static void collect(struct shadow_piece *p, const struct frame *f, double reach, double half,
                    double bend, const struct radiance *map)
{
    const double det = f->by_across[0] * f->by_along[1] - f->by_across[1] * f->by_along[0];
    double box[2] = {0};
    for (int a = 0; a < 2; a++)
        box[a] = reach * fabs(f->by_across[a]) + half * fabs(f->by_along[a]) + 1;
    int x0 = (int)fmax(f->pixel[0] - box[0], 0),
        x1 = (int)fmin(f->pixel[0] + box[0], map->width - 1);
    int y0 = (int)fmax(f->pixel[1] - box[1], 0);
    int y1 = (int)fmin(f->pixel[1] + box[1], map->height - 1);
    double area = 4 * reach * half * fabs(det);
    int step = 1 + (int)sqrt(area / SHADOW_SITES);
    for (int y = y0; y <= y1; y += step)
        for (int x = x0; x <= x1 && p->sites < SHADOW_SITES; x += step) {
            double dx = x - f->pixel[0], dy = y - f->pixel[1];
            double t = (dx * f->by_along[1] - dy * f->by_along[0]) / det;
            double u = (dy * f->by_across[0] - dx * f->by_across[1]) / det;
            float value[3], variance[3];
            if (fabs(t) > reach || fabs(u) > half)
                continue;
            cap_radiance_at(map, x, y, value, variance);
            if (isfinite(variance[1]))  // green: one channel, so that mosaics do not mix them
                p->site[p->sites++] = (struct shadow_site){
                    (float)(t - bend * u * u), value[1],
                    (float)hypot(sqrt((double)variance[1]), UNEVEN * (double)value[1])};
        }
}

/** The limb is between lamp and board: what it blurs is as the ways from it, and slants. */
static double spread_at(const struct shadow_piece *p, const struct cone *cone,
                        const struct sample *sample)
{
    vec3 to_center = vec3_sub(sample->center, cone->eye), limb = vec3_sub(p->point, cone->eye);
    double whole = vec3_length(limb);
    double to_limb = sqrt(vec3_dot(to_center, to_center) - sample->radius * sample->radius);
    vec3 ray = vec3_scale(limb, 1 / whole);
    vec3 out = vec3_normalize(vec3_sub(cone->axis, vec3_scale(ray, vec3_dot(cone->axis, ray))));
    return (whole - to_limb) / to_limb / fmax(fabs(vec3_dot(p->across, out)), 0.1);
}

/** The piece at azimuth phi; false: it is not to be seen there. */
static bool make_piece(struct shadow_piece *p, const struct radiance *map,
                       const struct calibration *c, int v, const struct capture *capture,
                       const struct board_plane *plane, const struct cone *cone, double phi)
{
    const struct view *view = &c->view[v];
    const struct camera *camera = &c->camera[view->camera];
    const double step = 0.02;
    vec3 before, after;
    if (!shadow_point(&p->point, cone, phi, plane)
        || !shadow_point(&before, cone, phi - step, plane)
        || !shadow_point(&after, cone, phi + step, plane))
        return false;
    vec3 along = vec3_normalize(vec3_sub(after, before)), eye = cal_eye(view->view_from_world);
    p->across = vec3_cross(along, plane->normal);
    vec3 axis_at = vec3_sub(p->point, c->sample.center);
    if (vec3_dot(p->across,
                 vec3_sub(axis_at, vec3_scale(cone->axis, vec3_dot(axis_at, cone->axis))))
        < 0)
        p->across = vec3_scale(p->across, -1);
    struct frame f;
    if (!frame_at(&f, p, along, camera, view))
        return false;
    vec3 chord = vec3_sub(vec3_scale(vec3_add(before, after), 0.5), p->point);
    double half_chord = 0.5 * vec3_length(vec3_sub(after, before));
    double bend = vec3_dot(chord, p->across) / (half_chord * half_chord);
    double px_across = hypot(f.by_across[0], f.by_across[1]);
    double px_along = hypot(f.by_along[0], f.by_along[1]);
    double reach = fmax(REACH * c->sample.radius, REACH_PX / px_across);
    double half = 0.5 * LENGTH_PX / px_along;
    if (!is_bare(p->point, hypot(reach, half), capture, plane)
        || cal_in_the_way(c, eye, p->point, reach + CLEAR_MM))
        return false;
    // A pixel's blur each way, seen along `across`: by the inverse of the frame.
    double det = f.by_across[0] * f.by_along[1] - f.by_across[1] * f.by_along[0];
    double mm = px_along / fabs(det);
    p->blur = mm * sqrt(view->blur_px * view->blur_px + 1.0 / 12);
    p->spread = spread_at(p, cone, &c->sample);
    p->view = v;
    p->sites = 0;
    collect(p, &f, reach, half, bend, map);
    return p->sites >= SITES_MIN;
}

int shadow_pieces(struct shadow_piece *piece, int have, int most, int count,
                  const struct radiance *map, const struct calibration *c, int v,
                  const struct capture *capture, const struct board_plane *plane)
{
    vec3 at = cal_lamp_position(&c->lamp[c->view[v].light], c->view[v].view_from_world);
    if (vec3_length(vec3_sub(at, c->sample.center)) <= 1.01 * c->sample.radius)
        return have;
    struct cone cone = cal_outline_cone(at, c->sample.center, c->sample.radius);
    for (int k = 0; k < count && have < most; k++)
        have += make_piece(&piece[have], map, c, v, capture, plane, &cone, 2 * CAP_PI * k / count);
    return have;
}

/* ---- where it is ----------------------------------------------------------------------------- */

/** F of the lamp's disc of half width w, blurred by b: Gauss-Chebyshev of the second kind. */
static double lit_share(double t, double w, double b)
{
    const double far = 6;  // deviations of a Gaussian: all of it but 1e-9
    double sum = 0;
    if (fabs(t) > w + far * b)
        return t > 0 ? 1 : 0;
    if (!(w > 0))
        return 0.5 * erfc(-t / (b * sqrt(2)));
    for (int k = 1; k <= NODES; k++) {
        double a = k * CAP_PI / (NODES + 1), s = sin(a);
        sum += s * s * erfc((w * cos(a) - t) / (b * sqrt(2)));
    }
    return sum / (NODES + 1);
}

/** The sum of squares for an edge at `off`; share: how much darker the shadow is there. */
static double squares(const struct shadow_piece *p, double off, double w, double b, double *share)
{
    double h[4 * 4] = {0}, x[4] = {0}, total = 0, by_x = 0, begun[4];
    for (int i = 0; i < p->sites; i++) {
        const struct shadow_site *s = &p->site[i];
        double f = lit_share((double)s->off - off, w, b), inverse = 1 / (double)s->sigma;
        double t = ((double)s->off - off) * inverse;
        const double row[4] = {(1 - f) * inverse, (1 - f) * t, f * inverse, f * t};
        double y = (double)s->value * inverse;
        total += y * y;
        for (int a = 0; a < 4; a++) {
            x[a] += row[a] * y;
            for (int k = 0; k < 4; k++)
                h[4 * a + k] += row[a] * row[k];
        }
    }
    memcpy(begun, x, sizeof begun);
    if (!dense_cholesky(4, h))
        return INFINITY;
    dense_solve(4, h, x);
    for (int a = 0; a < 4; a++)
        by_x += x[a] * begun[a];
    *share = x[2] > 0 ? 1 - x[0] / x[2] : 0;
    return total - by_x;
}

double shadow_edge_fit(struct shadow_piece *p, double radius, double sharper)
{
    double w = p->spread * radius, b = p->blur * sharper, reach = 0, best = INFINITY, share, at = 0;
    for (int i = 0; i < p->sites; i++)
        reach = fmax(reach, fabs((double)p->site[i].off));
    const double step = reach / SCAN;
    for (int k = -SCAN / 2; k <= SCAN / 2; k++) {
        double s = squares(p, k * step, w, b, &share);
        if (s < best && share > CONTRAST_MIN) {
            best = s;
            at = k * step;
        }
    }
    if (!isfinite(best) || fabs(at) > 0.45 * reach)
        return INFINITY;
    // Parabolas through three places, ever closer.
    double bend = 0;
    for (double h = step; h > 0.01 * b; h *= 0.4) {
        double low = squares(p, at - h, w, b, &share), high = squares(p, at + h, w, b, &share);
        double middle = squares(p, at, w, b, &share);
        bend = (low + high - 2 * middle) / (h * h);
        if (!(bend > 0))
            return INFINITY;
        at += fmax(fmin(0.5 * (low - high) / (bend * h), h), -h);
    }
    best = squares(p, at, w, b, &share);
    p->off = at;
    p->sigma = sqrt(2 / bend);
    return share > CONTRAST_MIN ? best : INFINITY;
}
