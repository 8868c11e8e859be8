/* layout.c -- first places of tags that nobody measured.
 *
 * Method.   A square of known size has a pose of its own in each view, in two mirrored variants
 *           (IPPE). One view lays out the tags that it sees, the variants chosen to lie like its
 *           largest tag; other views are posed by the tags they share with the layout, and bring in
 *           tags of their own, each where all views agree best. This is tried for focal lengths in
 *           steps of a quarter and for both variants of the first tag: a wrong one stretches the
 *           board along the slant of the first view, by far more than tags of a few dozen pixels
 *           err. No plane is assumed.
 * Accuracy. A millimetre or so where tags have 50 pixels: a start for the bundle.
 */
#include "layout.h"

#include "opencv_shim.h"
#include "rigid.h"
#include "start.h"

#include <stdlib.h>
#include <string.h>

// The views that the search for a focal length looks at: more cost time and tell little more.
enum { SCAN_VIEWS = 12 };

// A layout under way. World is the first view's camera, or that of the tags with given places.
struct layout {
    const struct bundle *bundle;
    pose *pose;               // [views]
    bool *posed;              // [views]
    bool *wanted;             // [views] that take part
    struct tag_place *place;  // [tags]; without a place: centre NAN
    double *rms;              // [views], px
};

static void layout_free(struct layout *l)
{
    free(l->pose);
    free(l->posed);
    free(l->wanted);
    free(l->place);
    free(l->rms);
    *l = (struct layout){0};
}

static enum status layout_make(struct layout *l, const struct bundle *b, struct error *err)
{
    size_t views = (size_t)b->calibration->views + 1, tags = (size_t)b->capture->tags + 1;
    *l = (struct layout){.bundle = b,
                         .pose = calloc(views, sizeof *l->pose),
                         .posed = calloc(views, sizeof *l->posed),
                         .wanted = calloc(views, sizeof *l->wanted),
                         .place = calloc(tags, sizeof *l->place),
                         .rms = calloc(views, sizeof *l->rms)};
    if (l->pose && l->posed && l->wanted && l->place && l->rms)
        return STATUS_OK;
    layout_free(l);
    return cap_fail(err, STATUS_MEMORY, "layout of %zu tags", tags);
}

static void forget(struct layout *l)
{
    memset(l->posed, 0, (size_t)l->bundle->calibration->views * sizeof *l->posed);
    for (int i = 0; i < l->bundle->capture->tags; i++) {
        l->place[i] = l->bundle->capture->tag[i];
        l->place[i].center.x = NAN;
    }
}

// ---- one tag in one view

static const struct camera *camera_of(const struct layout *l, int view)
{
    const struct calibration *c = l->bundle->calibration;
    return c->camera + c->view[view].camera;
}

static double size_px(const struct sighting *s)
{
    double around = 0;
    for (int k = 0; k < 4; k++)
        around += hypot(s->corner[(k + 1) % 4][0] - s->corner[k][0],
                        s->corner[(k + 1) % 4][1] - s->corner[k][1]);
    return around / 4;
}

// Where a tag is in the camera's frame: two variants.
static bool variants_of(const struct layout *l, const struct sighting *s,
                        struct tag_place variant[2])
{
    const struct tag_place *tag = l->bundle->capture->tag + s->place;
    double normalised[4][2];
    pose p[2];
    for (int k = 0; k < 4; k++) {
        vec3 ray = cal_ray(camera_of(l, s->view), s->corner[k]);
        normalised[k][0] = ray.x / ray.z;
        normalised[k][1] = ray.y / ray.z;
    }
    if (opencv_square(p, tag->size, normalised, NULL))
        return false;
    for (int v = 0; v < 2; v++) {
        mat3 r = cal_rotation(p[v].rotation);
        variant[v] = *tag;
        variant[v].center = p[v].translation;
        variant[v].x_axis = mat3_mul(&r, (vec3){1, 0, 0});
        variant[v].y_axis = mat3_mul(&r, (vec3){0, 1, 0});
    }
    return true;
}

static struct tag_place to_world(const struct tag_place *in_view, pose view_from_world)
{
    pose back = rigid_inverse(view_from_world);
    mat3 r = cal_rotation(back.rotation);
    return rigid_move(in_view, &r, back.translation);
}

// Squared distance of a sighting from where a tag at that place would be, px^2, over its corners.
static double squares(const struct layout *l, const struct sighting *s, const struct tag_place *tag)
{
    double sum = 0, pixel[2];
    for (int k = 0; k < 4; k++) {
        vec3 p = cal_to_view(l->pose[s->view], cap_tag_corner(tag, k));
        if (!(p.z > 0))
            return INFINITY;
        cal_project(camera_of(l, s->view), p, pixel);
        sum += (s->corner[k][0] - pixel[0]) * (s->corner[k][0] - pixel[0])
               + (s->corner[k][1] - pixel[1]) * (s->corner[k][1] - pixel[1]);
    }
    return sum;
}

// ---- growing

// How badly a place explains all views of its tag: no view may count more than a far miss does.
static double misfit(const struct layout *l, const struct tag_place *tag, int place)
{
    double sum = 0;
    for (int i = 0; i < l->bundle->sightings; i++) {
        const struct sighting *s = l->bundle->sighting + i;
        if (s->place == place && l->posed[s->view])
            sum += fmin(squares(l, s, tag), 4 * 400);
    }
    return sum;
}

// Place a tag where the posed views of it agree best, among what each of up to six says.
static bool place_tag(struct layout *l, int place)
{
    enum { SPEAKERS = 6 };
    double best = INFINITY;
    int speakers = 0;
    for (int i = 0; i < l->bundle->sightings && speakers < SPEAKERS; i++) {
        const struct sighting *s = l->bundle->sighting + i;
        struct tag_place variant[2];
        if (s->place != place || !l->posed[s->view] || !variants_of(l, s, variant))
            continue;
        speakers++;
        for (int v = 0; v < 2; v++) {
            struct tag_place tag = to_world(variant + v, l->pose[s->view]);
            double miss = misfit(l, &tag, place);
            if (miss < best) {
                best = miss;
                l->place[place] = tag;
            }
        }
    }
    return best < INFINITY;
}

// Pose a view by the tags that have a place; false: it sees none.
static bool pose_view(struct layout *l, int view)
{
    const struct bundle *b = l->bundle;
    struct start_corners corners;
    if (start_corners_make(&corners, b, NULL))
        return false;
    start_corners_of(&corners, b, l->place, view, camera_of(l, view));
    bool posed = corners.count >= 4
                 && !opencv_pose(l->pose + view, l->rms + view, corners.point, corners.normalised,
                                 corners.count, NULL);
    start_corners_free(&corners);
    if (posed)
        l->rms[view] *= camera_of(l, view)->focal[0];
    return posed;
}

static void grow(struct layout *l)
{
    const struct bundle *b = l->bundle;
    bool more = true;
    while (more) {
        more = false;
        for (int v = 0; v < b->calibration->views; v++)
            if (l->wanted[v] && !l->posed[v] && pose_view(l, v))
                more = l->posed[v] = true;
        for (int t = 0; t < b->capture->tags; t++)
            if (!bundle_placed(l->place + t) && place_tag(l, t))
                more = true;
    }
    for (int t = 0; t < b->capture->tags; t++)  // now that all views have their say
        place_tag(l, t);
    for (int v = 0; v < b->calibration->views; v++)
        if (l->posed[v])
            pose_view(l, v);
}

// ---- the first view

static int tags_of(const struct layout *l, int view)
{
    int n = 0;
    for (int i = 0; i < l->bundle->sightings; i++)
        n += l->bundle->sighting[i].view == view;
    return n;
}

static vec3 normal_of(const struct tag_place *tag)
{
    return vec3_cross(tag->x_axis, tag->y_axis);
}

// Lay out the tags of a view, in its frame, like the given variant of its largest tag.
static void lay_out(struct layout *l, int view, int first_variant)
{
    const struct bundle *b = l->bundle;
    const struct sighting *largest = NULL;
    struct tag_place variant[2], first[2];
    for (int i = 0; i < b->sightings; i++)
        if (b->sighting[i].view == view
            && (!largest || size_px(b->sighting + i) > size_px(largest)))
            largest = b->sighting + i;
    l->pose[view] = (pose){0};
    l->posed[view] = true;
    if (!largest || !variants_of(l, largest, first))
        return;
    for (int i = 0; i < b->sightings; i++) {
        const struct sighting *s = b->sighting + i;
        if (s->view != view || !variants_of(l, s, variant))
            continue;
        vec3 like = normal_of(first + first_variant);
        bool second = vec3_dot(normal_of(variant + 1), like) > vec3_dot(normal_of(variant), like);
        l->place[s->place] = variant[s == largest ? first_variant : second];
    }
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// Median over the wanted views of their rms; views without a pose are far off.
static double score(const struct layout *l)
{
    int n = 0, views = l->bundle->calibration->views;
    double *rms = malloc((size_t)(views + 1) * sizeof *rms);
    if (!rms)
        return INFINITY;
    for (int v = 0; v < views; v++)
        if (l->wanted[v])
            rms[n++] = l->posed[v] ? l->rms[v] : INFINITY;
    qsort(rms, (size_t)n, sizeof *rms, compare_doubles);
    double median = n ? rms[n / 2] : INFINITY;
    free(rms);
    return median;
}

// Some views of a camera, evenly spread; the one with the most tags is *first and among them.
static void choose_views(struct layout *l, int camera, int *first)
{
    const struct calibration *c = l->bundle->calibration;
    int views = 0, seen = 0, most = 0;
    *first = -1;
    for (int v = 0; v < c->views; v++)
        views += c->view[v].camera == camera;
    for (int v = 0; v < c->views; v++) {
        l->wanted[v] = false;
        if (c->view[v].camera != camera)
            continue;
        int every = (views + SCAN_VIEWS - 1) / SCAN_VIEWS, n = tags_of(l, v);
        l->wanted[v] = seen++ % every == 0;
        if (n > most) {
            most = n;
            *first = v;
        }
    }
    if (*first >= 0)
        l->wanted[*first] = true;
}

// The best layout of one camera's views, with its focal length where no prior tells it.
static void scan(struct layout *l, int camera, int first)
{
    struct camera *m = l->bundle->calibration->camera + camera;
    bool known = l->bundle->prior && isfinite(l->bundle->prior[camera].sigma[0]);
    double best = INFINITY, longest = fmax(m->width, m->height);
    struct camera best_camera = *m;
    int best_variant = 0;
    for (double f = 0.5; f < 16; f *= 1.25) {
        if (!known)
            start_pinhole(m, f * longest);
        for (int variant = 0; variant < 2; variant++) {
            forget(l);
            lay_out(l, first, variant);
            grow(l);
            double now = score(l);
            if (!(now < best))
                continue;
            best = now;
            best_camera = *m;
            best_variant = variant;
        }
        if (known)
            break;
    }
    *m = best_camera;
    forget(l);
    lay_out(l, first, best_variant);
}

// ---- the world

// Express everything in the world of the given places.
static void move(struct layout *l, pose world_from_layout)
{
    mat3 turn = cal_rotation(world_from_layout.rotation);
    pose layout_from_world = rigid_inverse(world_from_layout);
    for (int i = 0; i < l->bundle->capture->tags; i++)
        l->place[i] = rigid_move(l->place + i, &turn, world_from_layout.translation);
    for (int v = 0; v < l->bundle->calibration->views; v++)
        if (l->posed[v])
            l->pose[v] = rigid_chain(layout_from_world, l->pose[v]);
}

// Where no tag has a place: the one with the lowest id among those laid out begins the world.
static void choose_origin(const struct layout *l)
{
    const struct capture *capture = l->bundle->capture;
    int lowest = -1;
    for (int i = 0; i < capture->tags; i++) {
        if (!capture->tag[i].unplaced && bundle_placed(l->place + i))
            return;
        if (bundle_placed(l->place + i)
            && (lowest < 0 || capture->tag[i].id < capture->tag[lowest].id))
            lowest = i;
    }
    if (lowest < 0)
        return;
    struct tag_place *tag = capture->tag + lowest;
    tag->unplaced = false;
    tag->center = (vec3){0, 0, 0};
    tag->x_axis = (vec3){1, 0, 0};
    tag->y_axis = (vec3){0, 1, 0};
}

static void take(const struct layout *l, bool *posed)
{
    const struct bundle *b = l->bundle;
    for (int i = 0; i < b->capture->tags; i++)
        if (b->capture->tag[i].unplaced)
            b->capture->tag[i] = l->place[i];
    for (int v = 0; v < b->calibration->views; v++) {
        posed[v] = l->posed[v];
        b->calibration->view[v].view_from_world = l->pose[v];
    }
}

// The camera with the most sightings: the layout begins with it.
static int busiest(const struct bundle *b)
{
    int best = 0, most = -1;
    for (int k = 0; k < b->calibration->cameras; k++) {
        int n = 0;
        for (int i = 0; i < b->sightings; i++)
            n += b->calibration->view[b->sighting[i].view].camera == k;
        if (n > most) {
            most = n;
            best = k;
        }
    }
    return best;
}

enum status layout_start(const struct bundle *b, bool *posed, struct error *err)
{
    struct layout l;
    enum status status = layout_make(&l, b, err);
    if (status)
        return status;
    int first, camera = busiest(b);
    choose_views(&l, camera, &first);
    if (first < 0) {
        layout_free(&l);
        return cap_fail(err, STATUS_DATA, "no tags to lay out");
    }
    scan(&l, camera, first);
    for (int v = 0; v < b->calibration->views; v++)
        l.wanted[v] = b->calibration->view[v].camera == camera;
    grow(&l);
    for (int k = 0; k < b->calibration->cameras && !status; k++)
        if (k != camera)  // a focal length by the tags that have a place by now
            status = start_camera(b, l.place, k, err);
    for (int v = 0; v < b->calibration->views; v++)
        l.wanted[v] = true;
    grow(&l);
    choose_origin(&l);
    move(&l, rigid_motion(l.place, b->capture->tag, b->capture->tags));
    take(&l, posed);
    layout_free(&l);
    return status;
}
