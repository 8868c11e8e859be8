/* optics.c -- what the lens does to the radiance image: point spread and veiling glare.
 *
 * Method.   The point spread is a Gaussian, applied along rows, then along columns, out to four
 *           standard deviations (6e-5 of the light is beyond, and is given back by normalising);
 *           beyond the border the picture goes on as it ends. Glare takes a share of all light and
 *           spreads it evenly.
 */
#include "optics.h"

#include <stdlib.h>

enum { REACH_MAX = 400 };

/** Weights of one half, the middle first; they add up to 1 with both halves. */
static int gaussian(double sigma, double weight[REACH_MAX + 1])
{
    int reach = (int)fmin(ceil(4 * sigma), REACH_MAX);
    double sum = 0;
    for (int i = 0; i <= reach; i++) {
        weight[i] = exp(-0.5 * i * i / (sigma * sigma));
        sum += i ? 2 * weight[i] : weight[i];
    }
    for (int i = 0; i <= reach; i++)
        weight[i] /= sum;
    return reach;
}

static int clamp(int i, int count)
{
    return i < 0 ? 0 : i >= count ? count - 1 : i;
}

/** One line of `count` pixels, `stride` floats apart, from -> to. */
static void blur_line(const float *from, float *to, int count, size_t stride, const double *weight,
                      int reach)
{
    for (int i = 0; i < count; i++)
        for (int c = 0; c < 3; c++) {
            double sum = weight[0] * (double)from[(size_t)i * stride + (size_t)c];
            for (int k = 1; k <= reach; k++)
                sum += weight[k]
                       * ((double)from[(size_t)clamp(i - k, count) * stride + (size_t)c]
                          + (double)from[(size_t)clamp(i + k, count) * stride + (size_t)c]);
            to[(size_t)i * stride + (size_t)c] = (float)sum;
        }
}

static void blur(float *value, float *aside, int width, int height, double sigma, int threads)
{
    double weight[REACH_MAX + 1] = {1};
    int reach = gaussian(sigma, weight);
    size_t row = (size_t)width * 3;
#pragma omp parallel for num_threads(threads)
    for (int y = 0; y < height; y++)
        blur_line(&value[(size_t)y * row], &aside[(size_t)y * row], width, 3, weight, reach);
#pragma omp parallel for num_threads(threads)
    for (int x = 0; x < width; x++)
        blur_line(&aside[(size_t)x * 3], &value[(size_t)x * 3], height, row, weight, reach);
}

/** Summed in the order of the rows: the same for any number of threads. */
static void veil(float *value, size_t pixels, double share)
{
    double mean[3] = {0, 0, 0};
    for (size_t i = 0; i < 3 * pixels; i++)
        mean[i % 3] += (double)value[i] / (double)pixels;
    for (size_t i = 0; i < 3 * pixels; i++)
        value[i] = (float)((1 - share) * (double)value[i] + share * mean[i % 3]);
}

enum status sam_optics_apply(const struct scene *scene, int threads, float *value,
                             struct error *err)
{
    int width = scene->camera.width, height = scene->camera.height;
    size_t pixels = (size_t)width * (size_t)height;
    if (scene->optics.blur > 0) {
        float *aside = malloc(3 * pixels * sizeof *aside);
        if (!aside)
            return cap_fail(err, STATUS_MEMORY, "a picture of %d x %d", width, height);
        blur(value, aside, width, height, scene->optics.blur, threads);
        free(aside);
    }
    if (scene->optics.glare > 0)
        veil(value, pixels, scene->optics.glare);
    return STATUS_OK;
}
