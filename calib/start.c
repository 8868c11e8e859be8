/* start.c -- first values of cameras and poses.
 *
 * Method.   A pinhole's focal length is tried in steps of a quarter, from wide angle to long
 *           tele; for each, OpenCV finds the best pose of every view, and the focal length with
 *           the smallest reprojection error (median over views, so that one bad view has no say)
 *           wins. No plane is assumed, and no view needs to see much.
 * Accuracy. The focal length within an eighth or so: enough for the bundle to go on from.
 */
#include "start.h"

#include "lens.h"
#include "opencv_shim.h"

#include <stdlib.h>
#include <string.h>

enum status start_corners_make(struct start_corners *c, const struct bundle *b, struct error *err)
{
    size_t n = 4 * (size_t)b->capture->tags + 1;
    *c = (struct start_corners){.point = calloc(n, sizeof *c->point),
                                .normalised = calloc(n, sizeof *c->normalised)};
    if (c->point && c->normalised)
        return STATUS_OK;
    start_corners_free(c);
    return cap_fail(err, STATUS_MEMORY, "%d tags", b->capture->tags);
}

void start_corners_free(struct start_corners *c)
{
    free(c->point);
    free(c->normalised);
    *c = (struct start_corners){0};
}

void start_corners_of(struct start_corners *c, const struct bundle *b,
                      const struct tag_place *place, int view, const struct camera *camera)
{
    c->count = 0;
    for (int i = 0; i < b->sightings; i++) {
        const struct sighting *s = b->sighting + i;
        if (s->view != view || !bundle_placed(place + s->place))
            continue;
        for (int k = 0; k < 4; k++) {
            vec3 p = cap_tag_corner(place + s->place, k), ray;
            ray = cal_ray(camera, s->corner[k]);
            memcpy(c->point[c->count], &p, sizeof p);
            c->normalised[c->count][0] = ray.x / ray.z;
            c->normalised[c->count][1] = ray.y / ray.z;
            c->count++;
        }
    }
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// A search for the focal length of one camera, and the poses of its views.
struct search {
    const struct bundle *bundle;
    const struct tag_place *place;
    int camera;
    struct start_corners corners;
    pose *pose;  // [views]
    bool *posed;
    double *rms;
};

static void search_free(struct search *s)
{
    start_corners_free(&s->corners);
    free(s->pose);
    free(s->posed);
    free(s->rms);
}

static enum status search_make(struct search *s, struct error *err)
{
    size_t views = (size_t)s->bundle->calibration->views + 1;
    s->pose = calloc(views, sizeof *s->pose);
    s->posed = calloc(views, sizeof *s->posed);
    s->rms = calloc(views, sizeof *s->rms);
    if (!s->pose || !s->posed || !s->rms)
        return cap_fail(err, STATUS_MEMORY, "%zu views", views);
    return start_corners_make(&s->corners, s->bundle, err);
}

// Poses of all views of the camera; the median over views of their rms, in pixels.
static enum status poses_of(struct search *s, const struct camera *camera, double *median,
                            struct error *err)
{
    const struct calibration *c = s->bundle->calibration;
    int n = 0;
    for (int v = 0; v < c->views; v++) {
        s->posed[v] = false;
        if (c->view[v].camera != s->camera)
            continue;
        start_corners_of(&s->corners, s->bundle, s->place, v, camera);
        if (s->corners.count < 4)
            continue;
        struct error why = {0};
        if (opencv_pose(s->pose + v, s->rms + n, s->corners.point, s->corners.normalised,
                        s->corners.count, &why))
            return cap_fail(err, why.status, "%s: %s", c->view[v].name, why.text);
        s->rms[n++] *= camera->focal[0];
        s->posed[v] = true;
    }
    qsort(s->rms, (size_t)n, sizeof *s->rms, compare_doubles);
    *median = n ? s->rms[n / 2] : 0;
    return STATUS_OK;
}

static void take_poses(const struct search *s)
{
    struct calibration *c = s->bundle->calibration;
    for (int v = 0; v < c->views; v++)
        if (s->posed[v])
            c->view[v].view_from_world = s->pose[v];
}

void start_pinhole(struct camera *camera, double focal_px)
{
    camera->focal[0] = camera->focal[1] = focal_px;
    camera->center[0] = 0.5 * (camera->width - 1);
    camera->center[1] = 0.5 * (camera->height - 1);
    memset(camera->distortion, 0, sizeof camera->distortion);
}

static enum status scan_focal(struct search *s, struct error *err)
{
    struct camera *camera = s->bundle->calibration->camera + s->camera;
    double longest = fmax(camera->width, camera->height), best = INFINITY;
    // Half the image's width is a view of 90 degrees; 16 times, of 3.6 degrees.
    for (double f = 0.5; f < 16; f *= 1.25) {
        struct camera trial = *camera;
        double median = INFINITY;
        start_pinhole(&trial, f * longest);
        enum status status = poses_of(s, &trial, &median, err);
        if (status)
            return status;
        if (!(median < best))
            continue;
        best = median;
        *camera = trial;
        take_poses(s);
    }
    return STATUS_OK;
}

enum status start_camera(const struct bundle *b, const struct tag_place *place, int camera,
                         struct error *err)
{
    struct search s = {.bundle = b, .place = place, .camera = camera};
    bool known = b->prior && isfinite(b->prior[camera].sigma[0]);
    double median;
    enum status status = search_make(&s, err);
    if (!status && known)
        status = poses_of(&s, b->calibration->camera + camera, &median, err);
    if (!status && known)
        take_poses(&s);
    if (!status && !known)
        status = scan_focal(&s, err);
    search_free(&s);
    return status;
}

enum status start_cameras(const struct bundle *b, struct error *err)
{
    enum status status = STATUS_OK;
    for (int i = 0; !status && i < b->calibration->cameras; i++)
        status = start_camera(b, b->capture->tag, i, err);
    return status;
}

enum status start_poses_again(const struct bundle *b, struct error *err)
{
    struct start_corners corners = {0};
    enum status status = start_corners_make(&corners, b, err);
    for (int v = 0; !status && v < b->calibration->views; v++) {
        struct view *view = b->calibration->view + v;
        pose before = view->view_from_world, again;
        double rms = bundle_rms(b, v, 0), ignored;
        start_corners_of(&corners, b, b->capture->tag, v, b->calibration->camera + view->camera);
        if (corners.count < 4
            || opencv_pose(&again, &ignored, corners.point, corners.normalised, corners.count,
                           NULL))
            continue;  // the pose that is there stays
        view->view_from_world = again;
        double new_rms = bundle_rms(b, v, 0);
        if (!(new_rms > 0 && new_rms < rms))
            view->view_from_world = before;
    }
    start_corners_free(&corners);
    return status;
}
