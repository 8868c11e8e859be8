/* lessons.c -- what a merge learns before it starts: levels and noise, dark and flat frames,
 * defects, room light.
 *
 * Where several processes share a job, each would decode the same photographs to learn the same.
 * The leader does it for all; what it found travels as it is in memory, arrays after what owns
 * them. Frames, which are few files and large in memory, are read by everyone.
 */
#include "lessons.h"
#include "recover.h"

#include <stdlib.h>
#include <string.h>

// ---- together

static void tell(struct run *run, void *data, size_t size)
{
    if (run->tell && size > 0)
        run->tell(run->team, data, size);
}

static void work_alone(struct run *run, bool begins)
{
    if (run->alone)
        run->alone(run, begins);
}

/* Does the leader go on? Those that had no trouble of their own fail as it did. */
static bool leader_goes_on(enum status *status, struct run *run, struct error *err)
{
    struct error story = {.status = *status};
    if (*status && err)
        memcpy(story.text, err->text, sizeof story.text);
    tell(run, &story, sizeof story);
    if (run->follows && !*status && story.status)
        *status = cap_fail(err, story.status, "%s", story.text);
    return story.status == STATUS_OK;
}

static void tell_defects(struct defects *defects, struct run *run)
{
    struct defects told = *defects;
    tell(run, &told, sizeof told);
    if (!run->follows) {
        tell(run, defects->sites.defect, told.sites.defects * sizeof *told.sites.defect);
        return;
    }
    size_t count = told.sites.defects;
    told.sites.defect = calloc(count + 1, sizeof *told.sites.defect);
    if (!told.sites.defect)
        abort();  // without room to hear it in, the team cannot go on
    tell(run, told.sites.defect, count * sizeof *told.sites.defect);
    defects_free(defects);
    *defects = told;
}

// ---- levels

/* OUT/response.txt, or response_CAMERA.txt: to be given as `response:` another time. */
static enum status save_curve(const struct learned *learned, const struct capture *capture,
                              int camera, const char *out, struct error *err)
{
    char *path = NULL;
    if (asprintf(&path, capture->cameras > 1 ? "%s/response_%s.txt" : "%s/response.txt", out,
                 capture->camera[camera].name)
        < 0)
        return cap_fail(err, STATUS_MEMORY, "%s", out);
    enum status status = response_write(&learned->curve, path, err);
    free(path);
    return status;
}

static enum status learn_sensors(struct lessons *lessons, bool *left_out,
                                 const struct capture *capture, const char *out, struct run *run,
                                 struct error *err)
{
    enum status status = STATUS_OK;
    work_alone(run, true);
    for (int k = 0; k < capture->cameras && !status; k++) {
        status =
            sensor_learn(&lessons->learned[k], lessons->seconds, left_out, capture, k, run, err);
        if (!status && lessons->learned[k].recovered)
            status = save_curve(&lessons->learned[k], capture, k, out, err);
    }
    work_alone(run, false);
    return status;
}

// ---- defects

/* Photosites by themselves. */
static enum status find_defects(struct lessons *lessons, const bool *left_out,
                                const struct capture *capture, struct run *run, struct error *err)
{
    enum status status = STATUS_OK;
    work_alone(run, true);
    for (int k = 0; k < capture->cameras && !status; k++) {
        struct defects *d = &lessons->frames[k].defects;
        status = defects_find(d, capture, k, &lessons->learned[k].sensor, left_out, run, err);
        if (status || d->sites.defects == 0)
            continue;
        run->hot += d->hot;
        run->dead += d->dead;
        cap_tell(run, "%s: %d hot and %d dead photosites, found in %d views, are not used",
                 capture->camera[k].name, d->hot, d->dead, d->views);
    }
    work_alone(run, false);
    return status;
}

/* How unequal photosites are, a flat frame tells better. */
static void use_unequal(struct sensor *sensor, const struct frames *frames)
{
    for (int c = 0; c < 3 && !frames->has_flat; c++)
        sensor->relative[c] = hypot(sensor->relative[c], frames->defects.sites.relative[c]);
}

// ---- all

static enum status make_room(struct lessons *lessons, const struct capture *capture,
                             struct error *err)
{
    size_t cameras = (size_t)capture->cameras;
    lessons->learned = calloc(cameras, sizeof *lessons->learned);
    lessons->frames = calloc(cameras, sizeof *lessons->frames);
    lessons->seconds = calloc((size_t)capture->photos, sizeof *lessons->seconds);
    if (!lessons->learned || !lessons->frames || !lessons->seconds)
        return cap_fail(err, STATUS_MEMORY, "%s", capture->folder);
    for (int i = 0; i < capture->photos; i++)
        lessons->seconds[i] = capture->photo[i].exposure_time;
    return STATUS_OK;
}

enum status lessons_learn(struct lessons *lessons, bool *left_out, const struct capture *capture,
                          const char *out, enum status failed, struct run *run, struct error *err)
{
    const int cameras = capture->cameras;
    enum status status = failed;
    cap_stage(run, "levels", cameras);
    enum status room = make_room(lessons, capture, status ? NULL : err);
    if ((room || !left_out) && run->tell)
        abort();  // without room to hear it in, the team cannot go on
    status = status ? status : room;
    if (!status && !run->follows)
        status = learn_sensors(lessons, left_out, capture, out, run, err);
    if (!leader_goes_on(&status, run, err))
        return status;
    tell(run, lessons->learned, (size_t)cameras * sizeof *lessons->learned);
    tell(run, lessons->seconds, (size_t)capture->photos * sizeof *lessons->seconds);
    tell(run, left_out, (size_t)capture->photos * sizeof *left_out);
    for (int k = 0; k < cameras && !status; k++)
        status = frames_make(&lessons->frames[k], capture, &lessons->learned[k], k, err);
    if (!status && !run->follows)
        status = find_defects(lessons, left_out, capture, run, err);
    if (!leader_goes_on(&status, run, err))
        return status;
    for (int k = 0; k < cameras; k++) {
        tell_defects(&lessons->frames[k].defects, run);
        use_unequal(&lessons->learned[k].sensor, &lessons->frames[k]);
    }
    return status
               ? status
               : ambients_find(&lessons->ambients, capture, lessons->learned, left_out, run, err);
}

void lessons_free(struct lessons *lessons, int cameras)
{
    for (int k = 0; lessons->frames && k < cameras; k++)
        frames_free(&lessons->frames[k]);
    ambients_free(lessons->ambients);
    free(lessons->frames);
    free(lessons->learned);
    free(lessons->seconds);
    *lessons = (struct lessons){0};
}
