/* bounce_map.c -- what the lit board adds to a view's photosites on the sample.
 *
 * Method.   The sum over thousands of cells of the board, by a table where one is known and by
 *           cal_bounce() before that, is smooth over the sample: it is taken on a grid of a
 *           fortieth of the sample's box, finer for a narrow lobe and where it bends
 *           (bounce_grid.c), down to photosites. Near a ball's outline, where it rises with
 *           Fresnel's term, the grid is one of azimuth about the ball's middle and of cos_o; on
 *           other shapes it is taken at the photosite there. A photosite and its lens see a mean
 *           of that: where a ball is some tens of photosites wide, what it mirrors near its
 *           outline is brighter in the mean than in the middle, by several per cent.
 */
#include "bounce_map.h"

#include "surface.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { GRID = 40, GRID_MAX = 100, TURNS = 96, RINGS = 36, CUTS_MAX = 8 };
static const double GRID_GLOSS = 3;  // over the lobe's half width: nodes across the sample
// Cosine below which the grid of pixels has no nodes; on a ball, it has them further out, for
// bends, and the grid near the outline takes over at NEAR, and reaches past it for the same reason.
static const double GRAZING = 0.35, GRAZING_BALL = 0.03, NEAR = 0.45, REACH = 0.55;

// Light that an f of 0.1 % reflectance makes of the lamp's: below it nobody asks.
static double faint_light(const struct viewing *v)
{
    double falloff, sum = v->light[0] + v->light[1] + v->light[2];
    cal_lamp_way(v->lamp, v->view->view_from_world, v->sample->center, &falloff);
    return 1e-3 / CAP_PI * sum * falloff;
}

static bounce_source pixel_source, rim_source;

static bool begin_grids(struct bounce_map *m)
{
    const pixel_box box = m->box;
    const int across = box.x1 - box.x0 > box.y1 - box.y0 ? box.x1 - box.x0 : box.y1 - box.y0;
    int grid = GRID;
    if (m->viewing->table) {  // what a narrow lobe mirrors changes faster
        m->through = rec_bounce_through(m->viewing->table);
        grid = (int)fmin(GRID_MAX, fmax(GRID, GRID_GLOSS / m->through.gloss));
    }
    m->step = 1 + across / grid;
    const int cuts_max = m->through.table ? CUTS_MAX : 1;  // a first guess is not worth more
    m->pixels = (struct bounce_grid){.columns = (box.x1 - box.x0) / m->step + 2,
                                     .rows = (box.y1 - box.y0) / m->step + 2,
                                     .cuts_max = m->step < cuts_max ? m->step : cuts_max,
                                     .faint = faint_light(m->viewing),
                                     .source = pixel_source};
    m->rim = (struct bounce_grid){.columns = TURNS * grid / GRID,
                                  .rows = RINGS + 1,
                                  .around = true,
                                  .cuts_max = cuts_max,
                                  .faint = m->pixels.faint,
                                  .source = rim_source};
    return rec_grid_begin(&m->pixels) && rec_grid_begin(&m->rim);
}

enum status rec_bounce_make(struct bounce_map *map, const struct calibration *calibration, int view,
                            const struct viewing *viewing, pixel_box box, struct error *err)
{
    struct bounce_map m = {
        .calibration = calibration, .viewing = viewing, .view = view, .box = box};
    if (calibration->surroundings.count && calibration->surroundings.strength > 0
        && !begin_grids(&m)) {
        rec_bounce_free(&m);
        return cap_fail(err, STATUS_MEMORY, "the board's light in view %s", viewing->view->name);
    }
    *map = m;
    return STATUS_OK;
}

void rec_bounce_free(struct bounce_map *map)
{
    rec_grid_free(&map->pixels);
    rec_grid_free(&map->rim);
    *map = (struct bounce_map){0};
}

static struct bounced_light bounce(const struct bounce_map *m, vec3 point, vec3 n, vec3 wo)
{
    const struct surroundings *s = &m->calibration->surroundings;
    const struct view *view = &m->calibration->view[m->view];
    struct bounced_light light = {{0}, 0};
    if (!m->through.table || vec3_dot(wo, n) <= 0) {
        cal_bounce(m->calibration, m->view, point, n, wo, light.radiance);
        return light;
    }
    const struct glow *glow = s->glow + (size_t)view->light * (size_t)s->count;
    light = rec_bounce_sum(&m->through, glow, s->count, point, n, wo);
    for (int c = 0; c < 3; c++)
        light.radiance[c] *= view->power * s->strength;
    return light;
}

// A place of the grid of pixels, in steps.
static bool pixel_source(const void *of, double u, double v, struct bounced_light *light)
{
    const struct bounce_map *m = of;
    const struct viewing *viewing = m->viewing;
    const double pixel[2] = {m->box.x0 + u * m->step, m->box.y0 + v * m->step};
    vec3 ray = mat3_mul_t(&viewing->view_from_world, cal_ray(viewing->camera, pixel));
    meeting at = rec_meet(viewing->sample, viewing->eye, ray);
    const double least = viewing->sample->shape == SHAPE_SPHERE ? GRAZING_BALL : GRAZING;
    if (!at.hit || !(-vec3_dot(at.normal, ray) > least))
        return false;
    *light = bounce(m, at.point, at.normal, vec3_scale(ray, -1));
    return true;
}

// The eye from a ball's middle: z, and two directions across. Its length is returned.
static double rim_frame(const struct viewing *v, vec3 frame[3])
{
    vec3 to_eye = vec3_sub(v->eye, v->sample->center);
    double distance = vec3_length(to_eye);
    frame[2] = vec3_scale(to_eye, 1 / distance);
    frame[0] = vec3_normalize(
        vec3_cross(fabs(frame[2].x) < 0.7 ? (vec3){1, 0, 0} : (vec3){0, 1, 0}, frame[2]));
    frame[1] = vec3_cross(frame[2], frame[0]);
    return distance;
}

// A place of the grid near the outline, by turn and ring: where the sight line leaves the ball at
// theta_o, which is the angle of n from the eye's direction plus that at the eye (law of sines).
static bool rim_source(const void *of, double turn, double ring, struct bounced_light *light)
{
    const struct bounce_map *m = of;
    const struct viewing *v = m->viewing;
    vec3 f[3];
    double distance = rim_frame(v, f), theta_o = acos(REACH * fmax(ring, 0.01) / RINGS);
    double off = theta_o - asin(v->sample->radius / distance * sin(theta_o));
    double a = 2 * CAP_PI * turn / m->rim.columns;
    vec3 n = vec3_add(
        vec3_scale(f[2], cos(off)),
        vec3_scale(vec3_add(vec3_scale(f[0], cos(a)), vec3_scale(f[1], sin(a))), sin(off)));
    vec3 point = vec3_add(v->sample->center, vec3_scale(n, v->sample->radius));
    *light = bounce(m, point, n, vec3_normalize(vec3_sub(v->eye, point)));
    return true;
}

static bool bounce_near_rim(struct bounce_map *m, const sight *a, struct bounced_light *light)
{
    vec3 f[3];
    rim_frame(m->viewing, f);
    double turn = atan2(vec3_dot(a->normal, f[1]), vec3_dot(a->normal, f[0])) / (2 * CAP_PI);
    double ring = vec3_dot(a->normal, a->wo) / REACH * RINGS;
    return rec_grid_at(&m->rim, turn * m->rim.columns, ring, light);
}

// At a place of the image that sees a.
static struct bounced_light light_at(struct bounce_map *m, const sight *a, double x, double y)
{
    struct bounced_light light = {{0}, 0};
    double u = (x - m->box.x0) / m->step, v = (y - m->box.y0) / m->step;
    double cos_o = vec3_dot(a->normal, a->wo);
    bool near = m->viewing->sample->shape == SHAPE_SPHERE && cos_o > 0 && cos_o < NEAR;
    if (near ? bounce_near_rim(m, a, &light) : rec_grid_at(&m->pixels, u, v, &light))
        return light;
    return bounce(m, a->point, a->normal, a->wo);
}

struct bounced_light rec_bounce_at(struct bounce_map *m, const sight *a, int x, int y)
{
    if (!m->pixels.node)
        return (struct bounced_light){{0}, 0};
    m->pixels.of = m->rim.of = m;
    return light_at(m, a, x, y);
}

// Beside a photosite; false: past the outline.
static bool light_beside(struct bounce_map *m, double x, double y, struct bounced_light *light)
{
    const struct viewing *v = m->viewing;
    const double pixel[2] = {x, y};
    const pixel_box box = m->box;
    if (!(x >= box.x0 && x < box.x1 && y >= box.y0 && y < box.y1))
        return false;
    vec3 ray = mat3_mul_t(&v->view_from_world, cal_ray(v->camera, pixel));
    meeting at = rec_meet(v->sample, v->eye, ray);
    const sight a = {at.point, at.normal, vec3_scale(ray, -1)};
    if (!at.hit || !(vec3_dot(a.wo, a.normal) > 0))
        return false;
    *light = light_at(m, &a, x, y);
    return true;
}

// A mean over a Gaussian of variance s^2 is that of three places 0 and +-h with weights 1 - 2 w, w
// and w, w = s^2/(2 h^2): where h = sqrt(3) s, to the fifth order. Steps shorter than the grid's
// show its corners.
struct bounced_light rec_bounce_seen(struct bounce_map *m, const sight *a, int x, int y)
{
    struct bounced_light light = rec_bounce_at(m, a, x, y), side[2];
    if (!m->through.table || m->viewing->sample->shape != SHAPE_SPHERE)
        return light;
    const struct bounced_light middle = light;
    const double blur = m->viewing->view->blur_px, variance = blur * blur + 1.0 / 12;
    const bool near = vec3_dot(a->normal, a->wo) < NEAR;
    const double h = fmax(sqrt(3 * variance), near ? 0 : m->step), w = variance / (2 * h * h);
    for (int axis = 0; axis < 2; axis++) {
        const double dx = axis ? 0 : h, dy = axis ? h : 0;
        if (!light_beside(m, x - dx, y - dy, &side[0])
            || !light_beside(m, x + dx, y + dy, &side[1]))
            continue;
        for (int c = 0; c < 3; c++)
            light.radiance[c] +=
                w * (side[0].radiance[c] - 2 * middle.radiance[c] + side[1].radiance[c]);
    }
    return light;
}
