/* sphere.c -- a sphere of a material under one lamp, and the difference of two by PSNR and
 * CIEDE2000.
 *
 * Source.   G. Sharma, W. Wu, E. Dalal, "The CIEDE2000 Color-Difference Formula", Color Research
 * and Application 30, 2005.
 */
#include "sphere.h"

#include "quantile.h"

#include <stdlib.h>

// Middles of pixels, with the sphere's radius half the picture.
static void on_square(int x, int y, double at[2])
{
    at[0] = (x + 0.5) / SPHERE_SIZE * 2 - 1;
    at[1] = 1 - (y + 0.5) / SPHERE_SIZE * 2;
}

bool rec_on_sphere(int x, int y)
{
    double at[2];
    on_square(x, y, at);
    return at[0] * at[0] + at[1] * at[1] < 1;
}

// From the upper left, 30 degrees off the view.
const vec3 rec_sphere_lamp = {-0.4, 0.3, 0.86602540378443865};

void rec_sphere_shade(const struct brdf *brdf, vec3 n, vec3 lamp, double radiance[3])
{
    vec3 side = vec3_cross(n, fabs(n.x) < 0.7 ? (vec3){1, 0, 0} : (vec3){0, 1, 0});
    vec3 t = vec3_normalize(side), b = vec3_cross(n, t);
    vec3 wi = {vec3_dot(lamp, t), vec3_dot(lamp, b), vec3_dot(lamp, n)};
    vec3 wo = {t.z, b.z, n.z};
    rec_brdf_eval(brdf, wi, wo, radiance);
    for (int c = 0; c < 3; c++)
        radiance[c] *= CAP_PI * fmax(0, wi.z);
}

void rec_lit_sphere(float *rgb, const struct brdf *brdf, int threads)
{
#pragma omp parallel for schedule(dynamic, 8) num_threads(threads)
    for (int y = 0; y < SPHERE_SIZE; y++)
        for (int x = 0; x < SPHERE_SIZE; x++) {
            double at[2], f[3] = {0, 0, 0};
            on_square(x, y, at);
            if (rec_on_sphere(x, y)) {
                vec3 n = {at[0], at[1], sqrt(1 - at[0] * at[0] - at[1] * at[1])};
                rec_sphere_shade(brdf, n, rec_sphere_lamp, f);
            }
            for (int c = 0; c < 3; c++)
                rgb[3 * (y * SPHERE_SIZE + x) + c] = (float)f[c];
        }
}

/* ---- colour differences -----------------------------------------------------------------------
 */

typedef struct {
    double l, a, b;
} lab;

static double lab_root(double t)
{
    return t > 216.0 / 24389 ? cbrt(t) : (24389.0 / 27 * t + 16) / 116;
}

// Of linear sRGB, under its own white.
static lab lab_of(const double rgb[3])
{
    double x = 0.4124564 * rgb[0] + 0.3575761 * rgb[1] + 0.1804375 * rgb[2];
    double y = 0.2126729 * rgb[0] + 0.7151522 * rgb[1] + 0.0721750 * rgb[2];
    double z = 0.0193339 * rgb[0] + 0.1191920 * rgb[1] + 0.9503041 * rgb[2];
    double fx = lab_root(x / 0.9504700), fy = lab_root(y), fz = lab_root(z / 1.0888300);
    return (lab){116 * fy - 16, 500 * (fx - fy), 200 * (fy - fz)};
}

static double pow7(double x)
{
    double x2 = x * x;
    return x2 * x2 * x2 * x;
}

// Hues in radians, [0, 2 pi).
static double hue(double a, double b)
{
    double h = a == 0 && b == 0 ? 0 : atan2(b, a);
    return h < 0 ? h + 2 * CAP_PI : h;
}

// The paper's equations 2 to 22, with all weights 1.
static double ciede2000(lab p, lab q)
{
    const double degree = CAP_PI / 180, far = pow7(25);
    double c7 = pow7((hypot(p.a, p.b) + hypot(q.a, q.b)) / 2);
    double g = 1.5 - 0.5 * sqrt(c7 / (c7 + far));
    double c1 = hypot(g * p.a, p.b), c2 = hypot(g * q.a, q.b);
    double h1 = hue(g * p.a, p.b), h2 = hue(g * q.a, q.b), dh = h2 - h1, mean_h = (h1 + h2) / 2;
    bool grey = c1 * c2 == 0;
    if (grey) {
        dh = 0;
        mean_h = h1 + h2;
    } else if (fabs(dh) > CAP_PI) {
        mean_h += mean_h < CAP_PI ? CAP_PI : -CAP_PI;
        dh += dh < 0 ? 2 * CAP_PI : -2 * CAP_PI;
    }
    double dl = q.l - p.l, dc = c2 - c1, dhue = 2 * sqrt(c1 * c2) * sin(dh / 2);
    double l = (p.l + q.l) / 2 - 50, c = (c1 + c2) / 2;
    double t = 1 - 0.17 * cos(mean_h - 30 * degree) + 0.24 * cos(2 * mean_h)
               + 0.32 * cos(3 * mean_h + 6 * degree) - 0.20 * cos(4 * mean_h - 63 * degree);
    double bend = (mean_h / degree - 275) / 25, rc = 2 * sqrt(pow7(c) / (pow7(c) + far));
    double sl = 1 + 0.015 * l * l / sqrt(20 + l * l), sc = 1 + 0.045 * c, sh = 1 + 0.015 * c * t;
    double rt = -sin(60 * degree * exp(-bend * bend)) * rc;
    dl /= sl;
    dc /= sc;
    dhue /= sh;
    return sqrt(fmax(0, dl * dl + dc * dc + dhue * dhue + rt * dc * dhue));
}

double rec_delta_e(const double a[3], const double b[3])
{
    return ciede2000(lab_of(a), lab_of(b));
}

static void clipped(double to[3], const float *from)
{
    for (int c = 0; c < 3; c++)
        to[c] = fmin(1, fmax(0, (double)from[c]));
}

enum status rec_sphere_compare(struct picture_errors *errors, const float *a, const float *b,
                               struct error *err)
{
    double *each = malloc(SPHERE_SIZE * SPHERE_SIZE * sizeof *each), square = 0, sum = 0;
    if (!each)
        return cap_fail(err, STATUS_MEMORY, "no memory for a picture");
    int n = 0;
    for (int i = 0; i < SPHERE_SIZE * SPHERE_SIZE; i++) {
        if (!rec_on_sphere(i % SPHERE_SIZE, i / SPHERE_SIZE))
            continue;
        double p[3], q[3];
        clipped(p, a + 3 * i);
        clipped(q, b + 3 * i);
        for (int c = 0; c < 3; c++)
            square += (p[c] - q[c]) * (p[c] - q[c]) / 3;
        each[n] = rec_delta_e(p, q);
        sum += each[n++];
    }
    *errors = (struct picture_errors){.psnr = 10 * log10(n / square),
                                      .delta_e = sum / n,
                                      .delta_e_95 = rec_quantile(each, n, 0.95)};
    free(each);
    return STATUS_OK;
}
