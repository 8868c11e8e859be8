/* frames.c -- what dark and flat frames tell of each photosite.
 *
 * Dark.    The mean of N frames shows each photosite's black with variance read^2 / N, and the
 *          photosites differ by a pattern of variance P (measured: what the mean's scatter has more
 *          than that). The best estimate of a photosite's black is then the level plus
 *          P / (P + read^2 / N) times its deviation (Wiener), with variance P read^2/N over their
 *          sum: one noisy frame of a quiet sensor changes nothing, many of a patterned one all.
 *          Photosites 8 standard deviations and a hundredth of the scale off are hot: no
 *          measurement.
 * Flat.    A smooth model of what the lens leaves (flat.c).
 */
#include "frames.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

static const double hot_sigmas = 8, hot_scale = 0.01;

/* Variance of dark photosites about their channel's level, hot ones left out in 3 rounds. */
static void measure_pattern(struct frames *frames, const struct sensor *sensor)
{
    const struct stack *dark = &frames->dark;
    size_t line = (size_t)dark->width * (size_t)dark->channels;
    double reach[3] = {INFINITY, INFINITY, INFINITY};
    stack_levels(frames->dark_level, dark);
    for (int round = 0; round < 3; round++) {
        double sum[3] = {0}, sum2[3] = {0}, count[3] = {0};
        for (int y = 0; y < dark->height; y++)
            for (size_t i = 0; i < line; i++) {
                int c = stack_channel(dark, i, y);
                double d = (double)dark->mean[(size_t)y * line + i] - frames->dark_level[c];
                if (fabs(d) > reach[c])
                    continue;
                sum[c] += d;
                sum2[c] += d * d;
                count[c]++;
            }
        for (int c = 0; c < 3; c++) {
            double mean = count[c] > 0 ? sum[c] / count[c] : 0;
            double variance = count[c] > 0 ? sum2[c] / count[c] - mean * mean : 0;
            frames->dark_level[c] += mean;
            frames->dark_noise2[c] = sensor->read_noise[c] * sensor->read_noise[c] / dark->frames;
            frames->pattern2[c] = fmax(variance - frames->dark_noise2[c], 0);
            reach[c] = 5 * sqrt(variance);
        }
    }
}

static enum status read_evenness(struct frames *frames, const struct capture *capture,
                                 struct sensor *sensor, const struct learned *learned,
                                 struct error *err)
{
    char *path = cap_path(capture->folder, capture->flat);
    enum status status = path ? evenness_read(&frames->evenness, path, sensor, &learned->curve, err)
                              : cap_fail(err, STATUS_MEMORY, "%s", capture->flat);
    for (int c = 0; c < 3 && !status; c++)
        sensor->relative[c] = hypot(sensor->relative[c], frames->evenness.relative[c]);
    free(path);
    return status;
}

enum status frames_make(struct frames *frames, const struct capture *capture,
                        struct learned *learned, int camera, struct error *err)
{
    struct frames made = {0};
    struct sensor *sensor = &learned->sensor;
    enum status status = STATUS_OK;
    if (capture->flat)
        status = flat_fit(&made.flat, capture, sensor, &learned->curve, camera, made.cfa, err);
    made.has_flat = capture->flat && !status;
    if (made.has_flat)
        status = read_evenness(&made, capture, sensor, learned, err);
    if (!status)
        status =
            stack_read(&made.dark, capture, &capture->dark_frames, camera, &learned->curve, err);
    if (!status && made.dark.frames > 0)
        measure_pattern(&made, sensor);
    if (status)
        frames_free(&made);
    else
        *frames = made;
    return status;
}

void frames_free(struct frames *frames)
{
    flat_free(&frames->flat);
    evenness_free(&frames->evenness);
    defects_free(&frames->defects);
    stack_free(&frames->dark);
    *frames = (struct frames){0};
}

size_t frames_room(int count)
{
    return 6 * (size_t)count;
}

static void apply_flat(const struct frames *frames, struct merge_row *row, int y, float *room)
{
    float *scale = room, *flat = room + row->count;  // of a mosaic, three channels a photosite
    flat_row(&frames->flat, y, flat);
    for (int x = 0; *frames->cfa && x < row->count; x++)
        flat[x] = flat[3 * x + cap_cfa_channel(frames->cfa, x, y)];
    row->scale = scale;
    merge_row_scale(row, flat);
}

static void apply_dark(const struct frames *frames, struct merge_row *row, int y, float *room)
{
    const struct stack *dark = &frames->dark;
    const float *mean = dark->mean + (size_t)y * row->count;
    float *black = room + 4 * (size_t)row->count, *read2 = room + 5 * (size_t)row->count;
    float share[3], more[3];
    for (int c = 0; c < 3; c++) {
        double sum = frames->pattern2[c] + frames->dark_noise2[c];
        share[c] = sum > 0 ? (float)(frames->pattern2[c] / sum) : 0;
        more[c] = share[c] * (float)frames->dark_noise2[c];
    }
    for (int i = 0; i < row->count; i++) {
        int c = stack_channel(dark, (size_t)i, y);
        black[i] = row->black[i] + share[c] * (mean[i] - (float)frames->dark_level[c]);
        read2[i] = row->read2[i] + more[c];
    }
    row->black = black;
    row->read2 = read2;
}

void frames_row(const struct frames *frames, struct merge_row *row, int y, float *room)
{
    if (frames->has_flat)
        apply_flat(frames, row, y, room);
    if (frames->dark.frames > 0) {
        assert(row->count == frames->dark.width * frames->dark.channels);
        apply_dark(frames, row, y, room);
    }
}

static void mark_hot(const struct frames *frames, const struct merge_row *row, int y,
                     float *variance)
{
    const struct stack *dark = &frames->dark;
    const float *mean = dark->mean + (size_t)y * row->count;
    for (int i = 0; i < row->count; i++) {
        int c = stack_channel(dark, (size_t)i, y);
        double sigma = sqrt(frames->pattern2[c] + frames->dark_noise2[c]);
        double off = fabs((double)mean[i] - frames->dark_level[c]);
        if (off > hot_sigmas * sigma && off * (double)row->full[i] > hot_scale)
            variance[i] = INFINITY;
    }
}

void frames_finish(const struct frames *frames, const struct merge_row *row, int y, float *variance)
{
    if (frames->dark.frames > 0)
        mark_hot(frames, row, y, variance);
    evenness_mark(&frames->evenness, y, row->count, variance);
    evenness_mark(&frames->defects.sites, y, row->count, variance);
}
