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

// Corners of one view, as OpenCV wants them.
struct corners {
    double (*point)[3], (*normalised)[2];
    int count;
};

static enum status corners_make(struct corners *c, const struct capture *capture, struct error *err)
{
    size_t n = 4 * (size_t)capture->tags + 1;
    *c = (struct corners){.point = calloc(n, sizeof *c->point),
                          .normalised = calloc(n, sizeof *c->normalised)};
    if (c->point && c->normalised)
        return STATUS_OK;
    free(c->point);
    free(c->normalised);
    *c = (struct corners){0};
    return cap_fail(err, STATUS_MEMORY, "%d tags", capture->tags);
}

static void corners_free(struct corners *c)
{
    free(c->point);
    free(c->normalised);
    *c = (struct corners){0};
}

static void corners_of(struct corners *c, const struct bundle *b, int view,
                       const struct camera *camera)
{
    c->count = 0;
    for (int i = 0; i < b->sightings; i++) {
        const struct sighting *s = b->sighting + i;
        if (s->view != view)
            continue;
        for (int k = 0; k < 4; k++) {
            vec3 p = cap_tag_corner(b->capture->tag + s->place, k), ray;
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

// Poses of all views of a camera; the median over views of their rms, in pixels.
static enum status poses_of(const struct bundle *b, int index, const struct camera *camera,
                            pose *poses, double *rms, double *median, struct corners *corners,
                            struct error *err)
{
    const struct calibration *c = b->calibration;
    int n = 0;
    for (int v = 0; v < c->views; v++) {
        if (c->view[v].camera != index)
            continue;
        corners_of(corners, b, v, camera);
        struct error why = {0};
        if (opencv_pose(poses + v, rms + n, corners->point, corners->normalised, corners->count,
                        &why))
            return cap_fail(err, why.status, "%s: %s", c->view[v].name, why.text);
        rms[n++] *= camera->focal[0];
    }
    qsort(rms, (size_t)n, sizeof *rms, compare_doubles);
    *median = n ? rms[n / 2] : 0;
    return STATUS_OK;
}

static enum status scan_focal(const struct bundle *b, int index, pose *poses, double *rms,
                              struct corners *corners, struct error *err)
{
    struct camera *camera = b->calibration->camera + index;
    double longest = fmax(camera->width, camera->height), best = INFINITY;
    // Half the image's width is a view of 90 degrees; 16 times, of 3.6 degrees.
    for (double f = 0.5; f < 16; f *= 1.25) {
        struct camera trial = *camera;
        double median = INFINITY;
        trial.focal[0] = trial.focal[1] = f * longest;
        trial.center[0] = 0.5 * (camera->width - 1);
        trial.center[1] = 0.5 * (camera->height - 1);
        memset(trial.distortion, 0, sizeof trial.distortion);
        enum status status = poses_of(b, index, &trial, poses, rms, &median, corners, err);
        if (status)
            return status;
        if (!(median < best))
            continue;
        best = median;
        *camera = trial;
        for (int v = 0; v < b->calibration->views; v++)
            if (b->calibration->view[v].camera == index)
                b->calibration->view[v].view_from_world = poses[v];
    }
    return STATUS_OK;
}

enum status start_cameras(const struct bundle *b, struct error *err)
{
    struct corners corners = {0};
    size_t views = (size_t)b->calibration->views + 1;
    pose *poses = calloc(views, sizeof *poses);
    double *rms = calloc(views, sizeof *rms);
    enum status status = corners_make(&corners, b->capture, err);
    if (!status && (!poses || !rms))
        status = cap_fail(err, STATUS_MEMORY, "%zu views", views);
    for (int i = 0; !status && i < b->calibration->cameras; i++)
        status = scan_focal(b, i, poses, rms, &corners, err);
    corners_free(&corners);
    free(poses);
    free(rms);
    return status;
}

enum status start_poses_again(const struct bundle *b, struct error *err)
{
    struct corners corners = {0};
    enum status status = corners_make(&corners, b->capture, err);
    for (int v = 0; !status && v < b->calibration->views; v++) {
        struct view *view = b->calibration->view + v;
        pose before = view->view_from_world, again;
        double rms = bundle_rms(b, v, 0), ignored;
        corners_of(&corners, b, v, b->calibration->camera + view->camera);
        if (opencv_pose(&again, &ignored, corners.point, corners.normalised, corners.count, NULL))
            continue;  // the pose that is there stays
        view->view_from_world = again;
        double new_rms = bundle_rms(b, v, 0);
        if (!(new_rms > 0 && new_rms < rms))
            view->view_from_world = before;
    }
    corners_free(&corners);
    return status;
}
