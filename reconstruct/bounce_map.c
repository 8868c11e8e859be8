/* bounce_map.c -- what the lit board adds to a view's photosites on the sample.
 *
 * Method.   The sum over thousands of cells of the board, by a table where one is known and by
 *           cal_bounce() before that, is smooth over the sample: it is taken on a grid of a
 *           fortieth of the sample's box, finer for a narrow lobe, and interpolated. Near a ball's
 *           outline, where it rises with Fresnel's term, the grid is one of azimuth about the
 *           ball's middle and of cos_o; on other shapes it is taken at the photosite there.
 */
#include "bounce_map.h"

#include "surface.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { GRID = 40, GRID_MAX = 100, TURNS = 96, RINGS = 36 };
static const double GRID_GLOSS = 3;  // over the lobe's half width: nodes across the sample
static const double GRAZING = 0.35;  // cosine below which the grid of pixels has no nodes
// Cosine up to which the grid near the outline reaches: past every cell of pixels that GRAZING
// cuts.
static const double REACH = 0.55;

enum node_state { NODE_UNKNOWN, NODE_GOOD, NODE_OFF };
struct bounce_node {
    enum node_state state;
    struct bounced_light light;
};

enum status rec_bounce_make(struct bounce_map *map, const struct calibration *calibration, int view,
                            const struct viewing *viewing, pixel_box box, struct error *err)
{
    struct bounce_map m = {
        .calibration = calibration, .viewing = viewing, .view = view, .box = box};
    const int across = box.x1 - box.x0 > box.y1 - box.y0 ? box.x1 - box.x0 : box.y1 - box.y0;
    m.turns = TURNS;
    if (calibration->surroundings.count && calibration->surroundings.strength > 0) {
        int grid = GRID;
        if (viewing->table) {  // what a narrow lobe mirrors changes faster
            m.through = rec_bounce_through(viewing->table);
            grid = (int)fmin(GRID_MAX, fmax(GRID, GRID_GLOSS / m.through.gloss));
        }
        m.turns = TURNS * grid / GRID;
        m.step = 1 + across / grid;
        m.columns = (box.x1 - box.x0) / m.step + 2;
        m.rows = (box.y1 - box.y0) / m.step + 2;
        m.node = calloc((size_t)m.columns * (size_t)m.rows, sizeof *m.node);
        m.rim = calloc((size_t)m.turns * (RINGS + 1), sizeof *m.rim);
        if (!m.node || !m.rim) {
            rec_bounce_free(&m);
            return cap_fail(err, STATUS_MEMORY, "%d x %d bounced nodes", m.columns, m.rows);
        }
    }
    *map = m;
    return STATUS_OK;
}

void rec_bounce_free(struct bounce_map *map)
{
    free(map->node);
    free(map->rim);
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

/** The node (i, j), computed when it is first asked for. */
static const struct bounce_node *node_at(struct bounce_map *m, int i, int j)
{
    struct bounce_node *node = &m->node[(size_t)j * (size_t)m->columns + (size_t)i];
    if (node->state != NODE_UNKNOWN)
        return node;
    const double pixel[2] = {m->box.x0 + (double)i * m->step, m->box.y0 + (double)j * m->step};
    const struct viewing *v = m->viewing;
    vec3 ray = mat3_mul_t(&v->view_from_world, cal_ray(v->camera, pixel));
    meeting at = rec_meet(v->sample, v->eye, ray);
    node->state = at.hit && -vec3_dot(at.normal, ray) > GRAZING ? NODE_GOOD : NODE_OFF;
    if (node->state == NODE_GOOD)
        node->light = bounce(m, at.point, at.normal, vec3_scale(ray, -1));
    return node;
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

// The node of a turn and a ring: where the sight line leaves the ball at theta_o, which is the
// angle of n from the eye's direction plus that at the eye (law of sines).
static const struct bounce_node *rim_at(struct bounce_map *m, int turn, int ring)
{
    struct bounce_node *node = &m->rim[turn * (RINGS + 1) + ring];
    if (node->state != NODE_UNKNOWN)
        return node;
    const struct viewing *v = m->viewing;
    vec3 f[3];
    double distance = rim_frame(v, f), theta_o = acos(REACH * fmax(ring, 0.01) / RINGS);
    double off = theta_o - asin(v->sample->radius / distance * sin(theta_o));
    double a = 2 * CAP_PI * turn / m->turns;
    vec3 n = vec3_add(
        vec3_scale(f[2], cos(off)),
        vec3_scale(vec3_add(vec3_scale(f[0], cos(a)), vec3_scale(f[1], sin(a))), sin(off)));
    vec3 point = vec3_add(v->sample->center, vec3_scale(n, v->sample->radius));
    node->light = bounce(m, point, n, vec3_normalize(vec3_sub(v->eye, point)));
    node->state = NODE_GOOD;
    return node;
}

static void add_part(struct bounced_light *to, const struct bounce_node *node, double weight)
{
    for (int c = 0; c < 3; c++)
        to->radiance[c] += weight * node->light.radiance[c];
    to->doubt += weight * node->light.doubt;
}

static struct bounced_light bounce_near_rim(struct bounce_map *m, const sight *a)
{
    struct bounced_light light = {{0}, 0};
    const int turns = m->turns;
    vec3 f[3];
    rim_frame(m->viewing, f);
    double turn =
        atan2(vec3_dot(a->normal, f[1]), vec3_dot(a->normal, f[0])) / (2 * CAP_PI) * turns;
    double ring = vec3_dot(a->normal, a->wo) / REACH * RINGS;
    int i = (int)floor(turn), j = (int)fmin(floor(ring), RINGS - 1);
    double s = turn - i, t = ring - j;
    const double weight[4] = {(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t};
    for (int k = 0; k < 4; k++)
        add_part(&light, rim_at(m, (i + (k & 1) + 2 * turns) % turns, j + (k >> 1)), weight[k]);
    return light;
}

struct bounced_light rec_bounce_at(struct bounce_map *m, const sight *a, int x, int y)
{
    struct bounced_light light = {{0}, 0};
    if (!m->node)
        return light;
    int i = (x - m->box.x0) / m->step, j = (y - m->box.y0) / m->step;
    double s = (double)(x - m->box.x0) / m->step - i, t = (double)(y - m->box.y0) / m->step - j;
    const double weight[4] = {(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t};
    for (int k = 0; k < 4; k++) {
        const struct bounce_node *node = node_at(m, i + (k & 1), j + (k >> 1));
        if (node->state == NODE_OFF) {
            double cos_o = vec3_dot(a->normal, a->wo);
            bool ball = m->viewing->sample->shape == SHAPE_SPHERE;
            return ball && cos_o > 0 && cos_o < REACH ? bounce_near_rim(m, a)
                                                      : bounce(m, a->point, a->normal, a->wo);
        }
        add_part(&light, node, weight[k]);
    }
    return light;
}
