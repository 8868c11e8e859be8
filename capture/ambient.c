/* ambient.c -- photographs without the lamp: which belong to which shot, and taking them off.
 *
 * Which. A frame belongs to every shot whose view it shows (thumbnail.c), together with those that
 *        show it as well as the best does; so one frame serves all shots of a camera that stands
 *        still, and each viewpoint has its own where it moves. A frame in which nothing is to be
 *        seen, taken in a dark room, fits any view: shots that no other shows take all of these.
 * Off.   The mean of the frames, as a rate, is taken off with its own noise.
 * Memory. Of one light for each shot at work, and of the last one, which the next shot may share.
 */
#include "ambient.h"
#include "thumbnail.h"

#include <omp.h>
#include <stdlib.h>
#include <string.h>

static const double AS_GOOD = 0.9;  // of the best likeness: frames of the same view, other noise

// ---- the light of a view

enum status ambient_light_read(struct ambient_light *light, const struct capture *capture,
                               const struct frame_names *names, int camera,
                               const struct learned *learned, struct error *err)
{
    struct ambient_light made = {0};
    const struct sensor *sensor = &learned->sensor;
    enum status status = stack_read(&made.stack, capture, names, camera, &learned->curve, err);
    if (!status && made.stack.frames > 0 && !(made.stack.seconds > 0)) {
        ambient_light_free(&made);
        status = cap_fail(err, STATUS_DATA,
                          "%s/%s: an ambient frame without exposure time in its EXIF data",
                          capture->folder, names->name[0]);
    }
    for (int c = 0; c < 3 && !status && made.stack.frames > 0; c++) {
        made.noise2[c] = sensor->read_noise[c] * sensor->read_noise[c] / made.stack.frames;
        made.slope[c] = 1 / (sensor->gain[c] * made.stack.frames);
    }
    if (!status)
        *light = made;
    return status;
}

void ambient_light_free(struct ambient_light *light)
{
    stack_free(&light->stack);
    *light = (struct ambient_light){0};
}

void ambient_take(const struct ambient_light *light, const struct merge_row *row, int y,
                  float *value, float *variance)
{
    const struct stack *stack = &light->stack;
    const float *mean = stack->mean + (size_t)y * (size_t)row->count;
    float per_second = (float)(stack->frames / stack->seconds);
    for (int i = 0; i < row->count; i++) {
        int c = stack_channel(stack, (size_t)i, y);
        float d = mean[i] - row->black[i], scale = row->scale[i] * per_second;
        float noise = (float)light->noise2[c] + (float)light->slope[c] * (d > 0 ? d : 0);
        bool known = mean[i] < row->usable[i];
        value[i] -= known ? scale * d : 0;
        variance[i] = known ? variance[i] + scale * scale * noise : INFINITY;
    }
}

// ---- which frames

/* Shots with the same frames have one view. */
struct view {
    struct frame_names frames;  // names are the capture's
    int camera, users;
    struct ambient_light light;
    omp_lock_t lock;  // of users and light
};

struct ambients {
    const struct capture *capture;
    const struct learned *learned;
    int *view_of;       // [shots]
    double *likeness;   // [shots] of the best frame
    struct view *view;  // [views], at most a shot
    int views;
    struct view *last;  // the light that was last done with
};

/* The photograph of a middling exposure. -1: none is left. */
static int middle_photo(const struct capture *capture, const struct shot *shot,
                        const bool *left_out)
{
    for (int k = 0; k < shot->photos; k++) {
        double time = capture->photo[shot->photo[k]].exposure_time;
        int shorter = 0, longer = 0;
        for (int j = 0; j < shot->photos; j++) {
            const double other = capture->photo[shot->photo[j]].exposure_time;
            shorter += !left_out[shot->photo[j]] && other < time;
            longer += !left_out[shot->photo[j]] && other > time;
        }
        if (!left_out[shot->photo[k]] && abs(shorter - longer) <= 1)
            return shot->photo[k];
    }
    return -1;
}

static enum status look_at(struct thumbnail *thumbnail, const char *name,
                           const struct ambients *all, int camera, struct error *err)
{
    const struct capture *capture = all->capture;
    char *path = cap_path(capture->folder, name);
    enum status status =
        path ? thumbnail_read(thumbnail, path, &capture->camera[camera], &all->learned[camera], err)
             : cap_fail(err, STATUS_MEMORY, "%s", name);
    free(path);
    return status;
}

/* Frames of a camera, small; what has no exposure time cannot be taken off. */
static enum status look_at_frames(struct thumbnail *frame, const struct ambients *all, int camera,
                                  struct run *run, struct error *err)
{
    const struct frame_names *names = &all->capture->ambient_frames;
    enum status status = STATUS_OK;
    int failed = names->count;
#pragma omp parallel for schedule(dynamic) num_threads(run->threads)
    for (int k = 0; k < names->count; k++) {
        struct error own = {0};
        enum status one = look_at(&frame[k], names->name[k], all, camera, &own);
        if (!one && frame[k].across && !(frame[k].seconds > 0))
            one = cap_fail(&own, STATUS_DATA,
                           "%s/%s: an ambient frame without exposure time in its EXIF data",
                           all->capture->folder, names->name[k]);
#pragma omp critical(ambient_failed)
        if (one && k < failed) {
            failed = k;
            status = cap_fail(err, one, "%s", own.text);
        }
    }
    return status;
}

/* The frames of a shot: which[frames]; returns how alike the best is. */
static double choose(bool *which, const struct thumbnail *shot, const struct thumbnail *frame,
                     int frames)
{
    double best = 0;
    for (int k = 0; k < frames; k++)
        best = fmax(best, thumbnail_likeness(shot, &frame[k]));
    for (int k = 0; k < frames; k++)
        which[k] = best > 0 ? thumbnail_likeness(shot, &frame[k]) >= AS_GOOD * best
                            : frame[k].across && frame[k].blank;
    return best;
}

/* Choose for the shots of a camera: which[shots][frames]. */
static enum status choose_all(bool *which, const struct ambients *all, int camera,
                              const bool *left_out, struct run *run, struct error *err)
{
    const struct capture *capture = all->capture;
    const int frames = capture->ambient_frames.count;
    struct thumbnail *frame = calloc((size_t)frames, sizeof *frame);
    enum status status = frame ? look_at_frames(frame, all, camera, run, err)
                               : cap_fail(err, STATUS_MEMORY, "%s", capture->folder);
#pragma omp parallel for schedule(dynamic) num_threads(run->threads)
    for (int s = 0; s < (status ? 0 : capture->shots); s++) {
        struct thumbnail shot = {0};
        int photo = capture->shot[s].camera == camera
                        ? middle_photo(capture, &capture->shot[s], left_out)
                        : -1;
        // One that cannot be read is told of when it is merged.
        if (photo >= 0 && !look_at(&shot, capture->photo[photo].name, all, camera, NULL))
            all->likeness[s] = choose(which + (size_t)s * (size_t)frames, &shot, frame, frames);
        thumbnail_free(&shot);
    }
    for (int k = 0; frame && k < frames; k++)
        thumbnail_free(&frame[k]);
    free(frame);
    return status;
}

/* Same frames, same camera: same view. */
static enum status make_view(struct ambients *all, const bool *which, int shot, struct error *err)
{
    const struct frame_names *names = &all->capture->ambient_frames;
    struct view *view = &all->view[all->views];
    view->frames = (struct frame_names){calloc((size_t)names->count, sizeof(char *)), 0};
    if (!view->frames.name)
        return cap_fail(err, STATUS_MEMORY, "%s", all->capture->folder);
    view->camera = all->capture->shot[shot].camera;
    for (int k = 0; k < names->count; k++)
        if (which[k])
            view->frames.name[view->frames.count++] = names->name[k];
    omp_init_lock(&view->lock);
    all->view_of[shot] = all->views++;
    return STATUS_OK;
}

static enum status make_views(struct ambients *all, const bool *which, struct error *err)
{
    const size_t frames = (size_t)all->capture->ambient_frames.count;
    const struct shot *shot = all->capture->shot;
    enum status status = STATUS_OK;
    for (int s = 0; s < all->capture->shots && !status; s++) {
        int same = 0;
        while (same < s
               && (shot[same].camera != shot[s].camera
                   || memcmp(which + (size_t)same * frames, which + (size_t)s * frames,
                             frames * sizeof *which)
                          != 0))
            same++;
        if (same < s)
            all->view_of[s] = all->view_of[same];
        else
            status = make_view(all, which + (size_t)s * frames, s, err);
    }
    return status;
}

/* One warning for all shots that no frame shows. */
static void warn_of_bare(const struct ambients *all, struct run *run)
{
    char names[160] = "";
    int bare = 0;
    size_t used = 0;
    for (int s = 0; s < all->capture->shots; s++) {
        if (ambients_of(all, s).count > 0)
            continue;
        const char *name = all->capture->shot[s].name;
        if (used + strlen(name) + 8 < sizeof names)
            used +=
                (size_t)snprintf(names + used, sizeof names - used, "%s%s", bare ? ", " : "", name);
        else if (used > 0 && names[used - 1] != '.')
            used += (size_t)snprintf(names + used, sizeof names - used, ", ...");
        bare++;
    }
    if (bare > 0)
        cap_warn(
            run,
            "no ambient frame shows the view of %d of %d shots (%s): room light stays in them; "
            "take a photograph with the lamp off at each viewpoint, and name it under "
            "`ambient`",
            bare, all->capture->shots, names);
}

enum status ambients_find(struct ambients **ambients, const struct capture *capture,
                          const struct learned *learned, const bool *left_out, struct run *run,
                          struct error *err)
{
    *ambients = NULL;
    if (capture->ambient_frames.count == 0)
        return STATUS_OK;
    size_t shots = (size_t)capture->shots;
    struct ambients *all = calloc(1, sizeof *all);
    bool *which = calloc(shots * (size_t)capture->ambient_frames.count, sizeof *which);
    enum status status = STATUS_OK;
    if (all) {
        *all = (struct ambients){.capture = capture, .learned = learned};
        all->view_of = calloc(shots, sizeof *all->view_of);
        all->likeness = calloc(shots, sizeof *all->likeness);
        all->view = calloc(shots, sizeof *all->view);
    }
    if (!which || !all || !all->view_of || !all->likeness || !all->view)
        status = cap_fail(err, STATUS_MEMORY, "%s", capture->folder);
    for (int k = 0; k < capture->cameras && !status; k++)
        status = choose_all(which, all, k, left_out, run, err);
    if (!status)
        status = make_views(all, which, err);
    free(which);
    if (status) {
        ambients_free(all);
        return status;
    }
    warn_of_bare(all, run);
    *ambients = all;
    return STATUS_OK;
}

void ambients_free(struct ambients *ambients)
{
    if (!ambients)
        return;
    for (int k = 0; k < ambients->views; k++) {
        ambient_light_free(&ambients->view[k].light);
        omp_destroy_lock(&ambients->view[k].lock);
        free(ambients->view[k].frames.name);
    }
    free(ambients->view);
    free(ambients->view_of);
    free(ambients->likeness);
    free(ambients);
}

// ---- the light of a shot

struct frame_names ambients_of(const struct ambients *ambients, int shot)
{
    return ambients ? ambients->view[ambients->view_of[shot]].frames : (struct frame_names){0};
}

double ambients_likeness(const struct ambients *ambients, int shot)
{
    return ambients ? ambients->likeness[shot] : 0;
}

enum status ambients_begin(struct ambients *ambients, int shot, struct error *err)
{
    if (ambients_of(ambients, shot).count == 0)
        return STATUS_OK;
    struct view *view = &ambients->view[ambients->view_of[shot]];
    enum status status = STATUS_OK;
    omp_set_lock(&view->lock);
    if (view->light.stack.frames == 0)
        status = ambient_light_read(&view->light, ambients->capture, &view->frames, view->camera,
                                    &ambients->learned[view->camera], err);
    view->users += !status;
    omp_unset_lock(&view->lock);
    return status;
}

void ambients_done(struct ambients *ambients, int shot)
{
    if (ambients_of(ambients, shot).count == 0)
        return;
    struct view *view = &ambients->view[ambients->view_of[shot]], *before;
    omp_set_lock(&view->lock);
    bool idle = --view->users == 0;
    omp_unset_lock(&view->lock);
    if (!idle)
        return;
#pragma omp critical(ambient_last)
    {
        before = ambients->last;
        ambients->last = view;
    }
    if (!before || before == view)
        return;
    omp_set_lock(&before->lock);
    if (before->users == 0)
        ambient_light_free(&before->light);
    omp_unset_lock(&before->lock);
}

const struct ambient_light *ambients_light(const struct ambients *ambients, int shot)
{
    if (ambients_of(ambients, shot).count == 0)
        return NULL;
    const struct ambient_light *light = &ambients->view[ambients->view_of[shot]].light;
    return light->stack.frames > 0 ? light : NULL;
}
