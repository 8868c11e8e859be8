/* gaussian_field.c -- a height field with Gaussian slopes.
 *
 * Method.   A sum of plane waves of random direction, length and phase, all as high. Wave vectors
 * are normal deviates, so that heights at a distance r correlate by exp(-r^2), lengths being
 *           correlation lengths. Heights and slopes are Gaussian by the central limit theorem; a
 *           slope along x has the variance alpha^2 / 2, as in Beckmann's distribution.
 * Source.   M. Longuet-Higgins, "The Statistical Analysis of a Random, Moving Surface", Phil.
 * Trans. Royal Society A 249, 1957; the width as in Walter et al., EGSR 2007.
 */
#include "random.h"
#include "surface.h"

#include <stdlib.h>

enum { WAVES = 160, NODES_A_LENGTH = 9 };

struct wave {
    double kx, ky, phase;
};

// Height and slopes at (x, y).
static vec3 field_at(const struct wave wave[WAVES], double height, double x, double y, double *z)
{
    double sum = 0, slope_x = 0, slope_y = 0;
    for (int i = 0; i < WAVES; i++) {
        double angle = wave[i].kx * x + wave[i].ky * y + wave[i].phase, s = sin(angle);
        sum += cos(angle);
        slope_x -= wave[i].kx * s;
        slope_y -= wave[i].ky * s;
    }
    *z = height * sum;
    return vec3_normalize((vec3){-height * slope_x, -height * slope_y, 1});
}

static void make_waves(struct wave wave[WAVES], uint64_t seed)
{
    struct random random = sam_random_at(seed, 1, 0);
    for (int i = 0; i < WAVES; i++) {
        wave[i].kx = sqrt(2) * sam_normal(&random);
        wave[i].ky = sqrt(2) * sam_normal(&random);
        wave[i].phase = 2 * CAP_PI * sam_uniform(&random);
    }
}

struct geometry sam_gaussian_field(const struct surface *surface, int threads)
{
    const int n = surface->nodes;
    struct geometry g = {.points = n * n, .triangles = 2 * (n - 1) * (n - 1)};
    g.point = malloc((size_t)g.points * sizeof *g.point);
    g.normal = malloc((size_t)g.points * sizeof *g.normal);
    g.triangle = malloc((size_t)g.triangles * sizeof *g.triangle);
    if (!g.point || !g.normal || !g.triangle)
        return g;
    struct wave wave[WAVES];
    make_waves(wave, surface->seed);
    // The variance of a slope is height^2 WAVES / 2 times that of k, 2: alpha^2 / 2.
    const double height = surface->alpha / sqrt(2 * WAVES), step = 1.0 / NODES_A_LENGTH;
#pragma omp parallel for schedule(static) num_threads(threads)
    for (int i = 0; i < g.points; i++) {
        double x = (i % n - 0.5 * (n - 1)) * step, y = (i / n - 0.5 * (n - 1)) * step, z;
        g.normal[i] = field_at(wave, height, x, y, &z);
        g.point[i] = (vec3){x, y, z};
    }
    for (int i = 0; i < (n - 1) * (n - 1); i++) {
        unsigned a = (unsigned)(i / (n - 1) * n + i % (n - 1)), row = (unsigned)n;
        unsigned(*t)[3] = &g.triangle[2 * i];
        t[0][0] = a, t[0][1] = a + 1, t[0][2] = a + row + 1;
        t[1][0] = a, t[1][1] = a + row + 1, t[1][2] = a + row;
    }
    return g;
}
