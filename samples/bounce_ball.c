/* bounce_ball.c -- what the ball sends to the board.
 *
 * Method.   E(q) = sum over pieces of the sphere of L(p -> q) cos_p cos_q A / d^2. Of the lamp's
 *           light, L = f E cos(theta_i), by two rules: pieces even over the sphere, and pieces in
 *           rings about the place that mirrors the lamp to q, for narrow lobes; each piece weighs
 *           by how much denser its rule is there. Of the board's light, pieces are even over the
 *           half that q sees, and each gathers the board's radiance in rings about the mirror
 *           direction: L = sum of f B cos(theta_i) dw.
 * Accuracy. The lamp's light 3e-3, off a matt ball as off an all but ideal mirror, thin
 *           crescents 1e-2; the board's light off a matt ball 1e-2 (tests/test_bounce.c).
 */
#include "bounce_ball.h"

#include "polar.h"

enum { SPHERE_POINTS = 2048, HALF_POINTS = 160 };
static const double GOLDEN_ANGLE = 2.39996322972865332;  // pi (3 - sqrt 5)
static const double FINEST = 0.004;                      // rad, of normals

bool sam_post_between(const struct world *world, vec3 from, vec3 direction, double far)
{
    return world->post.radius > 0
           && sam_cross_rod((struct ray){from, direction}, &world->post, 1e-6).s < far;
}

/** The normal where the ball mirrors the lamp to a place. */
static vec3 mirror_normal(const struct shot_view *view, vec3 place)
{
    const struct sample_place *ball = &view->world->scene->sample.place;
    vec3 n = vec3_normalize(vec3_sub(place, ball->center));
    for (int i = 0; i < 20; i++) {  // what is left shrinks by radius/distance each time
        vec3 p = vec3_add(ball->center, vec3_scale(n, ball->radius));
        vec3 wo = vec3_normalize(vec3_sub(place, p));
        vec3 h = vec3_add(sam_light_part(&view->light, p, 0, 1).wi, wo);
        if (vec3_length(h) < 1e-6)  // the lamp is right behind: no point mirrors it
            break;
        n = vec3_normalize(h);
    }
    return n;
}

/** A piece of the ball as a place of the board has it. */
struct piece {
    struct spot spot;
    vec3 wo;
    double form;  // cos_p cos_q A / d^2; 0: not seen
};

static struct piece piece_of(const struct shot_view *view, vec3 n, double solid_angle, vec3 place)
{
    const struct sample_place *ball = &view->world->scene->sample.place;
    struct piece piece = {.spot = {.matter = MATTER_SAMPLE,
                                   .normal = n,
                                   .point = vec3_add(ball->center, vec3_scale(n, ball->radius))}};
    vec3 to = vec3_sub(place, piece.spot.point);
    double d2 = vec3_dot(to, to), d = sqrt(d2), cos_q = -to.z / d;
    piece.wo = vec3_scale(to, 1 / d);
    double cos_p = vec3_dot(piece.wo, n), area = ball->radius * ball->radius * solid_angle;
    if (cos_p > 0 && cos_q > 0 && !sam_post_between(view->world, piece.spot.point, piece.wo, d))
        piece.form = cos_p * cos_q * area / d2;
    return piece;
}

/** Point k of n spread evenly over the sphere from `low` to 1 along the axis z of a frame. */
static vec3 even_point(int k, int n, double low, vec3 x, vec3 y, vec3 z)
{
    double along = 1 - (1 - low) * (k + 0.5) / n, r = sqrt(fmax(1 - along * along, 0));
    vec3 across = vec3_add(vec3_scale(x, r * cos(k * GOLDEN_ANGLE)),
                           vec3_scale(y, r * sin(k * GOLDEN_ANGLE)));
    return vec3_add(vec3_scale(z, along), across);
}

/** Add the lamp's light off a piece about n. */
static void throw_off(const struct shot_view *view, vec3 n, double solid_angle, vec3 place,
                      double irradiance[3])
{
    struct piece piece = piece_of(view, n, solid_angle, place);
    struct incidence in = sam_light_part(&view->light, piece.spot.point, 0, 1);
    double f[3], cos_i = vec3_dot(in.wi, n);
    if (piece.form <= 0 || cos_i <= 0 || sam_lit(view, &piece.spot, n) == LIT_NOT)
        return;
    sam_reflectance(view->world, &piece.spot, in.wi, piece.wo, f);
    for (int c = 0; c < 3; c++)
        irradiance[c] += f[c] * in.irradiance[c] * cos_i * piece.form;
}

void sam_ball_throws(const struct shot_view *view, vec3 place, double irradiance[3])
{
    const double even = SPHERE_POINTS / (4 * CAP_PI);
    vec3 x, y, z = mirror_normal(view, place);
    sam_frame(z, &x, &y);
    for (int k = 0; k < SPHERE_POINTS; k++) {
        vec3 n = even_point(k, SPHERE_POINTS, -1, x, y, z);
        double other = sam_polar_density(FINEST, n, z);
        throw_off(view, n, sam_rule_weight(even, other) / even, place, irradiance);
    }
    for (int k = 0; k < POLAR_DIRECTIONS; k++) {
        vec3 n = sam_polar_direction(FINEST, k, x, y, z);
        double own = sam_polar_density(FINEST, n, z);
        throw_off(view, n, sam_rule_weight(own, even) / own, place, irradiance);
    }
}

/** The board's radiance [3] where a ray from a point meets it, `far` away; NULL: beside it, or the
 *  post. */
static const double *glow_at(const struct shot_view *view, const struct board_glow *board,
                             vec3 from, vec3 direction, double *far)
{
    if (direction.z >= 0)
        return NULL;
    double s = *far = -from.z / direction.z;
    double x = (from.x + s * direction.x - board->x0) / board->cell;
    double y = (from.y + s * direction.y - board->y0) / board->cell;
    if (!(x >= 0 && y >= 0 && x < board->columns && y < board->rows)
        || sam_post_between(view->world, from, direction, s))
        return NULL;
    return board->radiance + 3 * ((size_t)y * (size_t)board->columns + (size_t)x);
}

void sam_board_mirrored(const struct shot_view *view, const struct board_glow *board,
                        const struct spot *spot, vec3 wo, bool alone, double rgb[3])
{
    vec3 n = spot->normal, x, y, z = vec3_sub(vec3_scale(n, 2 * vec3_dot(n, wo)), wo);
    sam_frame(z, &x, &y);
    for (int k = 0; k < POLAR_DIRECTIONS; k++) {
        vec3 wi = sam_polar_direction(SAM_FINEST_SKY, k, x, y, z);
        double f[3], cos_i = vec3_dot(wi, n), far;
        const double *glow = cos_i > 0 ? glow_at(view, board, spot->point, wi, &far) : NULL;
        if (!glow)
            continue;
        double own = sam_polar_density(SAM_FINEST_SKY, wi, z),
               cells = far * far / (-wi.z * board->cell * board->cell);
        double weight = (alone ? 1 : sam_rule_weight(own, cells)) / own;
        sam_reflectance(view->world, spot, wi, wo, f);
        for (int c = 0; c < 3; c++)
            rgb[c] += f[c] * glow[c] * cos_i * weight;
    }
}

void sam_ball_returns(const struct shot_view *view, const struct board_glow *board, vec3 place,
                      double irradiance[3])
{
    const struct sample_place *ball = &view->world->scene->sample.place;
    vec3 to = vec3_sub(place, ball->center), z = vec3_normalize(to), x, y;
    double limb = ball->radius / vec3_length(to);
    sam_frame(z, &x, &y);
    for (int k = 0; k < HALF_POINTS; k++) {
        vec3 n = even_point(k, HALF_POINTS, limb, x, y, z);
        struct piece piece = piece_of(view, n, 2 * CAP_PI * (1 - limb) / HALF_POINTS, place);
        double rgb[3] = {0, 0, 0};
        if (piece.form <= 0)
            continue;
        sam_board_mirrored(view, board, &piece.spot, piece.wo, true, rgb);
        for (int c = 0; c < 3; c++)
            irradiance[c] += rgb[c] * piece.form;
    }
}
