/* bounce_map.c -- what the lit board adds to a view's photosites on the sample.
 *
 * Method.   The sum over thousands of cells of the board, by the best fit where one is known and by
 *           cal_bounce() before that, is smooth over the sample: it is taken on a grid of a
 *           fortieth of the sample's box and interpolated. Near a ball's outline, where it rises
 *           with Fresnel's term, the grid is one of azimuth about the ball's middle and of cos_o;
 * on other shapes it is taken at the photosite there.
 */
#include "bounce_map.h"

#include "consensus.h"
#include "surface.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { GRID = 40, TURNS = 96, RINGS = 36 };
static const double GRAZING = 0.35;  // cosine below which the grid of pixels has no nodes
// Cosine up to which the grid near the outline reaches: past every cell of pixels that GRAZING
// cuts.
static const double REACH = 0.55;

enum node_state { NODE_UNKNOWN, NODE_GOOD, NODE_OFF };
struct bounce_node {
    enum node_state state;
    double radiance[3];
};

enum status rec_bounce_make(struct bounce_map *map, const struct calibration *calibration, int view,
                            const struct viewing *viewing, pixel_box box, struct error *err)
{
    struct bounce_map m = {
        .calibration = calibration, .viewing = viewing, .view = view, .box = box};
    if (calibration->surroundings.count && calibration->surroundings.strength > 0) {
        m.step = 1 + (box.x1 - box.x0 > box.y1 - box.y0 ? box.x1 - box.x0 : box.y1 - box.y0) / GRID;
        m.columns = (box.x1 - box.x0) / m.step + 2;
        m.rows = (box.y1 - box.y0) / m.step + 2;
        m.node = calloc((size_t)m.columns * (size_t)m.rows, sizeof *m.node);
        m.rim = calloc(TURNS * (RINGS + 1), sizeof *m.rim);
        if (!m.node || !m.rim) {
            rec_bounce_free(&m);
            return cap_fail(err, STATUS_MEMORY, "%d x %d bounced nodes", GRID, GRID);
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

// The sum over the board's cells with a fitted model (cal_bounce does it with calib's first guess).
static void bounce_by_fit(const struct bounce_map *m, const struct fit *fit, vec3 point, vec3 n,
                          vec3 wo, double radiance[3])
{
    const struct surroundings *s = &m->calibration->surroundings;
    const struct view *view = &m->calibration->view[m->view];
    const struct glow *glow = s->glow + (size_t)view->light * (size_t)s->count;
    vec3 x = vec3_sub(wo, vec3_scale(n, vec3_dot(wo, n)));
    double sine = vec3_length(x);
    x = sine > 1e-9
            ? vec3_scale(x, 1 / sine)
            : vec3_normalize(vec3_cross(n, fabs(n.x) < 0.7 ? (vec3){1, 0, 0} : (vec3){0, 1, 0}));
    vec3 y = vec3_cross(n, x), out = {vec3_dot(wo, x), 0, vec3_dot(wo, n)};
    for (int i = 0; i < s->count; i++) {
        vec3 to = vec3_sub(glow[i].point, point);
        double up = vec3_dot(to, n), down = -vec3_dot(to, glow[i].normal), f[3];
        if (up <= 0 || down <= 0)
            continue;
        double r2 = vec3_dot(to, to), r = sqrt(r2);
        vec3 in = {vec3_dot(to, x) / r, vec3_dot(to, y) / r, up / r};
        fit->model->eval(fit->value, in, out, f);
        double form = up * down * glow[i].side * glow[i].side / (r2 * r2);
        for (int c = 0; c < 3; c++)
            radiance[c] += f[c] * glow[i].radiance[c] * form;
    }
    for (int c = 0; c < 3; c++)
        radiance[c] *= view->power * s->strength;
}

static void bounce(const struct bounce_map *m, vec3 point, vec3 n, vec3 wo, double radiance[3])
{
    const struct consensus *known = m->viewing->consensus;
    memset(radiance, 0, sizeof(double[3]));
    if (known && vec3_dot(wo, n) > 0)
        bounce_by_fit(m, known->fit, point, n, wo, radiance);
    else
        cal_bounce(m->calibration, m->view, point, n, wo, radiance);
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
        bounce(m, at.point, at.normal, vec3_scale(ray, -1), node->radiance);
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
    double a = 2 * CAP_PI * turn / TURNS;
    vec3 n = vec3_add(
        vec3_scale(f[2], cos(off)),
        vec3_scale(vec3_add(vec3_scale(f[0], cos(a)), vec3_scale(f[1], sin(a))), sin(off)));
    vec3 point = vec3_add(v->sample->center, vec3_scale(n, v->sample->radius));
    bounce(m, point, n, vec3_normalize(vec3_sub(v->eye, point)), node->radiance);
    node->state = NODE_GOOD;
    return node;
}

static void bounce_near_rim(struct bounce_map *m, const sight *a, double radiance[3])
{
    vec3 f[3];
    rim_frame(m->viewing, f);
    double turn =
        atan2(vec3_dot(a->normal, f[1]), vec3_dot(a->normal, f[0])) / (2 * CAP_PI) * TURNS;
    double ring = vec3_dot(a->normal, a->wo) / REACH * RINGS;
    int i = (int)floor(turn), j = (int)fmin(floor(ring), RINGS - 1);
    double s = turn - i, t = ring - j;
    const double weight[4] = {(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t};
    for (int k = 0; k < 4; k++) {
        const struct bounce_node *node = rim_at(m, (i + (k & 1) + 2 * TURNS) % TURNS, j + (k >> 1));
        for (int c = 0; c < 3; c++)
            radiance[c] += weight[k] * node->radiance[c];
    }
}

void rec_bounce_at(struct bounce_map *m, const sight *a, int x, int y, double radiance[3])
{
    memset(radiance, 0, sizeof(double[3]));
    if (!m->node)
        return;
    int i = (x - m->box.x0) / m->step, j = (y - m->box.y0) / m->step;
    double s = (double)(x - m->box.x0) / m->step - i, t = (double)(y - m->box.y0) / m->step - j;
    const double weight[4] = {(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t};
    for (int k = 0; k < 4; k++) {
        const struct bounce_node *node = node_at(m, i + (k & 1), j + (k >> 1));
        if (node->state == NODE_OFF) {
            double cos_o = vec3_dot(a->normal, a->wo);
            bool ball = m->viewing->sample->shape == SHAPE_SPHERE;
            memset(radiance, 0, sizeof(double[3]));
            if (ball && cos_o > 0 && cos_o < REACH)
                bounce_near_rim(m, a, radiance);
            else
                bounce(m, a->point, a->normal, a->wo, radiance);
            return;
        }
        for (int c = 0; c < 3; c++)
            radiance[c] += weight[k] * node->radiance[c];
    }
}
