/* ball_scene.h -- a closed-form scene for tests: a pinhole without distortion, a sphere, a lamp.
 *
 * A pixel is the mean of f cos(theta_i)/r^2 over its square by the midpoint rule in 24 x 24 points.
 */
#ifndef GONIOCAM_BALL_SCENE_H
#define GONIOCAM_BALL_SCENE_H

#include "near.h"
#include "strip.h"

#include <stdlib.h>

enum { WIDTH = 120, HEIGHT = 90, FINE = 24 };

struct scene {
    struct camera camera;
    struct view view;
    struct lamp lamp;
    struct calibration calibration;
    struct lens_table lens;
    struct radiance map;
    const struct model *model;
    double value[MODEL_PARAMETERS_MAX];
};

// Where the ray of a pixel meets the sphere at the origin, in the view (the identity pose).
static inline bool meet(const struct scene *s, double u, double v, vec3 *n, vec3 *p, vec3 *wo)
{
    const struct camera *c = &s->camera;
    vec3 d = {(u - c->center[0]) / c->focal[0], (v - c->center[1]) / c->focal[1], 1};
    vec3 o = s->calibration.sample.center;
    double radius = s->calibration.sample.radius;
    d = vec3_normalize(d);
    double along = vec3_dot(d, o), off2 = vec3_dot(o, o) - along * along;
    if (off2 >= radius * radius)
        return false;
    *p = vec3_scale(d, along - sqrt(radius * radius - off2));
    *n = vec3_scale(vec3_sub(*p, o), 1 / radius);
    *wo = vec3_scale(d, -1);
    return true;
}

static inline vec3 local(vec3 w, vec3 n)
{
    vec3 t = vec3_normalize(vec3_cross(n, (vec3){0.3, 0.9, 0.1})), b = vec3_cross(n, t);
    return (vec3){vec3_dot(w, t), vec3_dot(w, b), vec3_dot(w, n)};
}

static inline void radiance_at(const struct scene *s, double u, double v, double sum[3])
{
    vec3 n, p, wo;
    if (!meet(s, u, v, &n, &p, &wo))
        return;
    vec3 l = vec3_sub(s->lamp.position, p);
    double r = vec3_length(l);
    vec3 wi = local(vec3_scale(l, 1 / r), n), out = local(wo, n);
    double f[3];
    if (wi.z <= 0 || out.z <= 0)
        return;
    s->model->eval(s->value, wi, out, f);
    for (int c = 0; c < 3; c++)
        sum[c] += f[c] * s->lamp.intensity[c] * s->view.power * wi.z / (r * r);
}

static inline void shoot(struct scene *s)
{
    s->map = (struct radiance){.width = WIDTH,
                               .height = HEIGHT,
                               .value = calloc(3 * WIDTH * HEIGHT, sizeof(float)),
                               .variance = calloc(3 * WIDTH * HEIGHT, sizeof(float)),
                               .channels = 3};
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            double sum[3] = {0}, pixel[2] = {x, y};
            for (int j = 0; j < FINE; j++)
                for (int i = 0; i < FINE; i++)
                    radiance_at(s, x - 0.5 + (i + 0.5) / FINE, y - 0.5 + (j + 0.5) / FINE, sum);
            for (int c = 0; c < 3; c++) {
                size_t at = 3 * (size_t)(y * WIDTH + x) + (size_t)c;
                s->map.value[at] =
                    (float)(sum[c] / (FINE * FINE) * cal_vignetting(&s->camera, pixel));
                s->map.variance[at] = 1e-12F;
            }
        }
}

static inline struct scene *make_scene(const char *model, const double *value)
{
    struct scene *s = calloc(1, sizeof *s);
    s->camera = (struct camera){.name = "a",
                                .width = WIDTH,
                                .height = HEIGHT,
                                .focal = {600, 610},
                                .center = {58.3, 45.1},
                                .vignetting = {-0.05, 0.01}};
    s->view = (struct view){.name = "v", .power = 1.1};
    s->lamp =
        (struct lamp){.name = "l", .position = {-250, -300, 80}, .intensity = {1e5, 2e5, 3e5}};
    s->calibration =
        (struct calibration){.camera = &s->camera,
                             .view = &s->view,
                             .lamp = &s->lamp,
                             .sample = {.shape = SHAPE_SPHERE, .radius = 25, .center = {1, 2, 400}},
                             .cameras = 1,
                             .views = 1,
                             .lamps = 1};
    assert_int_equal(rec_lens_make(&s->lens, &s->camera, NULL), STATUS_OK);
    s->model = rec_model_find(model);
    for (int k = 0; k < rec_model_size(s->model); k++)
        s->value[k] = value[k];
    return s;
}

static inline void free_scene(struct scene *s)
{
    rec_lens_free(&s->lens);
    cap_radiance_free(&s->map);
    free(s);
}

// The lens's blur: five photosites each way, of the weights of a normal distribution. Returns their
// standard deviation, which is the blur's.
static inline double blur(struct scene *s, double sigma)
{
    enum { REACH = 5 };
    double weight[2 * REACH + 1], sum = 0, moment = 0;
    float *blurred = calloc(3 * WIDTH * HEIGHT, sizeof(float));
    for (int k = -REACH; k <= REACH; k++) {
        weight[k + REACH] = exp(-0.5 * k * k / (sigma * sigma));
        sum += weight[k + REACH];
        moment += k * k * weight[k + REACH];
    }
    for (int i = 0; i < 3 * WIDTH * HEIGHT; i++) {
        int x = i / 3 % WIDTH, y = i / 3 / WIDTH;
        for (int k = 0; k < (2 * REACH + 1) * (2 * REACH + 1); k++) {
            int u = x + k % (2 * REACH + 1) - REACH, v = y + k / (2 * REACH + 1) - REACH;
            double w = weight[k % (2 * REACH + 1)] * weight[k / (2 * REACH + 1)] / (sum * sum);
            if (u >= 0 && u < WIDTH && v >= 0 && v < HEIGHT)
                blurred[i] += (float)w * s->map.value[3 * (v * WIDTH + u) + i % 3];
        }
    }
    free(s->map.value);
    s->map.value = blurred;
    return sqrt(moment / sum);
}
#endif
