/* camera.c -- poses, the pinhole, and the Brown-Conrady lens.
 *
 * Method.   R = I + a [w]x + b [w]x^2 with a = sin t / t, b = (1 - cos t) / t^2, t = |w|. The
 *           lens, for normalised coordinates (x, y) and q = x^2 + y^2:
 *               x' = x (1 + k1 q + k2 q^2 + k3 q^3) + 2 p1 x y + p2 (q + 2 x^2)
 *               y' = y (1 + k1 q + k2 q^2 + k3 q^3) + p1 (q + 2 y^2) + 2 p2 x y
 *           (D. Brown, "Close-Range Camera Calibration", 1971, in OpenCV's order of numbers).
 *           Its inverse has no closed form: Newton's method, from the distorted point.
 * Accuracy. Rounding only; near t = 0 a and b come from half angles and series, without
 *           cancellation. The inverse is within 1e-12 of a focal length where it exists.
 */
#include "lens.h"

#include <assert.h>
#include <string.h>

// ---- poses

mat3 cal_rotation(vec3 w)
{
    double t = vec3_length(w), half = 0.5 * t;
    // sin(t)/t; and (1 - cos t)/t^2 = 1/2 (sin(t/2)/(t/2))^2. Below 1e-4 the next term is 1e-17.
    double a = t < 1e-4 ? 1 - t * t / 6 : sin(t) / t;
    double s = half < 1e-4 ? 1 - half * half / 6 : sin(half) / half;
    double b = 0.5 * s * s, d = 1 - b * t * t;
    return (mat3){{
        {d + b * w.x * w.x, b * w.x * w.y - a * w.z, b * w.x * w.z + a * w.y},
        {b * w.x * w.y + a * w.z, d + b * w.y * w.y, b * w.y * w.z - a * w.x},
        {b * w.x * w.z - a * w.y, b * w.y * w.z + a * w.x, d + b * w.z * w.z},
    }};
}

vec3 cal_eye(pose view_from_world)
{
    mat3 r = cal_rotation(view_from_world.rotation);
    return vec3_scale(mat3_mul_t(&r, view_from_world.translation), -1);
}

vec3 cal_to_view(pose view_from_world, vec3 p_world)
{
    mat3 r = cal_rotation(view_from_world.rotation);
    return vec3_add(mat3_mul(&r, p_world), view_from_world.translation);
}

vec3 lens_rotate(vec3 w, vec3 p, double by_rotation[3][3])
{
    mat3 r = cal_rotation(w);
    vec3 rp = mat3_mul(&r, p);
    if (!by_rotation)
        return rp;
    double t2 = vec3_dot(w, w);
    for (int j = 0; j < 3; j++) {
        vec3 e = {j == 0, j == 1, j == 2}, axis = e;
        double wj = vec3_dot(w, e);
        if (t2 > 1e-12) {  // dR/dw_j = [w_j w + w x (I - R) e_j]x R / t^2
            vec3 turned = vec3_sub(e, mat3_mul(&r, e));
            axis = vec3_scale(vec3_add(vec3_scale(w, wj), vec3_cross(w, turned)), 1 / t2);
        }
        vec3 d = vec3_cross(axis, rp);
        by_rotation[0][j] = d.x;
        by_rotation[1][j] = d.y;
        by_rotation[2][j] = d.z;
    }
    return rp;
}

// ---- the lens

void lens_distort(const double distortion[5], const double xy[2], double out[2], double by_x[2][2])
{
    const double k1 = distortion[0], k2 = distortion[1], k3 = distortion[4];
    const double p1 = distortion[2], p2 = distortion[3];
    double x = xy[0], y = xy[1], q = x * x + y * y;
    double radial = 1 + q * (k1 + q * (k2 + q * k3));
    out[0] = x * radial + 2 * p1 * x * y + p2 * (q + 2 * x * x);
    out[1] = y * radial + p1 * (q + 2 * y * y) + 2 * p2 * x * y;
    if (by_x) {
        double slope = 2 * (k1 + q * (2 * k2 + q * 3 * k3));  // d radial / d x = slope x
        by_x[0][0] = radial + slope * x * x + 2 * p1 * y + 6 * p2 * x;
        by_x[0][1] = by_x[1][0] = slope * x * y + 2 * p1 * x + 2 * p2 * y;
        by_x[1][1] = radial + slope * y * y + 6 * p1 * y + 2 * p2 * x;
    }
}

void lens_undistort(const double distortion[5], const double distorted[2], double x[2])
{
    double best = INFINITY, at[2] = {distorted[0], distorted[1]};
    x[0] = at[0];
    x[1] = at[1];
    for (int i = 0; i < 30; i++) {
        double d[2], j[2][2];
        lens_distort(distortion, at, d, j);
        double e[2] = {d[0] - distorted[0], d[1] - distorted[1]};
        double miss = hypot(e[0], e[1]), det = j[0][0] * j[1][1] - j[0][1] * j[1][0];
        if (!(miss < best))
            break;
        best = miss;
        x[0] = at[0];
        x[1] = at[1];
        if (best < 1e-15 || !(det > 0))
            break;
        at[0] -= (j[1][1] * e[0] - j[0][1] * e[1]) / det;
        at[1] -= (j[0][0] * e[1] - j[1][0] * e[0]) / det;
    }
}

void lens_to_array(double parameters[LENS_PARAMETERS], const struct camera *camera)
{
    memcpy(parameters, camera->focal, sizeof camera->focal);
    memcpy(parameters + 2, camera->center, sizeof camera->center);
    memcpy(parameters + 4, camera->distortion, sizeof camera->distortion);
}

void lens_from_array(struct camera *camera, const double parameters[LENS_PARAMETERS])
{
    memcpy(camera->focal, parameters, sizeof camera->focal);
    memcpy(camera->center, parameters + 2, sizeof camera->center);
    memcpy(camera->distortion, parameters + 4, sizeof camera->distortion);
}

static void derivatives_by_parameter(const double parameters[LENS_PARAMETERS], const double xy[2],
                                     const double d[2], double by_parameter[2][LENS_PARAMETERS])
{
    double x = xy[0], y = xy[1], q = x * x + y * y;
    const double by_k[5][2] = {{x * q, y * q},
                               {x * q * q, y * q * q},
                               {2 * x * y, q + 2 * y * y},
                               {q + 2 * x * x, 2 * x * y},
                               {x * q * q * q, y * q * q * q}};
    for (int i = 0; i < 2; i++) {
        by_parameter[i][0] = i == 0 ? d[0] : 0;
        by_parameter[i][1] = i == 1 ? d[1] : 0;
        by_parameter[i][2] = i == 0;
        by_parameter[i][3] = i == 1;
        for (int k = 0; k < 5; k++)
            by_parameter[i][4 + k] = parameters[i] * by_k[k][i];
    }
}

void lens_project(const double parameters[LENS_PARAMETERS], vec3 p, double pixel[2],
                  double by_point[2][3], double by_parameter[2][LENS_PARAMETERS])
{
    assert(p.z > 0);
    double x[2] = {p.x / p.z, p.y / p.z}, d[2], j[2][2];
    lens_distort(parameters + 4, x, d, by_point ? j : NULL);
    for (int i = 0; i < 2; i++) {
        pixel[i] = parameters[i] * d[i] + parameters[2 + i];
        if (by_point) {
            double gx = parameters[i] * j[i][0] / p.z, gy = parameters[i] * j[i][1] / p.z;
            by_point[i][0] = gx;
            by_point[i][1] = gy;
            by_point[i][2] = -(gx * x[0] + gy * x[1]);
        }
    }
    if (by_parameter)
        derivatives_by_parameter(parameters, x, d, by_parameter);
}

void cal_project(const struct camera *camera, vec3 p_view, double pixel[2])
{
    double parameters[LENS_PARAMETERS];
    lens_to_array(parameters, camera);
    lens_project(parameters, p_view, pixel, NULL, NULL);
}

vec3 cal_ray(const struct camera *camera, const double pixel[2])
{
    double distorted[2], x[2];
    for (int i = 0; i < 2; i++)
        distorted[i] = (pixel[i] - camera->center[i]) / camera->focal[i];
    lens_undistort(camera->distortion, distorted, x);
    return vec3_normalize((vec3){x[0], x[1], 1});
}

double cal_vignetting(const struct camera *camera, const double pixel[2])
{
    double dx = pixel[0] - camera->center[0], dy = pixel[1] - camera->center[1];
    double w = camera->width, h = camera->height;
    double q = 4 * (dx * dx + dy * dy) / (w * w + h * h);
    double v = 1 + q * (camera->vignetting[0] + q * camera->vignetting[1]);
    return fmin(1, fmax(v, 1e-3));  // a poor fit must not turn light dark or negative
}

// As a point, a lamp at infinity is so far away that its rays are parallel over any scene.
static const double FAR_MM = 1e8;

vec3 cal_lamp_position(const struct lamp *lamp, pose view_from_world)
{
    vec3 place = lamp->at_infinity ? vec3_scale(lamp->direction, FAR_MM) : lamp->position;
    if (!lamp->on_camera)
        return place;
    mat3 r = cal_rotation(view_from_world.rotation);
    return mat3_mul_t(&r, vec3_sub(place, view_from_world.translation));
}

vec3 cal_lamp_way(const struct lamp *lamp, pose view_from_world, vec3 point, double *falloff)
{
    if (lamp->at_infinity) {
        mat3 r = cal_rotation(view_from_world.rotation);
        *falloff = 1;
        return lamp->on_camera ? mat3_mul_t(&r, lamp->direction) : lamp->direction;
    }
    vec3 to = vec3_sub(cal_lamp_position(lamp, view_from_world), point);
    double distance = vec3_length(to);
    vec3 way = vec3_scale(to, 1 / distance);
    *falloff = 1 / (distance * distance);
    if (lamp->beam.exponent > 0) {
        mat3 r = cal_rotation(view_from_world.rotation);
        vec3 away = vec3_scale(lamp->on_camera ? mat3_mul(&r, way) : way, -1);
        *falloff *= cal_beam_share(&lamp->beam, away);
    }
    return way;
}
