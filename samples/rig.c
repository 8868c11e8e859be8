/* rig.c -- cameras, lamps, sample and tags as a plan needs them.
 *
 * Method.   A scene knows all of them. Of a reconstruction calibration.yaml knows all but the tags'
 *           places: each stands where the rays of its corners meet the board's plane z = 0, in the
 *           mean over the shots that saw it. Tags off that plane scatter there, and are left out.
 */
#include "rig.h"

#include <stdlib.h>
#include <string.h>

void sam_rig_free(struct rig *rig)
{
    cal_calibration_free(&rig->calibration);
    free(rig->tag);
    *rig = (struct rig){0};
}

/* ---- from a scene ---------------------------------------------------------------------------- */

static struct lamp lamp_of(const struct scene_lamp *from)
{
    struct lamp lamp = {.name = strdup(from->name),
                        .on_camera = from->on_camera,
                        .at_infinity = from->kind == LAMP_DISTANT,
                        .position = from->position,
                        .direction = from->direction};
    memcpy(lamp.intensity, from->intensity, sizeof lamp.intensity);
    return lamp;
}

static void take_tags(struct rig *rig, const struct scene *scene)
{
    for (int t = 0; t < scene->board.tags; t++)
        for (int k = 0; k < 4; k++)
            rig->tag[t].corner[k] = cap_tag_corner(&scene->board.tag[t], k);
    rig->tags = scene->board.tags;
}

// The scene's sample; of a mesh, read anew from its file, for the scene keeps its own.
static enum status take_sample(struct sample *sample, const struct scene_sample *from,
                               struct error *err)
{
    sample->shape = from->place.shape;
    sample->radius = from->place.radius;
    sample->height = from->place.height;
    sample->center = from->place.center;
    sample->axis = from->place.axis;
    if (sample->shape != SHAPE_MESH)
        return STATUS_OK;
    sample->file = strdup(from->file);
    sample->scale = from->scale;
    sample->world_from_file = from->world_from_file;
    return sample->file ? cal_sample_load(sample, err) : cap_fail(err, STATUS_MEMORY, "no memory");
}

static enum status take_scene(struct rig *rig, const struct scene *scene, struct error *err)
{
    struct calibration *c = &rig->calibration;
    c->camera = calloc(1, sizeof *c->camera);
    c->lamp = calloc((size_t)scene->lamps, sizeof *c->lamp);
    c->view = calloc((size_t)scene->shots, sizeof *c->view);
    rig->tag = calloc((size_t)scene->board.tags + 1, sizeof *rig->tag);
    if (!c->camera || !c->lamp || !c->view || !rig->tag)
        return cap_fail(err, STATUS_MEMORY, "no memory for %d shots", scene->shots);
    c->camera[0] = scene->camera;
    c->camera[0].name = strdup("camera");
    c->cameras = 1;
    for (int i = 0; i < scene->lamps; i++)
        c->lamp[c->lamps++] = lamp_of(&scene->lamp[i]);
    for (int i = 0; i < scene->shots; i++)
        c->view[c->views++] = (struct view){.light = scene->shot[i].lamp,
                                            .view_from_world = scene->shot[i].view_from_world,
                                            .power = scene->shot[i].power};
    take_tags(rig, scene);
    return take_sample(&c->sample, &scene->sample, err);
}

enum status sam_rig_of_scene(struct rig *rig, const char *path, struct error *err)
{
    struct scene scene = {0};
    struct rig made = {0};
    enum status status = sam_scene_read(&scene, path, err);
    if (!status)
        status = take_scene(&made, &scene, err);
    if (!status) {
        *rig = made;
        made = (struct rig){0};  // the caller's now
    }
    sam_rig_free(&made);
    sam_scene_free(&scene);
    return status;
}

/* ---- from a result --------------------------------------------------------------------------- */

/** Where one tag was seen on the board's plane: sums over shots. */
struct trail {
    int id, count;
    double sum[4][2], square;
};

// Where the ray of a pixel meets the plane z = 0. false: it does not.
static bool on_board(double at[2], const struct camera *camera, const struct view *view,
                     const double pixel[2])
{
    mat3 r = cal_rotation(view->view_from_world.rotation);
    vec3 eye = cal_eye(view->view_from_world), ray = mat3_mul_t(&r, cal_ray(camera, pixel));
    if (eye.z * ray.z >= 0)
        return false;
    at[0] = eye.x - eye.z / ray.z * ray.x;
    at[1] = eye.y - eye.z / ray.z * ray.y;
    return true;
}

static struct trail *trail_of(struct trail *trail, int *trails, int id)
{
    for (int i = 0; i < *trails; i++)
        if (trail[i].id == id)
            return &trail[i];
    trail[*trails] = (struct trail){.id = id};
    return &trail[(*trails)++];
}

static void follow(struct trail *trail, const struct camera *camera, const struct view *view,
                   const struct seen_tag *tag)
{
    double at[4][2];
    for (int k = 0; k < 4; k++)
        if (!on_board(at[k], camera, view, tag->corner[k]))
            return;
    trail->count++;
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < 2; i++) {
            trail->sum[k][i] += at[k][i];
            trail->square += at[k][i] * at[k][i];
        }
}

// The tags that lie on the board: their corners scatter by less than a tenth of their size.
static int keep_tags(struct rig_tag *tag, const struct trail *trail, int trails)
{
    int tags = 0;
    for (int t = 0; t < trails; t++) {
        const struct trail *from = &trail[t];
        double mean[4][2], variance = from->square / from->count;
        for (int k = 0; k < 4 && from->count; k++)
            for (int i = 0; i < 2; i++) {
                mean[k][i] = from->sum[k][i] / from->count;
                variance -= mean[k][i] * mean[k][i];
            }
        if (!from->count
            || 10 * sqrt(fmax(0, variance))
                   > hypot(mean[1][0] - mean[0][0], mean[1][1] - mean[0][1]))
            continue;
        for (int k = 0; k < 4; k++)
            tag[tags].corner[k] = (vec3){mean[k][0], mean[k][1], 0};
        tags++;
    }
    return tags;
}

static enum status find_tags(struct rig *rig, struct error *err)
{
    const struct calibration *c = &rig->calibration;
    int seen = 0, trails = 0;
    for (int v = 0; v < c->views; v++)
        seen += c->view[v].tags;
    struct trail *trail = calloc((size_t)seen + 1, sizeof *trail);
    rig->tag = calloc((size_t)seen + 1, sizeof *rig->tag);
    if (trail && rig->tag) {
        for (int v = 0; v < c->views; v++)
            for (int t = 0; t < c->view[v].tags; t++) {
                const struct seen_tag *tag = &c->view[v].tag[t];
                follow(trail_of(trail, &trails, tag->id), &c->camera[c->view[v].camera],
                       &c->view[v], tag);
            }
        rig->tags = keep_tags(rig->tag, trail, trails);
    }
    free(trail);
    return trail && rig->tag ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "no memory for tags");
}

enum status sam_rig_of_result(struct rig *rig, const char *out, struct error *err)
{
    struct rig made = {0};
    char *path = cap_path(out, "calibration.yaml");
    enum status status = path ? cal_calibration_read(&made.calibration, path, err)
                              : cap_fail(err, STATUS_MEMORY, "no memory for a path");
    if (!status)
        status = find_tags(&made, err);
    if (!status) {
        *rig = made;
        made = (struct rig){0};  // the caller's now
    }
    sam_rig_free(&made);
    free(path);
    return status;
}
