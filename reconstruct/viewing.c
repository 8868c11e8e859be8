/* viewing.c -- a shot, made ready for its photosites: its lamp, its errors, and where it shows the
 * sample.
 */
#include "samples.h"

#include <string.h>

#define FATE_TEXT(name, text) text,
const char *const rec_fate_name[FATES] = {FATE_LIST(FATE_TEXT)};
#undef FATE_TEXT

static double square(double x)
{
    return x * x;
}

// The lamp's covariance in the world; without one, of independent numbers.
static void spread_lamp(double spread[4][4], const struct lamp *lamp, const mat3 *view_from_world)
{
    double own[4][4];
    memcpy(own, lamp->covariance, sizeof own);
    if (!(own[3][3] > 0)) {
        const double *sigma = lamp->at_infinity ? lamp->sigma_direction : lamp->sigma_position;
        memset(own, 0, sizeof own);
        for (int k = 0; k < 3; k++) {
            own[k][k] = square(sigma[k]);
            own[3][3] += square(lamp->sigma_intensity[k] / lamp->intensity[k]) / 3;
        }
    }
    double turn[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
    for (int k = 0; k < 9 && lamp->on_camera; k++)
        turn[k / 3][k % 3] = view_from_world->m[k % 3][k / 3];
    for (int k = 0; k < 256; k++) {
        int a = k / 64, b = k / 16 % 4, i = k / 4 % 4, j = k % 4;
        spread[a][b] += turn[a][i] * own[i][j] * turn[b][j];
    }
}

// The radius of a ball about the sample's centre that holds all of it.
static double bound_of(const struct sample *s)
{
    return s->shape == SHAPE_CYLINDER ? hypot(s->radius, s->height / 2) : s->radius;
}

static void find_cone(struct viewing *v)
{
    vec3 way = cal_to_view(v->view->view_from_world, v->sample->center);
    double distance = vec3_length(way), sine = bound_of(v->sample) / distance;
    v->to_sample = vec3_scale(way, 1 / distance);
    v->cos_bound = sine < 1 ? sqrt(1 - sine * sine) : -2;
}

struct viewing rec_viewing(const struct calibration *calibration, int view,
                           const struct lens_table *lens, const struct board_extent *board)
{
    const struct view *of = &calibration->view[view];
    const struct lamp *lamp = &calibration->lamp[of->light];
    struct viewing v = {
        .camera = &calibration->camera[of->camera],
        .view = of,
        .lamp = lamp,
        .sample = &calibration->sample,
        .lens = lens,
        .board = board,
        .view_from_world = cal_rotation(of->view_from_world.rotation),
        .eye = cal_eye(of->view_from_world),
        .photosite = 1.5
                     / fmin(calibration->camera[of->camera].focal[0],
                            calibration->camera[of->camera].focal[1]),
    };
    // A wider square stands for photosite and lens together: it has the same variance. An edge's
    // light reaches over half a photosite and two sigmas of the lens's.
    v.square = sqrt(1 + 12 * square(of->blur_px));
    v.margin = fmax(1, 0.5 + 2 * of->blur_px);
    if (!lamp->at_infinity)
        v.lamp_position = cal_lamp_position(lamp, of->view_from_world);
    v.beam = lamp->beam;
    if (lamp->on_camera)
        v.beam.axis = mat3_mul_t(&v.view_from_world, lamp->beam.axis);
    for (int c = 0; c < 3; c++)
        v.light[c] = lamp->intensity[c] * of->power;
    v.dimming = of->sigma_power / of->power;
    spread_lamp(v.lamp_spread, lamp, &v.view_from_world);
    find_cone(&v);
    // The board holds the pose: a camera placed wrong sees the board right, and the sample off by
    // the parallax between the two, (its height) / (the camera's distance) of the camera's error.
    double height = fabs(calibration->sample.center.z);
    double distance = vec3_length(vec3_sub(v.eye, calibration->sample.center));
    double sigma = sqrt((square(of->sigma_translation[0]) + square(of->sigma_translation[1])
                         + square(of->sigma_translation[2]))
                        / 3);
    v.shake = sigma * fmin(1, height / distance);
    const struct surroundings *around = &calibration->surroundings;
    v.bounce_sigma = around->strength > 0 ? around->sigma_strength / around->strength : 0;
    v.bounce_caution = v.bounce_sigma;
    return v;
}

// A component of JPEG's with one value for n photosites in a row was averaged over them. Where n is
// 2, libjpeg takes three quarters of a photosite's own pair and a quarter of the pair next to it.
static void share(int *before, int *after, int n, int at)
{
    int place = n > 1 ? at % n : 0;
    *before = place + (n == 2 && place == 0 ? 2 : 0);
    *after = (n > 1 ? n - 1 - place : 0) + (n == 2 && place == 1 ? 2 : 0);
}

struct reach rec_reach(const struct viewing *v, int x, int y)
{
    const double edge = 0.5 + 2 * v->view->blur_px;
    const int at[2] = {x, y};
    struct reach r;
    for (int k = 0; k < 2; k++) {
        int before, after;
        share(&before, &after, v->chroma[k], at[k]);
        r.before[k] = fmax(v->margin, before + edge);
        r.after[k] = fmax(v->margin, after + edge);
    }
    return r;
}

double rec_farthest(const struct viewing *v)
{
    double far = v->margin;
    for (int k = 0; k < v->chroma[0] || k < v->chroma[1]; k++) {
        struct reach r = rec_reach(v, k, k);
        far = fmax(far, fmax(fmax(r.before[0], r.after[0]), fmax(r.before[1], r.after[1])));
    }
    return far;
}

// Grow a box by a pixel; false where the point is behind the camera.
static bool reach(pixel_box *box, const struct viewing *v, vec3 world)
{
    vec3 p = cal_to_view(v->view->view_from_world, world);
    double at[2];
    if (p.z <= 0)
        return false;
    cal_project(v->camera, p, at);
    double far = 1e6;  // keeps the conversion defined
    int x = (int)floor(fmax(-far, fmin(far, at[0]))), y = (int)floor(fmax(-far, fmin(far, at[1])));
    box->x0 = x - 2 < box->x0 ? x - 2 : box->x0;
    box->y0 = y - 2 < box->y0 ? y - 2 : box->y0;
    box->x1 = x + 4 > box->x1 ? x + 4 : box->x1;
    box->y1 = y + 4 > box->y1 ? y + 4 : box->y1;
    return true;
}

pixel_box rec_sample_box(const struct viewing *v)
{
    const struct sample *s = v->sample;
    const pixel_box image = {0, 0, v->camera->width, v->camera->height};
    double bound = bound_of(s);
    vec3 to_center = vec3_sub(s->center, v->eye);
    double distance = vec3_length(to_center);
    if (distance <= bound)
        return image;
    // The circle where rays from the eye touch the bounding sphere, in 64 steps: between two of
    // them it strays by 0.1 % of its radius, which the margin of a 64th covers.
    double sine = bound / distance, radius = 1.016 * bound * sqrt(1 - sine * sine);
    vec3 z = vec3_scale(to_center, 1 / distance);
    vec3 x = vec3_normalize(vec3_cross(z, fabs(z.x) < 0.7 ? (vec3){1, 0, 0} : (vec3){0, 1, 0}));
    vec3 y = vec3_cross(z, x), middle = vec3_sub(s->center, vec3_scale(z, bound * sine));
    pixel_box box = {image.x1, image.y1, 0, 0};
    for (int k = 0; k < 64; k++) {
        double a = 2 * CAP_PI * k / 64;
        vec3 out = vec3_add(vec3_scale(x, radius * cos(a)), vec3_scale(y, radius * sin(a)));
        if (!reach(&box, v, vec3_add(middle, out)))
            return image;
    }
    return (pixel_box){box.x0 < 0 ? 0 : box.x0, box.y0 < 0 ? 0 : box.y0,
                       box.x1 > image.x1 ? image.x1 : box.x1,
                       box.y1 > image.y1 ? image.y1 : box.y1};
}
