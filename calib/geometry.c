/* geometry.c -- cameras and poses: detect tags, start, adjust, fit the tags' patterns through the
 * lens that was found, adjust again. */
#include "geometry.h"

#include "pattern.h"
#include "sightings.h"
#include "start.h"

#include <stdlib.h>
#include <string.h>

// Three views are the least that fix a camera's focal length, centre and distortion.
enum { VIEWS_MIN = 3 };

// Four corners of one small tag leave a mirrored pose possible: two are wanted where there are two.
static int tags_enough(const struct capture *capture)
{
    return capture->tags < 2 ? 1 : 2;
}

static enum status check_board(const struct capture *capture, struct error *err)
{
    if (!capture->family || capture->tags == 0)
        return cap_fail(err, STATUS_DATA,
                        "%s: capture.yaml names no board: without tags there are no poses (add "
                        "`board`, or use --calibration FILE)",
                        capture->folder);
    struct tag_family family = {0};
    struct tag_pattern pattern;
    enum status status = pattern_open(&family, capture->family, err);
    for (int i = 0; !status && i < capture->tags; i++)
        status = pattern_of(&pattern, &family, capture->tag[i].id, err);
    pattern_close(&family);
    if (status)
        cap_fail_within(err, "%s/capture.yaml: board", capture->folder);
    return status;
}

// ---- from shots to views

static int count_of(const struct sightings *list, int view)
{
    int n = 0;
    for (int i = 0; i < list->count; i++)
        n += list->sighting[i].view == view && !list->sighting[i].rejected;
    return n;
}

// Which shots become views: [shots], by the number of tags and then by that of their camera.
static void choose_shots(bool *chosen, const struct sightings *list, const struct capture *capture,
                         const bool *usable, struct run *run)
{
    for (int i = 0; i < capture->shots; i++) {
        int n = count_of(list, i);
        chosen[i] = n >= tags_enough(capture);
        if (chosen[i] || (usable && !usable[i]))
            continue;
        if (n == 0)
            cap_warn(run, "%s: no tag of family %s found: left out", capture->shot[i].name,
                     capture->family);
        else
            cap_warn(run, "%s: only %d tag found, %d are needed: left out", capture->shot[i].name,
                     n, tags_enough(capture));
    }
    for (int k = 0; capture->cameras > 1 && k < capture->cameras; k++) {
        int shots = 0;
        for (int i = 0; i < capture->shots; i++)
            shots += chosen[i] && capture->shot[i].camera == k;
        for (int i = 0; i < capture->shots && shots < VIEWS_MIN; i++)
            if (chosen[i] && capture->shot[i].camera == k) {
                chosen[i] = false;
                cap_warn(run, "%s: camera %s has fewer than %d usable shots: left out",
                         capture->shot[i].name, capture->camera[k].name, VIEWS_MIN);
            }
    }
}

static enum status check_enough(const bool *chosen, const struct sightings *list,
                                const struct capture *capture, struct error *err)
{
    int views = 0;
    for (int i = 0; i < capture->shots; i++)
        views += chosen[i];
    if (views >= VIEWS_MIN)
        return STATUS_OK;
    if (list->count == 0)
        return cap_fail(err, STATUS_DATA,
                        "%s: none of the board's tags (family %s) found in any of %d shots: check "
                        "`board: family` and the ids in capture.yaml, and focus and light",
                        capture->folder, capture->family, capture->shots);
    return cap_fail(err, STATUS_DATA, "%s: %d of %d shots are usable, at least %d are needed",
                    capture->folder, views, capture->shots, VIEWS_MIN);
}

static char *copy_text(const char *text)
{
    return text ? strdup(text) : NULL;
}

// Cameras that have views, and the views; sightings of chosen shots, renumbered.
static enum status make_views(struct calibration *c, struct sightings *list, const bool *chosen,
                              const struct capture *capture, struct error *err)
{
    c->camera = calloc((size_t)capture->cameras + 1, sizeof *c->camera);
    c->view = calloc((size_t)capture->shots + 1, sizeof *c->view);
    int *camera_of = calloc((size_t)capture->cameras + 1, sizeof *camera_of), kept = 0;
    bool complete = c->camera && c->view && camera_of;
    for (int k = 0; complete && k < capture->cameras; k++) {
        const struct camera_kind *kind = capture->camera + k;
        bool used = false;
        for (int i = 0; i < capture->shots; i++)
            used = used || (chosen[i] && capture->shot[i].camera == k);
        if (!used)
            continue;
        camera_of[k] = c->cameras;
        struct camera *camera = c->camera + c->cameras++;
        camera->width = kind->width;
        camera->height = kind->height;
        complete = (camera->name = copy_text(kind->name)) != NULL;
    }
    for (int i = 0; complete && i < capture->shots; i++) {
        const struct shot *shot = capture->shot + i;
        if (!chosen[i])
            continue;
        struct view *view = c->view + c->views;
        complete = (view->name = copy_text(shot->name)) != NULL;
        view->camera = camera_of[shot->camera];
        view->light = shot->light;
        view->power = 1;
        for (int k = 0; k < list->count; k++)  // kept <= k: sightings are in order of shots
            if (list->sighting[k].view == i) {
                list->sighting[kept] = list->sighting[k];
                list->sighting[kept++].view = c->views;
            }
        c->views++;
    }
    list->count = kept;
    free(camera_of);
    return complete ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%d views", capture->shots);
}

// ---- adjustment

static enum status adjust(struct calibration *c, const struct capture *capture,
                          struct sightings *list, enum bundle_stage stage, struct error *err)
{
    struct bundle bundle = {c, capture, list->sighting, list->count};
    return bundle_adjust(&bundle, stage, err);
}

static enum status first_calibration(struct calibration *c, const struct capture *capture,
                                     struct sightings *list, struct error *err)
{
    struct bundle bundle = {c, capture, list->sighting, list->count};
    enum status status = start_cameras(&bundle, err);
    if (!status)
        status = bundle_adjust(&bundle, BUNDLE_FOCAL, err);
    if (!status)
        status = start_poses_again(&bundle, err);
    if (!status)
        status = bundle_adjust(&bundle, BUNDLE_LENS, err);
    return status;
}

// A tag rejected in most of its views is not where capture.yaml says: name it, and drop it. (One
// or two views may have it partly covered.)
static bool drop_misplaced(struct sightings *list, const struct capture *capture, struct run *run)
{
    bool dropped = false;
    for (int place = 0; place < capture->tags; place++) {
        int seen = 0, rejected = 0, kept = 0;
        for (int i = 0; i < list->count; i++)
            if (list->sighting[i].place == place) {
                seen++;
                rejected += list->sighting[i].rejected;
            }
        if (rejected < 3 || 2 * rejected <= seen)
            continue;
        cap_warn(run, "tag %d is not where capture.yaml says (in %d of %d photographs): not used",
                 capture->tag[place].id, rejected, seen);
        dropped = true;
        for (int i = 0; i < list->count; i++)
            if (list->sighting[i].place != place)
                list->sighting[kept++] = list->sighting[i];
        list->count = kept;
    }
    return dropped;
}

static enum status final_calibration(struct calibration *c, const struct capture *capture,
                                     struct sightings *list, struct run *run, struct error *err)
{
    enum status status = adjust(c, capture, list, BUNDLE_CHOOSE, err);
    if (!status && drop_misplaced(list, capture, run))
        status = adjust(c, capture, list, BUNDLE_CHOOSE, err);
    for (int i = 0; !status && i < c->cameras; i++) {
        const struct camera *camera = c->camera + i;
        double relative = camera->sigma_focal[0] / camera->focal[0];
        if (relative > 0.005)
            cap_warn(run,
                     "camera %s: the focal length is uncertain by %.1f %%: take photographs that "
                     "see the board at a slant, from several sides",
                     camera->name, 100 * relative);
    }
    return status;
}

// ---- the result

static enum status take_tags(struct calibration *c, const struct capture *capture,
                             const struct sightings *list, struct error *err)
{
    for (int v = 0; v < c->views; v++) {
        struct view *view = c->view + v;
        view->tag = calloc((size_t)count_of(list, v) + 1, sizeof *view->tag);
        if (!view->tag)
            return cap_fail(err, STATUS_MEMORY, "%s: tags", view->name);
        for (int i = 0; i < list->count; i++) {
            const struct sighting *s = list->sighting + i;
            if (s->view != v || s->rejected)
                continue;
            struct seen_tag *tag = view->tag + view->tags++;
            tag->id = capture->tag[s->place].id;
            memcpy(tag->corner, s->corner, sizeof tag->corner);
        }
    }
    return STATUS_OK;
}

enum status cal_geometry(struct calibration *c, const struct capture *capture, const char *out,
                         const bool *usable, struct run *run, struct error *err)
{
    struct calibration made = {0};
    struct sightings list = {0};
    bool *chosen = calloc((size_t)capture->shots + 1, sizeof *chosen);
    enum status status = chosen ? check_board(capture, err)
                                : cap_fail(err, STATUS_MEMORY, "%d shots", capture->shots);
    if (!status)
        status = sightings_detect(&list, capture, out, usable, run, err);
    if (!status) {
        choose_shots(chosen, &list, capture, usable, run);
        status = check_enough(chosen, &list, capture, err);
    }
    if (!status)
        status = make_views(&made, &list, chosen, capture, err);
    if (!status)
        status = first_calibration(&made, capture, &list, err);
    if (!status)
        status = sightings_refine(&list, tags_enough(capture), &made, capture, out, run, err);
    if (!status)
        status = final_calibration(&made, capture, &list, run, err);
    if (!status)
        status = take_tags(&made, capture, &list, err);
    if (!status) {
        c->camera = made.camera;
        c->view = made.view;
        c->cameras = made.cameras;
        c->views = made.views;
        made = (struct calibration){0};
    }
    cal_calibration_free(&made);
    free(list.sighting);
    free(chosen);
    return status;
}
