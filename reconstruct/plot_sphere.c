/* plot_sphere.c -- a sphere of the material, lit by one distant lamp: the picture that the report's
 * viewer draws too (report/viewer.js), pixel for pixel. */
#include "plot.h"

// IEC 61966-2-1's curve, to 8 bits.
static uint32_t encode(double linear)
{
    double x = fmin(1, fmax(0, linear));
    double s = x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - 0.055;
    return (uint32_t)(255 * s + 0.5);
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
            rec_sphere_shade(brdf, (vec3){x, y, sqrt(1 - r2)}, lamp, f);
            uint32_t *to = p.argb + (size_t)j * (size_t)size + (size_t)i;
            *to = 0xff000000u | encode(exposure * f[0]) << 16 | encode(exposure * f[1]) << 8
                  | encode(exposure * f[2]);
        }
    return p;
}
