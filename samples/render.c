/* render.c -- a scene becomes a capture folder: radiance of each shot, its bracket, the papers. */
#include "render.h"

#include "capture_out.h"
#include "film.h"
#include "expose.h"
#include "jpeg_write.h"
#include "optics.h"
#include "png_write.h"
#include "tiff_write.h"
#include "truth.h"
#include "truth_table.h"

#include <dirent.h>
#include <errno.h>
#include <fnmatch.h>
#include <stdlib.h>
#include <string.h>

/** A capture under way. */
struct rendering {
    const struct scene *scene;
    const char *out;
    struct run *run;
    struct world world;
    float *value;   // [height][width][3] radiance of the current shot
    size_t values;  // height x width x 3
};

/** OUT/name.extension; NULL: out of memory. */
static char *path_in(const char *out, const char *name, const char *extension)
{
    char *file = NULL, *path = NULL;
    if (asprintf(&file, "%s.%s", name, extension) >= 0)
        path = cap_path(out, file);
    free(file);
    return path;
}

static enum status write_photo(const struct scene *scene, const char *path, uint16_t *dn,
                               double seconds, struct error *err)
{
    const struct camera *c = &scene->camera;
    if (scene->format == PHOTO_JPEG)
        return sam_jpeg_write(path, dn, scene, seconds, err);
    if (scene->format == PHOTO_PNG)
        return sam_png_write(path, dn, c->width, c->height, &scene->exif, seconds, err);
    if (scene->format == PHOTO_DNG)
        return sam_dng_write(path, dn, c->width, c->height, &scene->exif, seconds, &scene->sensor,
                             err);
    return sam_tiff_write(path, dn, c->width, c->height, &scene->exif, seconds, err);
}

enum subject { SUBJECT_SCENE, SUBJECT_WALL, SUBJECT_DARKNESS };

/** One photograph, with the noise of `frame`. */
static enum status take(const struct rendering *r, enum subject subject, const char *name,
                        double seconds, uint32_t frame, struct error *err)
{
    static const double FLAT_FILL = 0.7;  // as one exposes a wall: bright and safely unclipped
    size_t photosites = r->values / 3 * (size_t)sam_channels(r->scene);
    uint16_t *dn = malloc(photosites * sizeof *dn);
    char *path = path_in(r->out, name, sam_photo_extension(r->scene));
    enum status status = STATUS_OK;
    if (!dn || !path) {
        status = cap_fail(err, STATUS_MEMORY, "%s: out of memory", name);
    } else {
        if (subject == SUBJECT_WALL)
            sam_sensor_flat(r->scene, FLAT_FILL, frame, dn);
        else
            sam_sensor_expose(r->scene, subject == SUBJECT_SCENE ? r->value : NULL, seconds, frame,
                              dn);
        status = write_photo(r->scene, path, dn, seconds, err);
    }
    free(dn);
    free(path);
    return status;
}

/** The bracket of a shot: its photographs have nothing in common, so each is one task. The first
 *  error in their order is told. */
static enum status take_bracket(const struct rendering *r, int shot, struct error *err)
{
    int exposures = r->scene->exposures, failed = exposures;
    struct error first = {0};
#pragma omp parallel for schedule(dynamic) num_threads(r->run->threads)
    for (int e = 0; e < exposures; e++) {
        char name[PHOTO_NAME];
        struct error story = {0};
        sam_photo_name(name, r->scene, shot, e);
        enum status status = take(r, SUBJECT_SCENE, name, r->scene->exposure[e],
                                  sam_photo_frame(r->scene, shot, e), &story);
        cap_step(r->run);
#pragma omp critical(sam_bracket)
        if (status && e < failed) {
            failed = e;
            first = story;
        }
    }
    return failed < exposures ? cap_fail(err, first.status, "%s", first.text) : STATUS_OK;
}

/** OUT/radiance/SHOT.exr, in the scene's units and without variance. */
static enum status write_radiance(const struct rendering *r, int shot, struct error *err)
{
    char name[PHOTO_NAME];
    sam_shot_name(name, r->scene, shot);
    char *folder = cap_path(r->out, "radiance");
    char *path = folder ? path_in(folder, name, "exr") : NULL;
    float *variance = calloc(r->values, sizeof *variance);
    enum status status = STATUS_OK;
    if (!path || !variance)
        status = cap_fail(err, STATUS_MEMORY, "%s: out of memory", name);
    if (!status)
        status = cap_make_folder(folder, err);
    if (!status) {
        struct radiance map = {.width = r->scene->camera.width,
                               .height = r->scene->camera.height,
                               .value = r->value,
                               .variance = variance,
                               .channels = 3};
        status = cap_radiance_write(&map, path, err);
    }
    free(folder);
    free(path);
    free(variance);
    return status;
}

static enum status render_shot(const struct rendering *r, int shot, struct error *err)
{
    enum status status =
        sam_film_expose(&r->world, &r->scene->shot[shot], r->run->threads, r->value, err);
    if (!status && r->scene->radiance)
        status = write_radiance(r, shot, err);
    if (!status)
        status = sam_optics_apply(r->scene, r->run->threads, r->value, err);
    if (!status)
        status = take_bracket(r, shot, err);
    return status;
}

/** What the camera of a shot sees while the lamp is off. */
static enum status take_ambient(const struct rendering *r, int shot, double seconds, uint32_t frame,
                                struct error *err)
{
    char name[PHOTO_NAME] = "ambient";
    struct scene_shot unlit = r->scene->shot[shot];
    if (r->scene->ambient_frames == AMBIENT_EACH)
        snprintf(name, sizeof name, "ambient%02d", shot);
    unlit.power = 0;
    enum status status = sam_film_expose(&r->world, &unlit, r->run->threads, r->value, err);
    if (!status)
        status = sam_optics_apply(r->scene, r->run->threads, r->value, err);
    return status ? status : take(r, SUBJECT_SCENE, name, seconds, frame, err);
}

/** The frames of a wall, of darkness and of the unlit scene that are asked for; the latter two as
 *  long as the longest exposure. */
static enum status take_frames(const struct rendering *r, struct error *err)
{
    const struct scene *scene = r->scene;
    uint32_t next = sam_photo_frame(scene, scene->shots, 0);
    double longest = 0;
    for (int e = 0; e < scene->exposures; e++)
        longest = fmax(longest, scene->exposure[e]);
    enum status status = STATUS_OK;
    if (scene->flat)
        status = take(r, SUBJECT_WALL, "flat", scene->exposure[0], next, err);
    if (!status && scene->dark)
        status = take(r, SUBJECT_DARKNESS, "dark", longest, next + 1, err);
    int unlit = scene->ambient_frames == AMBIENT_EACH    ? scene->shots
                : scene->ambient_frames == AMBIENT_FIRST ? 1
                                                         : 0;
    for (int i = 0; i < unlit && !status; i++)
        status = take_ambient(r, i, longest, next + 2 + (uint32_t)i, err);
    return status;
}

/** Is `file` a photograph of this scene? */
static bool is_ours(const struct scene *scene, const char *file)
{
    char name[PHOTO_NAME + 4], photo[PHOTO_NAME];
    for (int i = 0; i < scene->shots; i++)
        for (int e = 0; e < scene->exposures; e++) {
            sam_photo_name(photo, scene, i, e);
            snprintf(name, sizeof name, "%s.%s", photo, sam_photo_extension(scene));
            if (strcmp(name, file) == 0)
                return true;
        }
    return false;
}

// The scanned object's file stands beside the photographs, as capture.yaml says.
static enum status copy_mesh(const struct scene_sample *sample, const char *out, struct error *err)
{
    char *path = cap_path(out, sam_mesh_name(sample)), piece[1 << 14];
    FILE *from = fopen(sample->file, "rb");
    struct atomic_file to = {0};
    enum status status = STATUS_OK;
    if (!path)
        status = cap_fail(err, STATUS_MEMORY, "%s", out);
    else if (!from)
        status = cap_fail(err, STATUS_IO, "%s: %s", sample->file, strerror(errno));
    else
        status = cap_file_begin(&to, path, true, err);
    if (!status) {
        for (size_t size; (size = fread(piece, 1, sizeof piece, from)) > 0;)
            fwrite(piece, 1, size, to.stream);
        status = cap_file_commit(&to, err);  // tells of a full disk
    }
    if (from)
        fclose(from);
    free(path);
    return status;
}

/** Photographs of another scene would pass for this one's: capture.yaml selects by pattern. */
static enum status refuse_others(const struct scene *scene, const char *out, struct error *err)
{
    char pattern[16];
    snprintf(pattern, sizeof pattern, "shot*.%s", sam_photo_extension(scene));
    DIR *folder = opendir(out);
    if (!folder)
        return cap_fail(err, STATUS_IO, "%s: %s", out, strerror(errno));
    enum status status = STATUS_OK;
    for (struct dirent *d; !status && (d = readdir(folder));)
        if (fnmatch(pattern, d->d_name, 0) == 0 && !is_ours(scene, d->d_name))
            status = cap_fail(err, STATUS_IO,
                              "%s: holds %s, which is not of this scene; name an empty folder", out,
                              d->d_name);
    closedir(folder);
    return status;
}

static enum status write_papers(const struct scene *scene, const char *out, struct error *err)
{
    char *truth = cap_path(out, "truth.json"), *capture = cap_path(out, "capture.yaml");
    char *table = cap_path(out, "truth.binary");
    enum status status = STATUS_OK;
    if (!truth || !capture || !table)
        status = cap_fail(err, STATUS_MEMORY, "%s: out of memory", out);
    if (!status && scene->table)
        status = sam_truth_table_write(&scene->sample, table, err);
    if (!status)
        status = sam_truth_write(scene, truth, err);
    if (!status)
        status = sam_capture_write(scene, capture, err);
    if (!status && scene->sample.mesh)
        status = copy_mesh(&scene->sample, out, err);
    free(truth);
    free(capture);
    free(table);
    return status;
}

enum status sam_render(const struct scene *scene, const char *out, struct run *run,
                       struct error *err)
{
    struct rendering r = {.scene = scene, .out = out, .run = run};
    r.values = (size_t)scene->camera.width * (size_t)scene->camera.height * 3;
    r.value = malloc(r.values * sizeof *r.value);
    enum status status = r.value ? cap_make_folder(out, err)
                                 : cap_fail(err, STATUS_MEMORY, "%s: out of memory", out);
    if (!status)
        status = refuse_others(scene, out, err);
    if (!status)
        status = sam_world_build(&r.world, scene, err);
    cap_stage(run, "render", scene->shots * scene->exposures);
    for (int i = 0; i < scene->shots && !status; i++)
        status = render_shot(&r, i, err);
    if (!status)
        status = take_frames(&r, err);
    if (!status)
        status = write_papers(scene, out, err);
    cap_stage(run, "", 0);
    sam_world_free(&r.world);
    free(r.value);
    return status;
}
