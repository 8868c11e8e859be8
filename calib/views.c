/* views.c -- which shots become views, and of which cameras. */
#include "views.h"

#include <stdlib.h>
#include <string.h>

// Four corners of one small tag leave a mirrored pose possible: two are wanted where there are two.
int views_tags_enough(const struct capture *capture)
{
    return capture->tags < 2 ? 1 : 2;
}

// Of a camera whose intrinsics are held, one view will do.
static int least_of(const struct capture *capture, int kind)
{
    int given = capture->camera[kind].given;
    bool held = given >= 0 && given < capture->givens && capture->given[given].file
                && !capture->given[given].prior;
    return held ? 1 : VIEWS_MIN;
}

int sightings_of(const struct sightings *list, int view)
{
    int n = 0;
    for (int i = 0; i < list->count; i++)
        n += list->sighting[i].view == view && !list->sighting[i].rejected;
    return n;
}

void views_choose(bool *chosen, const struct sightings *list, const struct capture *capture,
                  const bool *usable, struct run *run)
{
    for (int i = 0; i < capture->shots; i++) {
        int n = sightings_of(list, i);
        chosen[i] = n >= views_tags_enough(capture);
        if (chosen[i] || (usable && !usable[i]))
            continue;
        if (n == 0)
            cap_warn(run, "%s: no tag of family %s found: left out", capture->shot[i].name,
                     capture->family);
        else
            cap_warn(run, "%s: only %d tag found, %d are needed: left out", capture->shot[i].name,
                     n, views_tags_enough(capture));
    }
    for (int k = 0; capture->cameras > 1 && k < capture->cameras; k++) {
        int shots = 0;
        for (int i = 0; i < capture->shots; i++)
            shots += chosen[i] && capture->shot[i].camera == k;
        for (int i = 0; i < capture->shots && shots < least_of(capture, k); i++)
            if (chosen[i] && capture->shot[i].camera == k) {
                chosen[i] = false;
                cap_warn(run, "%s: camera %s has fewer than %d usable shots: left out",
                         capture->shot[i].name, capture->camera[k].name, VIEWS_MIN);
            }
    }
}

enum status views_enough(const bool *chosen, const struct sightings *list,
                         const struct capture *capture, struct error *err)
{
    int views = 0;
    for (int i = 0; i < capture->shots; i++)
        views += chosen[i];
    int least = VIEWS_MIN;
    for (int i = 0; i < capture->shots; i++)
        if (chosen[i] && least_of(capture, capture->shot[i].camera) < least)
            least = least_of(capture, capture->shot[i].camera);
    if (views >= least)
        return STATUS_OK;
    if (list->count == 0)
        return cap_fail(err, STATUS_DATA,
                        "%s: none of the board's tags (family %s) found in any of %d shots: check "
                        "`board: family` and the ids in capture.yaml, and focus and light",
                        capture->folder, capture->family, capture->shots);
    return cap_fail(err, STATUS_DATA, "%s: %d of %d shots are usable, at least %d are needed",
                    capture->folder, views, capture->shots, least);
}

static char *copy_text(const char *text)
{
    return text ? strdup(text) : NULL;
}

enum status views_make(struct calibration *c, struct sightings *list, int *kind, const bool *chosen,
                       const struct capture *capture, struct error *err)
{
    c->camera = calloc((size_t)capture->cameras + 1, sizeof *c->camera);
    c->view = calloc((size_t)capture->shots + 1, sizeof *c->view);
    int *camera_of = calloc((size_t)capture->cameras + 1, sizeof *camera_of), kept = 0;
    bool complete = c->camera && c->view && camera_of;
    for (int k = 0; complete && k < capture->cameras; k++) {
        bool used = false;
        for (int i = 0; i < capture->shots; i++)
            used = used || (chosen[i] && capture->shot[i].camera == k);
        if (!used)
            continue;
        camera_of[k] = c->cameras;
        kind[c->cameras] = k;
        struct camera *camera = c->camera + c->cameras++;
        camera->width = capture->camera[k].width;
        camera->height = capture->camera[k].height;
        complete = (camera->name = copy_text(capture->camera[k].name)) != NULL;
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

void views_drop(struct calibration *c, struct sightings *list, const bool *kept)
{
    int views = 0, sightings = 0;
    for (int v = 0; v < c->views; v++) {
        if (!kept[v]) {
            free(c->view[v].name);
            free(c->view[v].tag);
            continue;
        }
        for (int i = sightings; i < list->count; i++)
            if (list->sighting[i].view == v) {
                struct sighting moved = list->sighting[i];
                list->sighting[i] = list->sighting[sightings];
                list->sighting[sightings] = moved;
                list->sighting[sightings++].view = views;
            }
        c->view[views++] = c->view[v];
    }
    c->views = views;
    list->count = sightings;
}
