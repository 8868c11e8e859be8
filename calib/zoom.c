/* zoom.c -- a lens that was zoomed or focused anew between photographs, and EXIF does not tell.
 *
 * Method.   Each view is given a focal length of its own, the rest of the lens as the whole camera
 *           found it. In order of these focal lengths, a gap that is wide against their deviations
 *           and half a per cent begins a new group. Only a camera whose tags are far off as it is
 *           comes into question, so that a good calibration is never taken apart.
 * Accuracy. A view's own focal length is good to 0.1 to 1 % (the distance answers for the rest).
 */
#include "zoom.h"

#include "views.h"

#include <stdlib.h>
#include <string.h>

// What a view says of the focal length.
struct own {
    int view, group;
    double log_focal, sigma;
};

static int by_focal(const void *a, const void *b)
{
    const struct own *x = a, *y = b;
    if (x->log_focal != y->log_focal)
        return x->log_focal < y->log_focal ? -1 : 1;
    return x->view - y->view;
}

// Fit one view alone. false: it does not tell.
static bool own_focal(struct own *own, const struct bundle *all, int view)
{
    struct view one = all->calibration->view[view];
    struct camera camera = all->calibration->camera[one.camera];
    struct calibration c = {.camera = &camera, .cameras = 1, .view = &one, .views = 1};
    struct bundle b = {.calibration = &c, .capture = all->capture};
    b.sighting = calloc((size_t)all->sightings + 1, sizeof *b.sighting);
    if (!b.sighting)
        return false;
    one.camera = 0;
    for (int i = 0; i < all->sightings; i++)
        if (all->sighting[i].view == view) {
            b.sighting[b.sightings] = all->sighting[i];
            b.sighting[b.sightings].view = 0;
            b.sighting[b.sightings++].rejected = false;
        }
    bool good = b.sightings >= 3 && !bundle_adjust(&b, BUNDLE_ZOOM, NULL);
    own->view = view;
    own->log_focal = good ? 0.5 * log(camera.focal[0] * camera.focal[1]) : 0;
    own->sigma = good ? 0.5
                            * (camera.sigma_focal[0] / camera.focal[0]
                               + camera.sigma_focal[1] / camera.focal[1])
                      : INFINITY;
    free(b.sighting);
    return good && own->sigma < 0.02 && isfinite(own->log_focal);
}

// Groups of sorted focal lengths; -> how many have VIEWS_MIN views.
static int group(struct own *own, int count)
{
    static const double least = 0.005, sigmas = 4;
    int groups = 0, begin = 0, good = 0;
    for (int i = 0; i < count; i++) {
        double gap = i ? own[i].log_focal - own[i - 1].log_focal : 0;
        double noise = i ? hypot(own[i].sigma, own[i - 1].sigma) : 0;
        if (i && gap > fmax(least, sigmas * noise)) {
            good += i - begin >= VIEWS_MIN;
            begin = i;
            groups++;
        }
        own[i].group = groups;
    }
    return good + (count - begin >= VIEWS_MIN);
}

static int size_of(const struct own *own, int count, int group)
{
    int n = 0;
    for (int i = 0; i < count; i++)
        n += own[i].group == group;
    return n;
}

// The focal length that a group's views have on the mean.
static double focal_of(const struct own *own, int count, int group)
{
    double sum = 0;
    for (int i = 0; i < count; i++)
        sum += own[i].group == group ? own[i].log_focal : 0;
    return exp(sum / size_of(own, count, group));
}

// A new camera like an old one; its index, or -1.
static int add_camera(struct calibration *c, int like, double focal, int number)
{
    struct camera *grown = realloc(c->camera, (size_t)(c->cameras + 1) * sizeof *grown);
    char *name = NULL;
    if (!grown)
        return -1;
    c->camera = grown;
    struct camera *m = c->camera + c->cameras;
    *m = c->camera[like];
    m->focal[0] = m->focal[1] = focal;
    if (asprintf(&name, "%s-%d", c->camera[like].name, number) < 0)
        return -1;
    m->name = name;
    return c->cameras++;
}

static enum status split(struct bundle *b, int camera, struct own *own, int count, struct run *run,
                         struct error *err)
{
    struct calibration *c = b->calibration;
    int groups = own[count - 1].group + 1, parts = 0;
    int *camera_of = calloc((size_t)groups, sizeof *camera_of);
    if (!camera_of)
        return cap_fail(err, STATUS_MEMORY, "%d cameras", groups);
    for (int g = 0; g < groups; g++) {
        bool enough = size_of(own, count, g) >= VIEWS_MIN;
        camera_of[g] = enough && parts == 0 ? camera : -1;
        double focal = focal_of(own, count, g);
        if (enough && parts > 0)
            camera_of[g] = add_camera(c, camera, focal, parts + 1);
        if (enough && camera_of[g] < 0) {
            free(camera_of);
            return cap_fail(err, STATUS_MEMORY, "%d cameras", groups);
        }
        if (enough && parts++ == 0)
            c->camera[camera].focal[0] = c->camera[camera].focal[1] = focal;
    }
    for (int v = 0; v < c->views; v++) {  // the nearest group that is a camera
        double best = INFINITY;
        int mine = -1;
        for (int i = 0; i < count; i++)
            mine = own[i].view == v ? i : mine;
        for (int i = 0; i < count && mine >= 0; i++) {
            double off = fabs(own[i].log_focal - own[mine].log_focal);
            if (camera_of[own[i].group] >= 0 && off < best) {
                best = off;
                c->view[v].camera = camera_of[own[i].group];
            }
        }
    }
    cap_warn(run,
             "camera %s: the lens was zoomed or focused anew between the photographs: %d cameras "
             "from here on",
             c->camera[camera].name, parts);
    free(camera_of);
    return STATUS_OK;
}

enum status zoom_split(struct bundle *b, struct run *run, struct error *err)
{
    static const double suspicious_px = 0.5;
    struct calibration *c = b->calibration;
    struct own *own = calloc((size_t)c->views + 1, sizeof *own);
    enum status status = own ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%d views", c->views);
    int cameras = c->cameras;
    for (int k = 0; k < cameras && !status; k++) {
        int count = 0;
        if ((b->prior && isfinite(b->prior[k].sigma[0])) || bundle_rms(b, -1, k) < suspicious_px)
            continue;
        for (int v = 0; v < c->views; v++)
            if (c->view[v].camera == k && own_focal(own + count, b, v))
                count++;
        qsort(own, (size_t)count, sizeof *own, by_focal);
        if (count > 0 && group(own, count) > 1)
            status = split(b, k, own, count, run, err);
    }
    free(own);
    return status;
}
