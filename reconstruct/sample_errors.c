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

/** Vectors of half the width: errors to a millionth are good enough. */
typedef struct {
    float x, y, z;
} vec3f;

static inline vec3f narrow(vec3 a)
{
    return (vec3f){(float)a.x, (float)a.y, (float)a.z};
}

static inline vec3f lane(const vec3f_lanes *v, int i)
{
    return (vec3f){v->x[i], v->y[i], v->z[i]};
}

static inline float dot(vec3f a, vec3f b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

// a + s b.
static inline vec3f plus(vec3f a, float s, vec3f b)
{
    return (vec3f){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}

static inline vec3f times(float s, vec3f a)
{
    return (vec3f){s * a.x, s * a.y, s * a.z};
}

static inline vec3f cross(vec3f a, vec3f b)
{
    return (vec3f){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/** Standard deviations that all photosites of a view share, squared. */
struct shared_sigmas {
    vec3f center;      // per axis; with the ray's shake
    float lamp[4][4];  // covariance of its position (direction) and ln intensity
    float radius, dimming;
    vec3f axis;          // of a cylinder: along it the surface is flat; else 0
    float far;           // 1 for a lamp at infinity, else 0
    vec3f turn, middle;  // of the sample about its centre: per axis of the world; the centre
};

static vec3 squares(const double sigma[3])
{
    return (vec3){sigma[0] * sigma[0], sigma[1] * sigma[1], sigma[2] * sigma[2]};
}

static struct shared_sigmas sigmas_of(const struct viewing *v)
{
    bool cylinder = v->sample->shape == SHAPE_CYLINDER, near = !v->lamp->at_infinity;
    double shake = v->shake * v->shake, radius = v->sample->sigma_radius;
    struct shared_sigmas s = {
        .center = narrow(vec3_add(squares(v->sample->sigma_center), (vec3){shake, shake, shake})),
        .radius = (float)(radius * radius),
        .dimming = (float)(v->dimming * v->dimming),
        .axis = cylinder ? narrow(vec3_normalize(v->sample->axis)) : (vec3f){0, 0, 0},
        .far = near ? 0 : 1,
        .turn = narrow(squares(v->sample->sigma_turn)),
        .middle = narrow(v->sample->center),
    };
    for (int k = 0; k < 16; k++)
        s.lamp[k / 4][k % 4] = (float)v->lamp_spread[k / 4][k % 4];
    return s;
}

/** Where a photosite looks: the ray d onto the normal n under the lamp wi. */
typedef struct {
    vec3f n, wi, d;
    float per_n_d;  // 1 / n.d
    float curvature;
} look;

/** Derivatives of a quantity by the sample's centre and radius. */
typedef struct {
    vec3f center;
    float radius;
} place_slope;

// Of w.n: as the point slides along the ray d by d/(n.d) for a step along n, n' follows. What is
// left of w where the surface curves: all on a sphere, nothing along a cylinder.
static inline place_slope slope_of(const look *at, vec3f w, vec3f axis)
{
    vec3f c = plus(w, -dot(w, axis), axis);
    float slide = dot(c, at->d) * at->per_n_d;
    return (place_slope){
        .center = times(at->curvature, plus(times(slide, at->n), -1, c)),
        .radius = at->curvature * (slide - dot(c, at->n)),
    };
}

static inline float variance(vec3f g, vec3f squares_of_sigma)
{
    return g.x * g.x * squares_of_sigma.x + g.y * g.y * squares_of_sigma.y
           + g.z * g.z * squares_of_sigma.z;
}

// Of g.(position) + i (ln intensity).
static inline float lamp_variance(const float c[4][4], vec3f g, float i)
{
    float square =
        g.x * g.x * c[0][0] + g.y * g.y * c[1][1] + g.z * g.z * c[2][2] + i * i * c[3][3];
    float mixed = g.x * g.y * c[0][1] + g.y * g.z * c[1][2] + g.z * g.x * c[2][0]
                  + i * (g.x * c[0][3] + g.y * c[1][3] + g.z * c[2][3]);
    float sum = square + 2 * mixed;
    return sum > 0 ? sum : 0;
}

static inline float place_variance(const struct shared_sigmas *s, place_slope g)
{
    return variance(g.center, s->center) + g.radius * g.radius * s->radius;
}

// Of ln(cos(theta_i)/r^2), and the lamp's strength. near: 1 / the lamp's distance, 0 at infinity.
static inline float systematic_variance(const struct shared_sigmas *s, const look *at, float near)
{
    float per_cos_i = 1 / dot(at->n, at->wi);
    // By the lamp's position; none for a lamp at infinity.
    vec3f lamp = times(near, plus(times(per_cos_i, at->n), -3, at->wi));
    // The point nears the lamp as it slides: the lamp's gradient, backwards, along d/(n.d).
    float nearer = -dot(lamp, at->d) * at->per_n_d;
    place_slope g = slope_of(at, at->wi, s->axis);
    g.center = plus(times(per_cos_i, g.center), nearer, at->n);
    g.radius = g.radius * per_cos_i + nearer;
    vec3f by_lamp = plus(lamp, s->far * per_cos_i, at->n);
    return place_variance(s, g) + lamp_variance(s->lamp, by_lamp, 1) + s->dimming;
}

// theta_h turns as n does along h's tangent, where h is n along any; and as h does with the lamp:
// wi turns by what moves the lamp across it over its distance, h by 1/|wi + wo| of that.
static inline vec3f tangent_of(const look *at)
{
    vec3f n = at->n, h = plus(at->wi, -1, at->d), out = plus(h, -dot(h, n), n);
    bool level = dot(out, out) < 1e-12F, turned = n.x * n.x < 0.5F;
    float x = turned ? 0 : -n.z, y = turned ? n.z : 0, z = turned ? -n.y : n.x;
    x = level ? x : out.x;
    y = level ? y : out.y;
    z = level ? z : out.z;
    float scale = 1 / sqrtf(x * x + y * y + z * z);
    return (vec3f){x * scale, y * scale, z * scale};
}

static inline float tilt_variance(const struct shared_sigmas *s, const look *at, float near)
{
    vec3f tangent = tangent_of(at), h = plus(at->wi, -1, at->d);
    vec3f across = plus(tangent, -dot(tangent, at->wi), at->wi);
    vec3f by_lamp = times((near + s->far) / sqrtf(dot(h, h)), across);
    return place_variance(s, slope_of(at, tangent, s->axis)) + lamp_variance(s->lamp, by_lamp, 0);
}

static inline look look_of(const struct strip *strip, int i)
{
    look at = {.n = lane(&strip->normal, i),
               .wi = lane(&strip->wi, i),
               .d = times(-1, lane(&strip->wo, i)),
               .curvature = strip->curvature[i]};
    at.per_n_d = 1 / dot(at.n, at.d);
    return at;
}

WIDE static void take_errors(struct strip *strip, const struct shared_sigmas *shared)
{
    const struct shared_sigmas s = *shared;
    FOR_LANES (i, strip->use) {
        look at = look_of(strip, i);
        float near = 1 / strip->distance[i];
        strip->systematic[i] = sqrtf(systematic_variance(&s, &at, near));
        strip->tilt[i] = sqrtf(tilt_variance(&s, &at, near));
    }
}

// A turn t of the sample moves its normal by t x n, and the point by t x (p - c) as a shift does.
static inline float turn_variance(const struct shared_sigmas *s, const look *at, vec3f w, vec3f arm)
{
    place_slope g = slope_of(at, w, s->axis);
    return variance(plus(cross(at->n, w), 1, cross(arm, g.center)), s->turn);
}

WIDE static void add_turns(struct strip *strip, const struct shared_sigmas *shared)
{
    const struct shared_sigmas s = *shared;
    FOR_LANES (i, strip->use) {
        look at = look_of(strip, i);
        vec3f arm = plus(narrow(rec_lane(&strip->point, i)), -1, s.middle);
        vec3f by_cosine = times(1 / dot(at.n, at.wi), at.wi);
        float more = turn_variance(&s, &at, by_cosine, arm);
        float tilt = turn_variance(&s, &at, tangent_of(&at), arm);
        strip->systematic[i] = sqrtf(strip->systematic[i] * strip->systematic[i] + more);
        strip->tilt[i] = sqrtf(strip->tilt[i] * strip->tilt[i] + tilt);
    }
}

void rec_strip_errors(struct strip *strip, const struct viewing *viewing)
{
    struct shared_sigmas shared = sigmas_of(viewing);
    take_errors(strip, &shared);
    if (dot(shared.turn, shared.turn) > 0)
        add_turns(strip, &shared);
}
