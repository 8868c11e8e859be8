/* sample_errors.c -- what a wrong calibration does to a reflectance sample.
 *
 * Method.   f = L / (light cos(theta_i)/r^2) moves as ln(cos(theta_i)/r^2) does, and with the
 * angles that it is filed under. Each is differentiated by the sample's centre and radius, the ray
 * (the pose), the lamp's place and strength; the sigmas of these are taken as independent, but for
 * place and strength of a lamp, whose covariance is the calibration's. A step c
 * of the sample's centre makes the ray's point slide along the ray d so as to stay on the surface,
 * by d (n.c)/(n.d); the normal turns by the part of d (n.c)/(n.d) - c in which the surface is
 * curved, over the radius.
 */
#include "strip.h"

#include <string.h>

/** Standard deviations that all photosites of a view share, squared. */
struct shared_sigmas {
    vec3 center;        // per axis
    double lamp[4][4];  // covariance of its position (direction) and ln intensity
    double shake, radius, dimming;
    vec3 axis;          // of a cylinder: along it the surface is flat; else 0
    double far;         // 1 for a lamp at infinity, else 0
    vec3 turn, middle;  // of the sample about its centre: per axis of the world; the centre
};

static vec3 squares(const double sigma[3])
{
    return (vec3){sigma[0] * sigma[0], sigma[1] * sigma[1], sigma[2] * sigma[2]};
}

static struct shared_sigmas sigmas_of(const struct viewing *v)
{
    bool cylinder = v->sample->shape == SHAPE_CYLINDER, near = !v->lamp->at_infinity;
    struct shared_sigmas s = {
        .center = squares(v->sample->sigma_center),
        .shake = v->shake * v->shake,
        .radius = v->sample->sigma_radius * v->sample->sigma_radius,
        .dimming = v->dimming * v->dimming,
        .axis = cylinder ? vec3_normalize(v->sample->axis) : (vec3){0, 0, 0},
        .far = near ? 0 : 1,
        .turn = squares(v->sample->sigma_turn),
        .middle = v->sample->center,
    };
    memcpy(s.lamp, v->lamp_spread, sizeof s.lamp);
    return s;
}

// What is left of a vector where the surface curves: all on a sphere, nothing along a cylinder.
static inline vec3 curved(vec3 axis, vec3 w)
{
    return vec3_sub(w, vec3_scale(axis, vec3_dot(w, axis)));
}

/** Derivatives of a quantity by the sample's centre and radius. */
typedef struct {
    vec3 center;
    double radius;
} place_slope;

// Of w.n: as the point slides along the ray d by d/(n.d) for a step along n, n' follows.
static inline place_slope slope_of(vec3 w, vec3 n, vec3 d, double n_d, double curvature, vec3 axis)
{
    vec3 c = curved(axis, w);
    double slide = vec3_dot(c, d) / n_d;
    return (place_slope){
        .center = vec3_scale(vec3_sub(vec3_scale(n, slide), c), curvature),
        .radius = curvature * (slide - vec3_dot(c, n)),
    };
}

static inline double variance(vec3 g, vec3 squares_of_sigma)
{
    return g.x * g.x * squares_of_sigma.x + g.y * g.y * squares_of_sigma.y
           + g.z * g.z * squares_of_sigma.z;
}

// Of g.(position) + i (ln intensity).
static inline double lamp_variance(const double c[4][4], vec3 g, double i)
{
    double square =
        g.x * g.x * c[0][0] + g.y * g.y * c[1][1] + g.z * g.z * c[2][2] + i * i * c[3][3];
    double mixed = g.x * g.y * c[0][1] + g.y * g.z * c[1][2] + g.z * g.x * c[2][0]
                   + i * (g.x * c[0][3] + g.y * c[1][3] + g.z * c[2][3]);
    double sum = square + 2 * mixed;
    return sum > 0 ? sum : 0;
}

static inline double place_variance(const struct shared_sigmas *s, place_slope g)
{
    return variance(g.center, s->center) + s->shake * vec3_dot(g.center, g.center)
           + g.radius * g.radius * s->radius;
}

// Of ln(cos(theta_i)/r^2), and the lamp's strength.
static inline double systematic_variance(const struct shared_sigmas *s, vec3 n, vec3 wi, vec3 d,
                                         double near, double curvature)
{
    double cos_i = vec3_dot(n, wi), n_d = vec3_dot(n, d);
    // By the lamp's position; none for a lamp at infinity, where near, 1 / its distance, is 0.
    vec3 lamp = vec3_scale(vec3_sub(vec3_scale(n, 1 / cos_i), vec3_scale(wi, 3)), near);
    // The point nears the lamp as it slides: the lamp's gradient, backwards, along d/(n.d).
    double nearer = -vec3_dot(lamp, d) / n_d;
    place_slope g = slope_of(wi, n, d, n_d, curvature, s->axis);
    g.center = vec3_add(vec3_scale(g.center, 1 / cos_i), vec3_scale(n, nearer));
    g.radius = g.radius / cos_i + nearer;
    vec3 by_lamp = vec3_add(lamp, vec3_scale(n, s->far / cos_i));
    return place_variance(s, g) + lamp_variance(s->lamp, by_lamp, 1) + s->dimming;
}

// theta_h turns as n does along h's tangent, where h is n along any; and as h does with the lamp:
// wi turns by what moves the lamp across it over its distance, h by 1/|wi + wo| of that.
static inline vec3 tangent_of(vec3 n, vec3 wi, vec3 d)
{
    vec3 h = vec3_sub(wi, d), out = vec3_sub(h, vec3_scale(n, vec3_dot(h, n)));
    bool level = vec3_dot(out, out) < 1e-18, turned = n.x * n.x < 0.5;
    double x = turned ? 0 : -n.z, y = turned ? n.z : 0, z = turned ? -n.y : n.x;
    x = level ? x : out.x;
    y = level ? y : out.y;
    z = level ? z : out.z;
    double scale = 1 / sqrt(x * x + y * y + z * z);
    return (vec3){x * scale, y * scale, z * scale};
}

static inline double tilt_variance(const struct shared_sigmas *s, vec3 n, vec3 wi, vec3 d,
                                   double near, double curvature)
{
    vec3 tangent = tangent_of(n, wi, d), h = vec3_sub(wi, d);
    vec3 across = vec3_sub(tangent, vec3_scale(wi, vec3_dot(tangent, wi)));
    vec3 by_lamp = vec3_scale(across, (near + s->far) / vec3_length(h));
    return place_variance(s, slope_of(tangent, n, d, vec3_dot(n, d), curvature, s->axis))
           + lamp_variance(s->lamp, by_lamp, 0);
}

WIDE static void take_errors(struct strip *strip, const struct shared_sigmas *shared)
{
    const struct shared_sigmas s = *shared;
    for (int i = 0; i < LANES; i++) {
        vec3 n = {strip->normal.x[i], strip->normal.y[i], strip->normal.z[i]};
        vec3 wi = {strip->wi.x[i], strip->wi.y[i], strip->wi.z[i]};
        vec3 d = {-strip->wo.x[i], -strip->wo.y[i], -strip->wo.z[i]};
        double near = 1 / strip->distance[i], curvature = strip->curvature[i];
        strip->systematic[i] = sqrt(systematic_variance(&s, n, wi, d, near, curvature));
        strip->tilt[i] = sqrt(tilt_variance(&s, n, wi, d, near, curvature));
    }
}

// A turn t of the sample moves its normal by t x n, and the point by t x (p - c) as a shift does.
static inline double turn_variance(const struct shared_sigmas *s, vec3 w, vec3 n, vec3 d, vec3 arm,
                                   double curvature)
{
    place_slope g = slope_of(w, n, d, vec3_dot(n, d), curvature, s->axis);
    return variance(vec3_add(vec3_cross(n, w), vec3_cross(arm, g.center)), s->turn);
}

WIDE static void add_turns(struct strip *strip, const struct shared_sigmas *shared)
{
    const struct shared_sigmas s = *shared;
    for (int i = 0; i < LANES; i++) {
        vec3 n = {strip->normal.x[i], strip->normal.y[i], strip->normal.z[i]};
        vec3 wi = {strip->wi.x[i], strip->wi.y[i], strip->wi.z[i]};
        vec3 d = {-strip->wo.x[i], -strip->wo.y[i], -strip->wo.z[i]};
        vec3 p = {strip->point.x[i], strip->point.y[i], strip->point.z[i]};
        vec3 arm = vec3_sub(p, s.middle);
        double curvature = strip->curvature[i];
        vec3 by_cosine = vec3_scale(wi, 1 / vec3_dot(n, wi));
        double more = turn_variance(&s, by_cosine, n, d, arm, curvature);
        double tilt = turn_variance(&s, tangent_of(n, wi, d), n, d, arm, curvature);
        strip->systematic[i] = sqrt(strip->systematic[i] * strip->systematic[i] + more);
        strip->tilt[i] = sqrt(strip->tilt[i] * strip->tilt[i] + tilt);
    }
}

void rec_strip_errors(struct strip *strip, const struct viewing *viewing)
{
    struct shared_sigmas shared = sigmas_of(viewing);
    take_errors(strip, &shared);
    if (vec3_dot(shared.turn, shared.turn) > 0)
        add_turns(strip, &shared);
}
