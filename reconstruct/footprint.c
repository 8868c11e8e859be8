/* footprint.c -- what a photosite spans on the sample.
 *
 * Method.   A pixel is the mean of f cos(theta_i)/r^2 over its square. Its directions are means of
 *           n, wi and wo over the square, weighted by cos(theta_i)/r^2, and f is the pixel over the
 *           mean of cos(theta_i)/r^2: exact where f is linear in the directions over the square.
 *           How far the normals spread is kept, for the bend of f (resolution.c). Gauss-Legendre
 *           points, 3 x 3, exact for polynomials to the fifth degree; where the normal hardly turns
 *           within the square its centre alone does.
 * Limits.   A photosite is left out within one photosite of the outline and of the terminator: the
 *           lens spreads light over about that much, and beyond the edge lies something else.
 */
#include "footprint.h"

#include <assert.h>

// One ray on its way: directions and irradiance where it meets the sample.
typedef struct {
    meeting m;
    vec3 wi, wo;
    double distance, cos_i, irradiance;
} ray_end;

// The ray of a pixel offset: the table's linear expansion about the photosite's centre.
struct pencil {
    double at[2], by_u[2], by_v[2];
};

static ray_end trace(const struct viewing *v, const struct pencil *p, double du, double dv)
{
    vec3 ray = {p->at[0] + du * p->by_u[0] + dv * p->by_v[0],
                p->at[1] + du * p->by_u[1] + dv * p->by_v[1], 1};
    vec3 d = vec3_normalize(mat3_mul_t(&v->view_from_world, ray));
    ray_end end = {.m = rec_meet(v->sample, v->eye, d), .wo = vec3_scale(d, -1)};
    if (!end.m.hit)
        return end;
    if (v->lamp->at_infinity) {
        end.wi = v->lamp->direction;
        end.distance = INFINITY;
        end.irradiance = end.cos_i = vec3_dot(end.m.normal, end.wi);
    } else {
        vec3 to_lamp = vec3_sub(v->lamp_position, end.m.point);
        double r2 = vec3_dot(to_lamp, to_lamp);
        end.distance = sqrt(r2);
        end.wi = vec3_scale(to_lamp, 1 / end.distance);
        end.cos_i = vec3_dot(end.m.normal, end.wi);
        end.irradiance = end.cos_i / r2;
    }
    return end;
}

// Eight rays one photosite away: all of them must meet lit sample.
static enum fate ring(const struct viewing *v, const struct pencil *p)
{
    static const double s = 0.70710678118654752;
    static const double offset[8][2] = {{1, 0},  {s, s},   {0, 1},  {-s, s},
                                        {-1, 0}, {-s, -s}, {0, -1}, {s, -s}};
    enum fate fate = FATE_USED;
    for (int k = 0; k < 8; k++) {
        ray_end end = trace(v, p, offset[k][0], offset[k][1]);
        if (!end.m.hit)
            return FATE_OUTLINE;
        if (end.cos_i <= 0)
            fate = FATE_TERMINATOR;
    }
    return fate;
}

// How far the normal turns from one photosite to the next, in radians, at the middle of the
// sample's face; towards the outline it is 1/cos_o times as far.
static double normal_step(const struct viewing *v, const struct pencil *p, vec3 point)
{
    double distance = vec3_length(vec3_sub(point, v->eye));
    return distance * hypot(p->by_u[0], p->by_u[1]) / v->sample->radius;
}

static void add(footprint *sum, const ray_end *end, double w)
{
    sum->irradiance += w;
    sum->normal = vec3_add(sum->normal, vec3_scale(end->m.normal, w));
    sum->wi = vec3_add(sum->wi, vec3_scale(end->wi, w));
    sum->wo = vec3_add(sum->wo, vec3_scale(end->wo, w));
}

// The plane in which n tilts towards h, and the one across it; any two where n is h.
static void tilt_axes(const footprint *a, vec3 axis[2])
{
    vec3 h = vec3_normalize(vec3_add(a->wi, a->wo));
    vec3 out = vec3_sub(h, vec3_scale(a->normal, vec3_dot(h, a->normal)));
    if (vec3_length(out) < 1e-9)
        out = vec3_cross(a->normal, fabs(a->normal.x) < 0.7 ? (vec3){1, 0, 0} : (vec3){0, 1, 0});
    axis[0] = vec3_normalize(out);
    axis[1] = vec3_cross(a->normal, axis[0]);
}

static footprint average(const struct viewing *v, const struct pencil *p, const ray_end *center)
{
    static const double place[3] = {-0.38729833462074169, 0, 0.38729833462074169};  // sqrt(0.15)
    static const double weight[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
    footprint sum = {.point = center->m.point, .distance = center->distance};
    vec3 normal[9], axis[2];
    double w[9];
    for (int b = 0; b < 3; b++)
        for (int a = 0; a < 3; a++) {
            ray_end end = trace(v, p, place[a], place[b]);
            assert(end.m.hit && end.cos_i > 0);
            normal[3 * b + a] = end.m.normal;
            w[3 * b + a] = weight[a] * weight[b] * end.irradiance;
            add(&sum, &end, w[3 * b + a]);
        }
    sum.normal = vec3_normalize(sum.normal);
    sum.wi = vec3_normalize(sum.wi);
    sum.wo = vec3_normalize(sum.wo);
    tilt_axes(&sum, axis);
    for (int k = 0; k < 9; k++)
        for (int i = 0; i < 2; i++) {
            double tilt = vec3_dot(normal[k], axis[i]);
            sum.spread[i] += w[k] / sum.irradiance * tilt * tilt;
        }
    return sum;
}

enum fate rec_footprint(footprint *spot, const struct viewing *viewing, double u, double v,
                        bool *hit)
{
    struct pencil p;
    rec_lens_at(viewing->lens, u, v, p.at, p.by_u, p.by_v);
    ray_end center = trace(viewing, &p, 0, 0);
    *hit = center.m.hit;
    if (!center.m.hit)
        return FATE_OUTLINE;
    double cos_o = vec3_dot(center.m.normal, center.wo);
    double step = normal_step(viewing, &p, center.m.point) / cos_o;
    // Far from both edges the ring needs no look; but a cylinder ends without warning.
    bool inner = viewing->sample->shape == SHAPE_SPHERE && cos_o > 3 * step;
    if (!(inner && center.cos_i > 3 * step)) {
        enum fate fate = ring(viewing, &p);
        if (fate == FATE_OUTLINE)
            return fate;
        if (center.cos_i <= 0)
            return FATE_DARK;
        if (fate)
            return fate;
    }
    // The square's second moment is 1/12: the centre alone errs by (step / cosines)^2 / 24, 4e-5 of
    // f at most; no photosite is trusted beyond 1e-3 (samples.c).
    if (step < 0.03 * cos_o * center.cos_i) {
        *spot = (footprint){
            .point = center.m.point,
            .normal = center.m.normal,
            .wi = center.wi,
            .wo = center.wo,
            .distance = center.distance,
            .spread = {step * step / 12, step * step / 12},
            .irradiance = center.irradiance,
        };
        return FATE_USED;
    }
    *spot = average(viewing, &p, &center);
    return FATE_USED;
}
