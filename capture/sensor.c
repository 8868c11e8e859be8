/* sensor.c -- what the merge has to know of a camera, learned from a sample of its photographs. */
#include "sensor.h"
#include "black.h"
#include "moved.h"
#include "photo.h"
#include "recover.h"
#include "sample.h"
#include "stack.h"
#include "times.h"

#include <stdlib.h>
#include <string.h>

static void find_levels(struct sensor *sensor, const struct sample_set *set,
                        const struct sensor_known *known, struct sensor_doubts *doubts)
{
    struct sensor_doubts each[3] = {{0}};
#pragma omp parallel for num_threads(3)
    for (int c = 0; c < 3; c++)
        sensor_find_levels(sensor, c, set->channel[c], set->samples, known, &each[c]);
    doubts->black = each[0].black || each[1].black || each[2].black;
}

static void find_noise(struct sensor *sensor, const struct sample_set *set,
                       const struct sensor_known *known, struct sensor_doubts *doubts)
{
    struct sensor_doubts each[3] = {{0}};
#pragma omp parallel for num_threads(3)
    for (int c = 0; c < 3; c++)
        sensor_find_noise(sensor, c, set->channel[c], set->samples, known, &each[c]);
    doubts->noise = each[0].noise || each[1].noise || each[2].noise;
}

void sensor_from_samples(struct sensor *sensor, struct bracket_sample *const sample[3], int samples,
                         const struct sensor_known *known, struct sensor_doubts *doubts)
{
    const struct sample_set set = {.channel = {sample[0], sample[1], sample[2]},
                                   .samples = samples};
    find_levels(sensor, &set, known, doubts);
    find_noise(sensor, &set, known, doubts);
}

static void tell_doubts(const struct sensor_doubts *doubts, const struct sensor_known *known,
                        struct run *run)
{
    if (doubts->black && isnan(known->black[0]) && !known->encoded && !known->real)
        cap_warn(run, "the photographs do not tell the black level (no bracket of exposure "
                      "times); it is taken to be 0: give `noise: {black: ...}`");
    if (doubts->noise)
        cap_warn(run, "the photographs do not tell the sensor's noise (no bracket of exposure "
                      "times); a usual one is assumed: give `noise: {gain: ..., read_noise: ...}`");
}

/* From capture.yaml, else the raw file; a black level of 0 there may as well be one that LibRaw
 * does not know. */
static struct sensor_known what_is_known(const struct capture *capture, const struct photo *photo)
{
    struct sensor_known known = {.white = capture->white,
                                 .gain = capture->gain,
                                 .read_noise = capture->read_noise,
                                 .nominal_white = photo->white,
                                 .encoded = photo->encoded,
                                 .real = photo->bits == 32};
    double stated = photo->black > 0 ? photo->black : NAN;
    for (int c = 0; c < 3; c++)
        known.black[c] = isnan(capture->black) ? stated : capture->black;
    return known;
}

/* The means of dark frames, where nothing better is known. */
static enum status know_dark(struct sensor_known *known, const struct capture *capture, int camera,
                             const struct curve *curve, struct error *err)
{
    struct stack dark = {0};
    if (!capture->dark || !isnan(known->black[0]))
        return STATUS_OK;
    enum status status = stack_read(&dark, capture, &capture->dark_frames, camera, curve, err);
    if (!status && dark.frames > 0)
        stack_levels(known->black, &dark);
    stack_free(&dark);
    return status;
}

static const struct photo *first_photo(const struct capture *capture, int camera)
{
    for (int s = 0; s < capture->shots; s++)
        if (capture->shot[s].camera == camera)
            return &capture->photo[capture->shot[s].photo[0]];
    return &capture->photo[0];
}

static void linearise(struct sample_set *set, const struct curve *response)
{
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < set->samples; k++) {
            struct bracket_sample *s = &set->channel[c][k];
            for (int f = 0; f < s->frames; f++)
                for (size_t i = 0; i < s->photosites; i++)
                    s->dn[f][i] = response->dn[c][(unsigned char)s->dn[f][i]];
        }
}

/* The curve of encoded photographs, as capture.yaml wants it. */
static enum status find_curve(struct learned *learned, const struct capture *capture,
                              const struct sample_set *set, struct run *run, struct error *err)
{
    if (capture->response == RESPONSE_FILE) {
        char *path = cap_path(capture->folder, capture->response_file);
        enum status status = path ? response_read(&learned->curve, path, err)
                                  : cap_fail(err, STATUS_MEMORY, "%s", capture->response_file);
        free(path);
        return status;
    }
    if (capture->response == RESPONSE_RECOVER) {
        learned->recovered = response_recover(&learned->curve, set);
        if (learned->recovered)
            return STATUS_OK;
        cap_warn(run, "no bracket of exposure times tells the photographs' response curve; it is "
                      "taken to be sRGB's: give `response: linear` or a file if it is not");
    }
    response_known(&learned->curve,
                   capture->response == RESPONSE_LINEAR ? RESPONSE_LINEAR : RESPONSE_SRGB);
    return STATUS_OK;
}

/* Levels and times depend on each other weakly: dark photosites tell one, bright ones the other.
 * stated [photos]: the files' times. true: seconds[] have changed. */
static bool find_times(struct sensor *sensor, double *seconds, const double *stated, int photos,
                       struct sample_set *set, double curve_sigma, const struct sensor_known *known,
                       struct sensor_doubts *doubts, int threads)
{
    enum { ROUNDS = 4 };
    bool changed = true, any = false;
    find_levels(sensor, set, known, doubts);
    for (int round = 0; round < ROUNDS && changed; round++) {
        changed = times_estimate(seconds, stated, photos, set, sensor, curve_sigma, threads);
        any = any || changed;
        if (changed)
            find_levels(sensor, set, known, doubts);
    }
    return any;
}

static void set_times(struct sample_set *set, const double *seconds)
{
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < set->samples; k++) {
            struct bracket_sample *s = &set->channel[c][k];
            for (int f = 0; f < s->frames; f++)
                s->time[f] = seconds[s->photo[f]];
        }
}

/* A curve that was recovered took the times for true, of which some per cent are wrong: times by
 * that curve, and the curve by those times, in turns. set holds codes, and linear values then. */
static enum status find_curve_and_times(struct learned *learned, double *seconds,
                                        const double *stated, int photos, struct sample_set *set,
                                        const struct sensor_known *known,
                                        struct sensor_doubts *doubts, struct run *run,
                                        struct error *err)
{
    enum { TURNS = 4 };
    for (int turn = 1;; turn++) {
        struct sample_set linear;
        const double *r = learned->curve.relative;
        if (!sample_copy(&linear, set))
            return cap_fail(err, STATUS_MEMORY, "a sample of %d photographs", photos);
        linearise(&linear, &learned->curve);
        bool changed = find_times(&learned->sensor, seconds, stated, photos, &linear,
                                  (r[0] + r[1] + r[2]) / 3, known, doubts, run->threads);
        if (!changed || turn == TURNS) {
            sample_free(set);
            *set = linear;
            return STATUS_OK;
        }
        sample_free(&linear);
        set_times(set, seconds);
        response_recover(&learned->curve, set);
    }
}

enum status sensor_learn(struct learned *learned, double *seconds, bool *left_out,
                         const struct capture *capture, int camera, struct run *run,
                         struct error *err)
{
    const struct photo *photo = first_photo(capture, camera);
    struct sensor_known known = what_is_known(capture, photo);
    struct sensor_doubts doubts = {0};
    struct learned made = {.encoded = photo->encoded};
    struct sample_set set = {0};
    const int photos = capture->photos;
    double *stated = malloc((size_t)photos * sizeof *stated);
    enum status status = stated ? sample_read(&set, capture, camera, seconds, run, err)
                                : cap_fail(err, STATUS_MEMORY, "%d photographs", photos);
    if (!status)
        memcpy(stated, seconds, (size_t)photos * sizeof *stated);
    if (!status && made.encoded)
        status = find_curve(&made, capture, &set, run, err);
    if (!status)
        status = know_dark(&known, capture, camera, &made.curve, err);
    if (!status && made.recovered) {
        status =
            find_curve_and_times(&made, seconds, stated, photos, &set, &known, &doubts, run, err);
    } else if (!status) {
        if (made.encoded)
            linearise(&set, &made.curve);
        find_times(&made.sensor, seconds, stated, photos, &set, 0, &known, &doubts, run->threads);
    }
    if (!status) {
        moved_find(left_out, capture, &set, &made.sensor, run);
        find_noise(&made.sensor, &set, &known, &doubts);
        sensor_refine_black(&made.sensor, set.channel, set.samples, &known, left_out);
        for (int c = 0; c < 3 && made.encoded; c++)
            made.sensor.relative[c] = made.curve.relative[c];
        tell_doubts(&doubts, &known, run);
        *learned = made;
    }
    sample_free(&set);
    free(stated);
    return status;
}

enum status cap_sensor_find(struct sensor *sensor, const struct capture *capture, int camera,
                            struct run *run, struct error *err)
{
    double *seconds = calloc((size_t)capture->photos, sizeof *seconds);
    bool *left_out = calloc((size_t)capture->photos, sizeof *left_out);
    struct learned learned;
    if (!seconds || !left_out) {
        free(seconds);
        free(left_out);
        return cap_fail(err, STATUS_MEMORY, "%s", capture->folder);
    }
    for (int i = 0; i < capture->photos; i++)
        seconds[i] = capture->photo[i].exposure_time;
    enum status status = sensor_learn(&learned, seconds, left_out, capture, camera, run, err);
    if (!status)
        *sensor = learned.sensor;
    free(left_out);
    free(seconds);
    return status;
}
