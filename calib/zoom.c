/* zoom.c -- a lens that was zoomed or focused anew between photographs, and EXIF does not tell.
 *
 * Method.   A lens changes at a moment: in the order of their names, photographs before it are one
 *           camera's, those after it another's. Moments are tried, each with two lenses fitted from
 *           nothing; the best is taken where it leaves much less of the residuals and the two focal
 *           lengths clearly differ, and then both parts are looked at again. Only a camera whose
 *           tags are far off as it is comes into question, so that a good calibration is never
 * taken apart and costs no time.
 */
#include "zoom.h"

#include "start.h"
#include "views.h"

#include <stdlib.h>
#include <string.h>

// Moments tried at first, evenly spread; then those beside the best one.
enum { MOMENTS = 12 };
// What has to be left at most of the rms; and the least that focal lengths differ by.
static const double left_part = 0.5, focal_part = 0.003, suspicious_px = 0.15;

// One camera's views in order, and a copy of its part of the bundle with a second camera.
struct trial {
    struct bundle bundle;
    struct calibration calibration;
    struct camera camera[2];
    int *order;  // [views] indices into calibration.view
};

static void trial_free(struct trial *t)
{
    free(t->calibration.view);
    free(t->bundle.sighting);
    free(t->order);
}

// Views are compared by name; qsort has no context, so their names are put beside their indices.
struct named {
    const char *name;
    int view;
};

static int by_name(const void *a, const void *b)
{
    return strverscmp(((const struct named *)a)->name, ((const struct named *)b)->name);
}

static bool sort_views(struct trial *t)
{
    int n = t->calibration.views;
    struct named *named = calloc((size_t)n + 1, sizeof *named);
    for (int v = 0; named && v < n; v++)
        named[v] = (struct named){t->calibration.view[v].name, v};
    if (named)
        qsort(named, (size_t)n, sizeof *named, by_name);
    for (int v = 0; named && v < n; v++)
        t->order[v] = named[v].view;
    free(named);
    return named != NULL;
}

static enum status trial_make(struct trial *t, const struct bundle *b, int camera,
                              struct error *err)
{
    const struct calibration *c = b->calibration;
    *t = (struct trial){.bundle = {.capture = b->capture}};
    t->camera[0] = t->camera[1] = c->camera[camera];
    t->calibration.view = calloc((size_t)c->views + 1, sizeof *t->calibration.view);
    t->bundle.sighting = calloc((size_t)b->sightings + 1, sizeof *t->bundle.sighting);
    t->order = calloc((size_t)c->views + 1, sizeof *t->order);
    bool made = t->calibration.view && t->bundle.sighting && t->order;
    for (int v = 0; made && v < c->views; v++) {
        if (c->view[v].camera != camera)
            continue;
        for (int i = 0; i < b->sightings; i++)
            if (b->sighting[i].view == v) {
                struct sighting *s = t->bundle.sighting + t->bundle.sightings++;
                *s = b->sighting[i];
                s->view = t->calibration.views;
                s->rejected = false;
            }
        t->calibration.view[t->calibration.views++] = c->view[v];
    }
    if (!made || !sort_views(t)) {
        trial_free(t);
        return cap_fail(err, STATUS_MEMORY, "%d views", c->views);
    }
    t->calibration.camera = t->camera;
    t->calibration.cameras = 2;
    return STATUS_OK;
}

// Root mean square over all views where the first `moment` ones are one camera's, the others the
// second's; infinite where there is no fit.
static double rms_at(struct trial *t, int moment)
{
    t->bundle.calibration = &t->calibration;
    for (int i = 0; i < t->calibration.views; i++)
        t->calibration.view[t->order[i]].camera = i >= moment;
    for (int i = 0; i < t->bundle.sightings; i++)
        t->bundle.sighting[i].rejected = false;
    struct bundle *b = &t->bundle;
    if (start_cameras(b, NULL) || bundle_adjust(b, BUNDLE_FOCAL, NULL)
        || bundle_adjust(b, BUNDLE_CHOOSE, NULL))
        return INFINITY;
    for (int i = 0; i < b->sightings; i++)
        b->sighting[i].rejected = false;  // what does not fit counts
    double before = bundle_rms(b, -1, 0), after = bundle_rms(b, -1, 1);
    double share = (double)moment / t->calibration.views;
    return sqrt(share * before * before + (1 - share) * after * after);
}

// The moment that leaves the least, tried every so many views and then beside the best.
static int best_moment(struct trial *t, double *least)
{
    int n = t->calibration.views, last = n - VIEWS_MIN, best = -1;
    int every = (last - VIEWS_MIN) / MOMENTS + 1;
    *least = INFINITY;
    for (int step = every; step >= 1; step = step > 1 ? step / 2 : 0) {
        int from = best < 0 ? VIEWS_MIN : best - step, to = best < 0 ? last : best + step;
        for (int m = from; m <= to; m += best < 0 || m != from ? step : 2 * step) {
            if (m < VIEWS_MIN || m > last)
                continue;
            double rms = rms_at(t, m);
            if (rms < *least) {
                *least = rms;
                best = m;
            }
        }
    }
    return best;
}

static bool differs(const struct trial *t)
{
    double off = log(t->camera[1].focal[0] / t->camera[0].focal[0]);
    double sigma = hypot(t->camera[0].sigma_focal[0] / t->camera[0].focal[0],
                         t->camera[1].sigma_focal[0] / t->camera[1].focal[0]);
    return fabs(off) > fmax(focal_part, 5 * sigma);
}

// Write the two cameras and their views' poses into the calibration; the second is a new camera.
static enum status take(struct bundle *b, const struct trial *t, int camera, struct error *err)
{
    struct calibration *c = b->calibration;
    struct camera *grown = realloc(c->camera, (size_t)(c->cameras + 1) * sizeof *grown);
    char *name = NULL;
    if (grown)
        c->camera = grown;
    if (!grown || asprintf(&name, "%s-%d", c->camera[camera].name, c->cameras + 1) < 0)
        return cap_fail(err, STATUS_MEMORY, "%d cameras", c->cameras);
    char *old = c->camera[camera].name;
    c->camera[camera] = t->camera[0];
    c->camera[camera].name = old;
    c->camera[c->cameras] = t->camera[1];
    c->camera[c->cameras].name = name;
    for (int v = 0, mine = 0; v < c->views; v++)
        if (c->view[v].camera == camera) {
            const struct view *view = t->calibration.view + mine++;
            c->view[v].view_from_world = view->view_from_world;
            c->view[v].camera = view->camera ? c->cameras : camera;
        }
    c->cameras++;
    return STATUS_OK;
}

static enum status split(struct bundle *b, int camera, double rms, struct run *run,
                         struct error *err)
{
    struct trial t;
    enum status status = trial_make(&t, b, camera, err);
    if (status)
        return status;
    double least = INFINITY;
    int moment = t.calibration.views >= 2 * VIEWS_MIN ? best_moment(&t, &least) : -1;
    if (moment >= 0 && least < left_part * rms && rms_at(&t, moment) < left_part * rms
        && differs(&t)) {
        cap_warn(
            run,
            "camera %s: the lens was zoomed or focused anew before %s (focal length %.1f, then "
            "%.1f px): two cameras from here on",
            b->calibration->camera[camera].name, t.calibration.view[t.order[moment]].name,
            t.camera[0].focal[0], t.camera[1].focal[0]);
        status = take(b, &t, camera, err);
    }
    trial_free(&t);
    return status;
}

enum status zoom_split(struct bundle *b, struct run *run, struct error *err)
{
    struct calibration *c = b->calibration;
    enum status status = STATUS_OK;
    int given = c->cameras;  // those that come have no prior
    for (int k = 0; k < c->cameras && !status;) {
        int before = c->cameras;
        double rms = bundle_rms(b, -1, k);
        bool known = b->prior && k < given && isfinite(b->prior[k].sigma[0]);
        if (!known && rms > suspicious_px)
            status = split(b, k, rms, run, err);
        k += c->cameras == before;  // a part may have another moment in it
    }
    return status;
}
