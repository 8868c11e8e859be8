/* sensor.c -- a camera's levels and noise, found from a sample of its photographs.
 *
 * From every shot one band of rows is read, the bands spread over the height of the image, some
 * two million photosites in all: strips that lie elsewhere are not even decoded.
 */
#include "bracket.h"
#include "sensor.h"

#include <stdlib.h>
#include <string.h>

enum { PHOTOSITES = 2000000, ROWS_MIN = 16 };

void sensor_from_samples(struct sensor *sensor, const struct bracket_sample *sample, int samples,
                         const struct sensor_known *known, struct sensor_doubts *doubts)
{
#pragma omp parallel for num_threads(3)
    for (int c = 0; c < 3; c++) {
        struct sensor_doubts mine = {0};
        sensor_find_levels(sensor, c, sample, samples, known, &mine);
        sensor_find_noise(sensor, c, sample, samples, known, &mine);
#pragma omp critical
        {
            doubts->black = doubts->black || mine.black;
            doubts->noise = doubts->noise || mine.noise;
        }
    }
}

/* Mean of a dark frame. One frame is as noisy as the photographs: its mean says more than its
 * photosites. */
static enum status dark_level(double *level, const struct capture *capture, struct error *err)
{
    struct photo_file *file = NULL;
    char *path = cap_path(capture->folder, capture->dark);
    uint16_t *row = NULL;
    enum status status =
        path ? photo_open(&file, path, err) : cap_fail(err, STATUS_MEMORY, "%s", capture->dark);
    size_t count = status ? 0 : 3 * (size_t)file->info.width;
    double sum = 0;
    if (!status && !(row = malloc(count * sizeof *row)))
        status = cap_fail(err, STATUS_MEMORY, "%s", path);
    for (int y = 0; !status && y < file->info.height; y++) {
        status = photo_read(file, row, 1, err);
        for (size_t i = 0; i < count && !status; i++)
            sum += row[i];
    }
    if (!status)
        *level = sum / ((double)count * file->info.height);
    free(row);
    photo_close(file);
    free(path);
    return status;
}

/* A bracket of which only one band is in memory. */
struct band {
    struct bracket bracket;
    bool read;
};

/* The band from row `top` on, with the frames that are not to be skipped. */
static enum status try_band(struct band *band, const struct capture *capture,
                            const struct shot *shot, const bool *skip, int top, int rows, int *bad)
{
    enum status status = bracket_open(&band->bracket, capture, shot, skip, rows, bad, NULL);
    if (!status)
        status = bracket_skip(&band->bracket, top, bad, NULL);
    if (!status)
        status = bracket_read(&band->bracket, rows, bad, NULL);
    band->read = !status && band->bracket.frames > 0;
    if (!band->read)
        bracket_close(&band->bracket);
    return status;
}

/* Damaged photographs are passed over; the merge tells about them. */
static void read_band(struct band *band, const struct capture *capture, const struct shot *shot,
                      int index, int rows)
{
    int height = capture->photo[shot->photo[0]].height;
    rows = rows < height ? rows : height;
    // Multiples of the golden ratio, modulo 1, spread evenly for any number of shots.
    double place = index * 0.6180339887498949;
    int top = (int)((place - floor(place)) * (height - rows + 1));
    bool *skip = calloc((size_t)capture->photos, sizeof *skip);
    for (bool again = skip != NULL; again;) {
        int bad = -1;
        again = try_band(band, capture, shot, skip, top, rows, &bad) != STATUS_OK && bad >= 0;
        if (again)
            skip[bad] = true;
    }
    free(skip);
}

static int read_bands(struct band *band, const struct capture *capture, int camera,
                      const struct run *run)
{
    int *shot = calloc((size_t)capture->shots, sizeof *shot), shots = 0;
    for (int s = 0; shot && s < capture->shots; s++)
        if (capture->shot[s].camera == camera)
            shot[shots++] = s;
    if (shots > 0) {
        int rows = PHOTOSITES / shots / capture->camera[camera].width;
        rows = rows > ROWS_MIN ? rows : ROWS_MIN;
#pragma omp parallel for schedule(dynamic) num_threads(run->threads)
        for (int k = 0; k < shots; k++)
            read_band(&band[k], capture, &capture->shot[shot[k]], k, rows);
    }
    free(shot);
    return shots;
}

static void tell_doubts(const struct sensor_doubts *doubts, const struct sensor_known *known,
                        struct run *run)
{
    if (doubts->black && isnan(known->black) && !known->encoded)
        cap_warn(run, "the photographs do not tell the black level (no bracket of exposure "
                      "times); it is taken to be 0: give `noise: {black: ...}`");
    if (doubts->noise)
        cap_warn(run, "the photographs do not tell the sensor's noise (no bracket of exposure "
                      "times); a usual one is assumed: give `noise: {gain: ..., read_noise: ...}`");
}

enum status cap_sensor_find(struct sensor *sensor, const struct capture *capture, int camera,
                            struct run *run, struct error *err)
{
    struct sensor_known known = {capture->black, capture->white, capture->gain, capture->read_noise,
                                 false};
    if (isnan(known.black) && capture->dark) {
        enum status status = dark_level(&known.black, capture, err);
        if (status)
            return status;
    }
    struct band *band = calloc((size_t)capture->shots, sizeof *band);
    struct bracket_sample *sample = calloc((size_t)capture->shots, sizeof *sample);
    int samples = 0, bands = 0;
    enum status status = STATUS_OK;
    if (!band || !sample)
        status = cap_fail(err, STATUS_MEMORY, "%s", capture->folder);
    else
        bands = read_bands(band, capture, camera, run);
    for (int k = 0; k < bands; k++) {
        const struct bracket *b = &band[k].bracket;
        if (!band[k].read)
            continue;
        known.encoded = b->encoded;
        sample[samples++] = (struct bracket_sample){
            b->frames, b->time, (const uint16_t *const *)b->dn, (size_t)b->rows * b->width};
    }
    if (!status && samples == 0)
        status = cap_fail(err, STATUS_DATA, "%s: no shot can be read to find the sensor's levels",
                          capture->folder);
    if (!status) {
        struct sensor made = {0};
        struct sensor_doubts doubts = {0};
        sensor_from_samples(&made, sample, samples, &known, &doubts);
        tell_doubts(&doubts, &known, run);
        *sensor = made;
    }
    for (int k = 0; k < bands; k++)
        bracket_close(&band[k].bracket);
    free(band);
    free(sample);
    return status;
}
