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

// Streams of what belongs to the sensor and not to a photograph.
enum { FRAME_PRNU = -3, FRAME_HOT = -4, FRAME_TIME = -5 };

double sam_true_time(const struct scene *scene, double seconds, uint32_t frame)
{
    struct random random = sam_random_at(scene->seed, (uint32_t)FRAME_TIME, frame);
    return seconds * fmax(0.1, 1 + scene->sensor.time_error * sam_normal(&random));
}

/** The photosite's own sensitivity; 1 on average. */
static double sensitivity(const struct scene *scene, uint64_t site)
{
    if (scene->sensor.prnu == 0)
        return 1;
    struct random random = sam_random_at(scene->seed, (uint32_t)FRAME_PRNU, site);
    return fmax(0, 1 + scene->sensor.prnu * sam_normal(&random));
}

/** Electrons a second that a hot photosite leaks, exponentially distributed; 0 for most. */
static double leak(const struct scene *scene, uint64_t site)
{
    if (scene->sensor.hot_fraction == 0)
        return 0;
    struct random random = sam_random_at(scene->seed, (uint32_t)FRAME_HOT, site);
    if (sam_uniform(&random) >= scene->sensor.hot_fraction)
        return 0;
    return -scene->sensor.hot_rate * log(sam_uniform(&random));
}

/** One photosite. What is beyond four wells cannot be told from four. */
static uint16_t convert(const struct sensor_model *sensor, double electrons, struct random *random)
{
    double mean = fmin(fmax(electrons, 0), fmin(4 * sensor->full_well, 1e9));
    double counted = fmin(sam_poisson(random, mean), sensor->full_well);
    counted += sensor->read_noise * sam_normal(random);
    double dn = round(sensor->black_level + counted * sensor->dn_per_electron);
    return (uint16_t)fmin(fmax(dn, 0), sensor->adc_max);
}

/** Everything that the pixels of a photograph share. */
struct frame {
    const struct scene *scene;
    uint32_t number;
    double factor;   // electrons for radiance 1, in the middle
    double seconds;  // for leaks
};

static void expose_pixel(const struct frame *frame, const float rgb[3], int x, int y, uint16_t *dn)
{
    const struct scene *scene = frame->scene;
    int channels = sam_channels(scene);
    uint64_t pixel = (uint64_t)y * (uint64_t)scene->camera.width + (uint64_t)x;
    struct random random = sam_random_at(scene->seed, frame->number, pixel);
    double factor = frame->factor * sam_vignetting(scene, x, y);
    for (int k = 0; k < channels; k++) {
        int c = channels == 1 ? cap_cfa_channel(scene->sensor.cfa, x, y) : k;
        uint64_t site = pixel * (uint64_t)channels + (uint64_t)k;
        double electrons =
            (double)rgb[c] * factor * scene->sensor.channel_gain[c] * sensitivity(scene, site)
            + leak(scene, site) * frame->seconds;
        dn[k] = convert(&scene->sensor, electrons, &random);
    }
}

static void expose_rows(const struct frame *frame, const float *value, bool even, uint16_t *dn)
{
    const struct camera *camera = &frame->scene->camera;
    size_t channels = (size_t)sam_channels(frame->scene), pixel = 0;
    for (int y = 0; y < camera->height; y++)
        for (int x = 0; x < camera->width; x++, pixel++)
            expose_pixel(frame, even ? value : &value[3 * pixel], x, y, &dn[channels * pixel]);
}

void sam_sensor_expose(const struct scene *scene, const float *value, double seconds,
                       uint32_t frame, uint16_t *dn)
{
    static const float darkness[3] = {0, 0, 0};
    double time = sam_true_time(scene, seconds, frame);
    struct frame f = {scene, frame, scene->sensor.electrons * time, time};
    expose_rows(&f, value ? value : darkness, !value, dn);
}

void sam_sensor_flat(const struct scene *scene, double fill, uint32_t frame, uint16_t *dn)
{
    static const float wall[3] = {1, 1, 1};
    const struct sensor_model *sensor = &scene->sensor;
    const double *gain = sensor->channel_gain;
    double brightest = fmax(gain[0], fmax(gain[1], gain[2]));
    double range = (sensor->adc_max - sensor->black_level) / sensor->dn_per_electron;
    struct frame f = {scene, frame, fill * fmin(sensor->full_well, range) / brightest, 0};
    expose_rows(&f, wall, true, dn);
}
