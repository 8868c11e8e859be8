/* samples.c -- photosites become reflectance samples.
 *
 * Method.   f = L / (V light cos(theta_i)/r^2), with the directions and the irradiance of the
 *           footprint (footprint.c) and L the radiance of the map.
 *           What the lit board adds to L is taken out first (bounce_map.c).
 * Errors.   Noise is the map's. What a wrong sphere, pose or lamp does (sample_errors.c) neighbours
 *           share: it is kept apart from noise and never averages out (bins.c).
 */
#include "bounce_map.h"
#include "consensus.h"
#include "sample_errors.h"

#include <assert.h>

#define FATE_TEXT(name, text) text,
const char *const rec_fate_name[FATES] = {FATE_LIST(FATE_TEXT)};
#undef FATE_TEXT

static double square(double x)
{
    return x * x;
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
    };
    if (!lamp->at_infinity)
        v.lamp_position = cal_lamp_position(lamp, of->view_from_world);
    double dimming2 = square(of->sigma_power / of->power);
    for (int c = 0; c < 3; c++) {
        v.light[c] = lamp->intensity[c] * of->power;
        dimming2 += square(lamp->sigma_intensity[c] / lamp->intensity[c]) / 3;
    }
    v.dimming = sqrt(dimming2);
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
    return v;
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
    double bound = s->shape == SHAPE_CYLINDER ? hypot(s->radius, s->height / 2) : s->radius;
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

// Does the segment between two points pass through the board?
static bool behind_board(const struct board_extent *board, vec3 a, vec3 b)
{
    if (!board || (a.z > 0) == (b.z > 0))
        return false;
    double t = a.z / (a.z - b.z);
    double x = a.x + t * (b.x - a.x), y = a.y + t * (b.y - a.y);
    return x > board->low[0] && x < board->high[0] && y > board->low[1] && y < board->high[1];
}

static bool occluded(const struct viewing *v, vec3 point)
{
    if (behind_board(v->board, v->eye, point))
        return true;
    return !v->lamp->at_infinity && behind_board(v->board, v->lamp_position, point);
}

// Noise of the photosite's surroundings relative to their radiance, squared: what its own is
// expected to be. Photosites that were saturated in all frames have none to tell.
static double expected_noise2(const struct radiance *map, int x, int y)
{
    double value = 0, variance = 0;
    int count = 0;
    for (int j = y > 0 ? y - 1 : 0; j <= y + 1 && j < map->height; j++)
        for (int i = x > 0 ? x - 1 : 0; i <= x + 1 && i < map->width; i++) {
            size_t at = 3 * ((size_t)j * (size_t)map->width + (size_t)i);
            for (size_t c = at; c < at + 3; c++)
                if (isfinite(map->variance[c]) && isfinite(map->value[c])) {
                    value += (double)map->value[c];
                    variance += (double)map->variance[c];
                    count++;
                }
        }
    return value > 0 ? variance * count / square(value) : 1;
}

// Inverse variance, in units of the best that counts: no sample is trusted beyond 0.1 %, so that
// weights lie in (0, 1] and a bin's fixed-point sums cannot overflow.
static double weight_of(double relative_variance)
{
    const double best = 1e-6, worst = 1e4;
    return best / fmin(worst, fmax(best, relative_variance));
}

// The local frame: z is n, x where wo leans to.
static vec3 to_local(vec3 w, vec3 x, vec3 y, vec3 n)
{
    return (vec3){vec3_dot(w, x), vec3_dot(w, y), vec3_dot(w, n)};
}

static half_diff local_angles(const footprint *a)
{
    vec3 n = a->normal, side = vec3_cross(n, fabs(n.x) < 0.7 ? (vec3){1, 0, 0} : (vec3){0, 1, 0});
    vec3 x = vec3_normalize(side), y = vec3_cross(n, x);
    return rec_half_diff(to_local(a->wi, x, y, n), to_local(a->wo, x, y, n));
}

static enum fate read_photosite(reflectance_sample *out, const struct viewing *v,
                                const struct radiance *map, const footprint *a, int x, int y)
{
    const double limit = 1e5;  // 1/sr: a mirror whose lobe is 0.1 degrees wide; see bins.c
    size_t at = 3 * ((size_t)y * (size_t)map->width + (size_t)x);
    double pixel[2] = {x, y}, vignetting = cal_vignetting(v->camera, pixel);
    double bounced[3] = {0};
    out->channel = cap_radiance_channel(map, x, y);
    if (v->bounce)
        rec_bounce_at(v->bounce, a, x, y, bounced);
    for (int c = 0; c < 3; c++) {
        out->f[c] = out->noise[c] = out->bounced[c] = 0;
        if (out->channel >= 0 && c != out->channel)
            continue;
        double value = (double)map->value[at + c], variance = (double)map->variance[at + c];
        if (isinf(variance))
            return FATE_SATURATED;
        double scale = 1 / (vignetting * v->light[c] * a->irradiance);
        double extra = vignetting * bounced[c], most = 49;  // 98 % of the light
        out->f[c] = (value - extra) * scale;
        out->bounced[c] = extra > 0 ? extra / fmax(value - extra, extra / most) : 0;
        out->noise[c] = (variance + square(v->bounce_scatter * extra)) * scale * scale;
        if (!(fabs(out->f[c]) < limit) || !(out->noise[c] >= 0 && out->noise[c] < limit * limit))
            return FATE_UNUSABLE;
    }
    return FATE_USED;
}

double rec_mean_bounced(const reflectance_sample *s)
{
    double sum = s->bounced[0] + s->bounced[1] + s->bounced[2];
    return s->channel < 0 ? sum / 3 : sum;
}

// Too far from what the neighbours of its bin say?
static bool strays(reflectance_sample *s, const struct consensus *consensus)
{
    vec3 wi, wo;
    rec_directions(s->angles, &wi, &wo);
    return wi.z > 0 && wo.z > 0 && !rec_consensus_allows(consensus, s, wi, wo, &s->residual);
}

enum fate rec_sample_at(reflectance_sample *out, const struct viewing *viewing,
                        const struct radiance *map, int x, int y, bool *hit)
{
    footprint a;
    enum fate fate = rec_footprint(&a, viewing, x, y, hit);
    if (fate)
        return fate;
    if (vec3_dot(a.normal, a.wi) <= 0 || vec3_dot(a.normal, a.wo) <= 0)
        return FATE_TERMINATOR;
    if (occluded(viewing, a.point))
        return FATE_OCCLUDED;
    fate = read_photosite(out, viewing, map, &a, x, y);
    if (fate)
        return fate;
    out->angles = local_angles(&a);
    out->spread[0] = a.spread[0];
    out->spread[1] = a.spread[1];
    shared_errors shared = rec_shared_errors(viewing, &a);
    double bounced = rec_mean_bounced(out);
    out->systematic = hypot(shared.systematic, viewing->bounce_sigma * bounced);
    out->tilt = shared.tilt;
    out->weight = weight_of(expected_noise2(map, x, y) + square(out->systematic)
                            + square(viewing->bounce_scatter * bounced));
    out->point = a.point;
    out->normal = a.normal;
    out->wi = a.wi;
    out->wo = a.wo;
    out->residual = NAN;
    if (viewing->consensus && strays(out, viewing->consensus))
        return FATE_STRAY;
    return FATE_USED;
}
