/* expose.c -- radiance becomes the numbers of a photograph: photons, well, read noise, converter.
 */
#include "expose.h"

#include "random.h"

double sam_vignetting(const struct scene *scene, double x, double y)
{
    const struct camera *camera = &scene->camera;
    const double *v = scene->sensor.vignetting;
    double dx = x - camera->center[0], dy = y - camera->center[1];
    double w = camera->width, h = camera->height;
    double q = 4 * (dx * dx + dy * dy) / (w * w + h * h);
    return 1 + q * (v[0] + q * (v[1] + q * v[2]));
}

/** One photosite. The converter's round and clip also bound what read noise pulls below zero. */
static uint16_t convert(const struct sensor_model *sensor, double electrons, struct random *random)
{
    double counted = fmin(sam_poisson(random, fmax(electrons, 0)), sensor->full_well);
    counted += sensor->read_noise * sam_normal(random);
    double dn = round(sensor->black_level + counted * sensor->dn_per_electron);
    return (uint16_t)fmin(fmax(dn, 0), sensor->adc_max);
}

/** Electrons that the brightest pixel of a photograph may hold before Poisson and well: beyond a
 *  few wells they change nothing. */
static double enough(const struct sensor_model *sensor, double electrons)
{
    return fmin(electrons, fmin(4 * sensor->full_well, 1e9));
}

static void expose_pixel(const struct scene *scene, const float rgb[3], double factor,
                         uint32_t frame, size_t pixel, uint16_t dn[3])
{
    struct random random = sam_random_at(scene->seed, frame, pixel);
    for (int c = 0; c < 3; c++) {
        double electrons = (double)rgb[c] * factor * scene->sensor.channel_gain[c];
        dn[c] = convert(&scene->sensor, enough(&scene->sensor, electrons), &random);
    }
}

void sam_sensor_expose(const struct scene *scene, const float *value, double seconds,
                       uint32_t frame, uint16_t *dn)
{
    size_t pixel = 0;
    for (int y = 0; y < scene->camera.height; y++)
        for (int x = 0; x < scene->camera.width; x++, pixel++) {
            double factor = scene->sensor.electrons * seconds * sam_vignetting(scene, x, y);
            expose_pixel(scene, &value[3 * pixel], factor, frame, pixel, &dn[3 * pixel]);
        }
}

void sam_sensor_flat(const struct scene *scene, double fill, uint32_t frame, uint16_t *dn)
{
    static const float wall[3] = {1, 1, 1};
    const double *gain = scene->sensor.channel_gain;
    double brightest = fmax(gain[0], fmax(gain[1], gain[2]));
    double range =
        (scene->sensor.adc_max - scene->sensor.black_level) / scene->sensor.dn_per_electron;
    double electrons = fill * fmin(scene->sensor.full_well, range) / brightest;
    size_t pixel = 0;
    for (int y = 0; y < scene->camera.height; y++)
        for (int x = 0; x < scene->camera.width; x++, pixel++)
            expose_pixel(scene, wall, electrons * sam_vignetting(scene, x, y), frame, pixel,
                         &dn[3 * pixel]);
}
