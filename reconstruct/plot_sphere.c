/* plot_sphere.c -- a sphere of the material, lit by one distant lamp: the picture that the report's
 * viewer draws too (report/viewer.js), pixel for pixel. */
#include "plot.h"

// As in preview.png: from the upper left, 30 degrees off the view.
const vec3 rec_sphere_lamp = {-0.4, 0.3, 0.86602540378443865};

// IEC 61966-2-1's curve, to 8 bits.
static uint32_t encode(double linear)
{
    double x = fmin(1, fmax(0, linear));
    double s = x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - 0.055;
    return (uint32_t)(255 * s + 0.5);
}

// Radiance of the point whose normal is n, seen along -z, under irradiance pi.
static void shade(const struct brdf *brdf, vec3 n, vec3 lamp, double radiance[3])
{
    vec3 side = vec3_cross(n, fabs(n.x) < 0.7 ? (vec3){1, 0, 0} : (vec3){0, 1, 0});
    vec3 t = vec3_normalize(side), b = vec3_cross(n, t);
    vec3 wi = {vec3_dot(lamp, t), vec3_dot(lamp, b), vec3_dot(lamp, n)};
    vec3 wo = {t.z, b.z, n.z};
    rec_brdf_eval(brdf, wi, wo, radiance);
    for (int c = 0; c < 3; c++)
        radiance[c] *= CAP_PI * fmax(0, wi.z);
}

struct picture rec_sphere_picture(const struct brdf *brdf, vec3 lamp, double exposure, int size,
                                  int margin, int threads)
{
    struct picture p = rec_picture_make(size, size);
    const double middle = 0.5 * (size - 1), radius = 0.5 * size - margin;
#pragma omp parallel for schedule(dynamic, 16) num_threads(threads)
    for (int j = 0; j < (p.argb ? size : 0); j++)
        for (int i = 0; i < size; i++) {
            double x = (i - middle) / radius, y = (middle - j) / radius, r2 = x * x + y * y, f[3];
            if (r2 >= 1)
                continue;
            shade(brdf, (vec3){x, y, sqrt(1 - r2)}, lamp, f);
            uint32_t *to = p.argb + (size_t)j * (size_t)size + (size_t)i;
            *to = 0xff000000u | encode(exposure * f[0]) << 16 | encode(exposure * f[1]) << 8
                  | encode(exposure * f[2]);
        }
    return p;
}
