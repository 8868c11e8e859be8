/* scene.c -- SCENE.yaml becomes a scene: keys, ranges, and what stands in for keys left out. */
#include "scene.h"

#include "doc.h"
#include "light.h"
#include "place.h"
#include "random.h"
#include "scene_board.h"
#include "scene_material.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

static const double DEG = CAP_PI / 180;

static void copy_name(char to[SCENE_NAME], const char *from)
{
    snprintf(to, SCENE_NAME, "%s", from);
}

// ---- camera and sensor

/** Focal length in mm with the sensor's width, or in pixels: either is a photographer's. */
static void read_camera(struct scene *scene, struct doc *doc, doc_node node)
{
    struct camera *camera = &scene->camera;
    double size[2] = {900, 600}, lens = sam_doc_number(doc, node, "focal_length", 50, 0.1, 1e5);
    sam_doc_numbers(doc, node, "size", size, 2, false, 1, 65535);
    camera->width = (int)size[0];
    camera->height = (int)size[1];
    double sensor_width = sam_doc_number(doc, node, "sensor_width", 24, 0.1, 1e4);
    for (int i = 0; i < 2; i++) {
        camera->focal[i] = lens * camera->width / sensor_width;
        camera->center[i] = (floor(size[i]) - 1) / 2;
    }
    sam_doc_numbers(doc, node, "focal_px", camera->focal, 2, true, 1, 1e7);
    sam_doc_numbers(doc, node, "center_px", camera->center, 2, false, -1e6, 1e6);
    sam_doc_numbers(doc, node, "distortion", camera->distortion, 5, false, -100, 100);
    sam_doc_numbers(doc, node, "vignetting", scene->sensor.vignetting, 3, false, -1, 1);
    scene->optics.blur = sam_doc_number(doc, node, "blur_px", 0, 0, 100);
    scene->optics.glare = sam_doc_number(doc, node, "glare", 0, 0, 0.5);
    scene->exif.focal_length = lens;
    scene->exif.aperture = sam_doc_number(doc, node, "aperture", 8, 0.1, 1000);
    scene->exif.iso = sam_doc_int(doc, node, "iso", 100, 1, 65535);
    copy_name(scene->exif.make, sam_doc_text(doc, node, "make", "goniocam"));
    copy_name(scene->exif.model, sam_doc_text(doc, node, "model", "render"));
}

/** "rggb" and other cells by rows, "xtrans"; a word of other letters or another length is none. */
static bool read_cfa(char cfa[CFA_SIZE], const char *word)
{
    static const char xtrans[] = "gbggrgrgrbgbgbggrggrggbgbgbrgrgrggbg";
    if (strcmp(word, "xtrans") == 0)
        word = xtrans;
    for (int i = 0; i < CFA_SIZE && (i == 0 || word[i - 1]); i++)
        cfa[i] = (char)toupper((unsigned char)word[i]);
    cfa[CFA_SIZE - 1] = '\0';
    return strlen(word) < CFA_SIZE && cap_cfa_is_valid(cfa);
}

/** What a real sensor has besides noise; all of it is off where nothing is said. */
static void read_blemishes(struct sensor_model *sensor, struct doc *doc, doc_node node)
{
    sensor->prnu = sam_doc_number(doc, node, "prnu", 0, 0, 0.2);
    sensor->hot_fraction = sam_doc_number(doc, node, "hot_fraction", 0, 0, 1);
    sensor->hot_rate = sam_doc_number(doc, node, "hot_rate", 5e4, 0, 1e9);
    sensor->time_error = sam_doc_number(doc, node, "time_error", 0, 0, 0.5);
    const char *mosaic = sam_doc_text(doc, node, "mosaic", "none");
    sensor->mosaic = strcmp(mosaic, "none") != 0;
    if (sensor->mosaic && !read_cfa(sensor->cfa, mosaic))
        sam_doc_wrong(doc, sam_doc_get(doc, node, "mosaic"),
                      "mosaic: a cell of r, g and b is wanted, as in rggb, or xtrans, or none");
}

static void read_sensor(struct sensor_model *sensor, struct doc *doc, doc_node node)
{
    sensor->electrons = sam_doc_number(doc, node, "electrons", 25e6, 1e-3, 1e15);
    sensor->dn_per_electron = sam_doc_number(doc, node, "dn_per_electron", 0.08, 1e-6, 1e6);
    sensor->full_well = sam_doc_number(doc, node, "full_well", 50000, 1, 1e9);
    sensor->read_noise = sam_doc_number(doc, node, "read_noise", 5, 0, 1e5);
    sensor->black_level = sam_doc_int(doc, node, "black_level", 128, 0, 65534);
    sensor->adc_max = sam_doc_int(doc, node, "adc_max", 4095, 1, 65535);
    for (int c = 0; c < 3; c++)
        sensor->channel_gain[c] = 1;
    sam_doc_numbers(doc, node, "channel_gain", sensor->channel_gain, 3, true, 1e-3, 1e3);
    read_blemishes(sensor, doc, node);
    if (sam_doc_fine(doc) && sensor->adc_max <= sensor->black_level)
        sam_doc_wrong(doc, node, "adc_max: must be above black_level");
}

static void read_format(struct scene *scene, struct doc *doc, doc_node root)
{
    static const char *const names[] = {"tiff", "jpeg", "dng", "png"};
    const char *name = sam_doc_text(doc, root, "files", "tiff");
    doc_node node = sam_doc_get(doc, root, "files");
    int format = 0;
    while (format < 4 && strcmp(names[format], name) != 0)
        format++;
    if (format == 4)
        sam_doc_wrong(doc, node, "files: tiff, png, jpeg or dng, not '%s'", name);
    else if (scene->sensor.mosaic != (format == PHOTO_DNG))
        sam_doc_wrong(doc, node ? node : root,
                      "files: a sensor with a mosaic writes dng, one without the others");
    scene->format = (enum photo_format)format;
}

static void read_tone(struct tone_curve *tone, struct doc *doc, doc_node root)
{
    doc_node node = sam_doc_get(doc, root, "response");
    if (!node)
        return;
    doc_node table = sam_doc_get(doc, node, "table");
    tone->gamma = table ? 0 : sam_doc_number(doc, node, "gamma", NAN, 0.2, 5);
    int count = sam_doc_count(doc, table);
    if (table && (count < 2 || count > TONES_MAX)) {
        sam_doc_wrong(doc, table, "table: 2 to %d numbers from 0 to 1", TONES_MAX);
        return;
    }
    tone->values = count;
    sam_doc_numbers(doc, node, "table", tone->value, count, false, 0, 1);
    for (int i = 1; i < count; i++)
        if (tone->value[i] <= tone->value[i - 1])
            sam_doc_wrong(doc, table, "table: brighter light must give larger numbers");
}

static bool read_exposures(struct scene *scene, struct doc *doc, doc_node root)
{
    doc_node list = sam_doc_need(doc, root, "exposures");
    int count = sam_doc_count(doc, list);
    scene->exposure = calloc((size_t)count + 1, sizeof *scene->exposure);
    if (!scene->exposure)
        return false;
    scene->exposures = count;
    if (count > 0)
        sam_doc_numbers(doc, root, "exposures", scene->exposure, count, false, 1e-7, 1e5);
    else if (sam_doc_fine(doc))
        sam_doc_wrong(doc, list, "exposures: at least one time is wanted");
    return true;
}

// ---- lamps

/** A unit vector, or an error that names the key. */
static vec3 read_direction(struct doc *doc, doc_node node, const char *key, vec3 fallback)
{
    vec3 v = sam_doc_vec3(doc, node, key, fallback);
    double length = vec3_length(v);
    if (length > 0)
        return vec3_scale(v, 1 / length);
    sam_doc_wrong(doc, node, "%s: a direction is wanted", key);
    return fallback;
}

/** Where a lamp is: a position, or a direction and distance from the sample; a distant one has
 *  only the direction. */
static void read_lamp_place(struct scene_lamp *lamp, struct doc *doc, doc_node node, vec3 center)
{
    lamp->kind = sam_doc_bool(doc, node, "distant", false) ? LAMP_DISTANT : LAMP_POINT;
    lamp->on_camera = sam_doc_bool(doc, node, "on_camera", false);
    lamp->position = center;
    if (sam_doc_get(doc, node, "position")) {
        lamp->position = sam_doc_vec3(doc, node, "position", center);
    } else if (sam_doc_get(doc, node, "direction") && lamp->kind == LAMP_DISTANT) {
        lamp->direction = read_direction(doc, node, "direction", (vec3){0, 0, 1});
        return;
    } else {
        double azimuth = sam_doc_number(doc, node, "azimuth_deg", NAN, -720, 720) * DEG;
        double elevation = sam_doc_number(doc, node, "elevation_deg", NAN, -180, 180) * DEG;
        double distance =
            lamp->kind == LAMP_DISTANT ? 1 : sam_doc_number(doc, node, "distance", NAN, 1e-3, 1e7);
        lamp->position = sam_around(center, azimuth, elevation, distance);
    }
    vec3 from_sample = vec3_sub(lamp->position, center);
    lamp->direction = vec3_length(from_sample) > 0 ? vec3_normalize(from_sample) : (vec3){0, 0, 1};
}

static void read_lamp(struct scene_lamp *lamp, int index, struct doc *doc, doc_node node,
                      vec3 center)
{
    char name[SCENE_NAME];
    snprintf(name, sizeof name, "lamp%d", index);
    copy_name(lamp->name, sam_doc_text(doc, node, "name", name));
    read_lamp_place(lamp, doc, node, center);
    lamp->radius = sam_doc_number(doc, node, "radius", 0, 0, 1e5);
    lamp->beam_exponent = sam_doc_number(doc, node, "beam_exponent", 0, 0, 1e4);
    vec3 ahead = lamp->on_camera ? (vec3){0, 0, 1} : vec3_scale(lamp->direction, -1);
    lamp->beam = read_direction(doc, node, "beam", ahead);
    for (int c = 0; c < 3; c++)
        lamp->intensity[c] = lamp->kind == LAMP_DISTANT ? 0.25 : 1e5;
    sam_doc_numbers(doc, node, "intensity", lamp->intensity, 3, true, 0, 1e15);
    if (lamp->kind == LAMP_DISTANT && (lamp->radius > 0 || lamp->on_camera))
        sam_doc_wrong(doc, node, "a distant lamp has no radius and is not on the camera");
}

static bool read_lamps(struct scene *scene, struct doc *doc, doc_node root)
{
    doc_node list = sam_doc_need(doc, root, "lights");
    int count = sam_doc_count(doc, list);
    scene->lamp = calloc((size_t)count + 1, sizeof *scene->lamp);
    if (!scene->lamp)
        return false;
    for (int i = 0; i < count; i++)
        read_lamp(&scene->lamp[i], i, doc, sam_doc_item(doc, list, i),
                  scene->sample.nominal.center);
    scene->lamps = count;
    if (sam_doc_fine(doc) && count == 0)
        sam_doc_wrong(doc, list, "lights: at least one is wanted");
    return true;
}

// ---- the sample

static void read_mesh(struct scene_sample *sample, struct doc *doc, doc_node node)
{
    const char *file = sam_doc_text(doc, node, "file", NULL);
    double scale = sam_doc_number(doc, node, "scale", 1, 1e-9, 1e9);
    vec3 rotation = vec3_scale(sam_doc_vec3(doc, node, "rotation_deg", (vec3){0, 0, 0}), DEG);
    vec3 center = sam_doc_vec3(doc, node, "center", (vec3){0, 0, 0});
    struct sample_place *place = &sample->place;
    struct error why = {0};
    *place = (struct sample_place){.shape = SHAPE_MESH, .center = center, .radius = 1};
    sam_doc_need(doc, node, "center");
    char *path = sam_doc_fine(doc) ? sam_doc_beside(doc, file) : NULL;
    pose turned = {rotation, {0, 0, 0}};
    if (path && cal_mesh_read(&sample->mesh, path, scale, turned, &why))
        sam_doc_wrong(doc, node, "file: %s", why.text);
    if (sample->mesh) {  // the middle of its box comes to `center`
        cal_mesh_reach(sample->mesh, &place->center, &place->radius);
        sample->world_from_file = (pose){rotation, vec3_sub(center, place->center)};
        cal_mesh_move(sample->mesh, sample->world_from_file.translation);
        place->center = center;
    }
    sample->file = path;
    sample->scale = scale;
}

static void read_sphere_or_cylinder(struct sample_place *place, struct doc *doc, doc_node node)
{
    place->radius = sam_doc_number(doc, node, "radius", NAN, 1e-6, 1e6);
    place->center = sam_doc_vec3(doc, node, "center", (vec3){0, 0, 2 * place->radius});
    if (place->shape == SHAPE_CYLINDER) {
        place->height = sam_doc_number(doc, node, "height", NAN, 1e-6, 1e6);
        place->axis = read_direction(doc, node, "axis", (vec3){0, 0, 1});
    }
}

static void read_flaws(struct flaws *flaws, struct doc *doc, doc_node node)
{
    flaws->spots = sam_doc_number(doc, node, "spots", 0, 0, 1);
    flaws->grain = sam_doc_number(doc, node, "grain", 0, 0, 1);
}

static void read_sample(struct scene_sample *sample, struct doc *doc, doc_node node)
{
    struct sample_place *place = &sample->place;
    const char *shape = sam_doc_text(doc, node, "shape", "sphere");
    place->shape = strcmp(shape, "sphere") == 0     ? SHAPE_SPHERE
                   : strcmp(shape, "cylinder") == 0 ? SHAPE_CYLINDER
                   : strcmp(shape, "mesh") == 0     ? SHAPE_MESH
                                                    : SHAPE_NONE;
    if (place->shape == SHAPE_NONE)
        sam_doc_wrong(doc, sam_doc_get(doc, node, "shape"),
                      "shape: sphere, cylinder or mesh, not '%s'", shape);
    else if (place->shape == SHAPE_MESH)
        read_mesh(sample, doc, node);
    else
        read_sphere_or_cylinder(place, doc, node);
    sample->nominal = *place;
    sample->nominal.center = sam_doc_vec3(doc, node, "nominal_center", place->center);
    sam_read_material(&sample->material, doc, sam_doc_need(doc, node, "material"), false);
    read_flaws(&sample->flaws, doc, sam_doc_get(doc, node, "flaws"));
}

// ---- the whole

/** Power of the lamp from shot to shot: a relative standard deviation about 1. */
static void jitter_powers(struct scene *scene, double sigma)
{
    for (int i = 0; i < scene->shots && sigma > 0; i++) {
        struct random random = sam_random_at(scene->seed, 0xFFFFFFFEu, (uint64_t)i);
        scene->shot[i].power *= fmax(0.1, 1 + sigma * sam_normal(&random));
    }
}

/** Camera and lamp of every shot stand outside of the sample, and the lamp above the board. */
static void check_places(const struct scene *scene, struct doc *doc)
{
    const struct sample_place *place = &scene->sample.place;
    doc_node shots = sam_doc_get(doc, sam_doc_root(doc), "shots");
    double reach =
        place->shape != SHAPE_CYLINDER ? place->radius : hypot(place->radius, place->height / 2);
    for (int i = 0; i < scene->shots; i++) {
        struct lighting light = sam_lighting(scene, &scene->shot[i]);
        vec3 from_eye = vec3_sub(cal_eye(scene->shot[i].view_from_world), place->center);
        vec3 from_lamp = vec3_sub(light.position, place->center);
        if (vec3_length(from_eye) <= reach)
            sam_doc_wrong(doc, shots, "shots: the camera of shot %d is inside the sample", i);
        if (light.kind == LAMP_POINT
            && (vec3_length(from_lamp) <= reach + light.radius || light.position.z <= light.radius))
            sam_doc_wrong(doc, shots, "shots: the lamp of shot %d is in the sample or the board",
                          i);
    }
}

static enum ambient_frames read_ambient_frames(struct doc *doc, doc_node root)
{
    if (strcmp(sam_doc_text(doc, root, "ambient_frame", "false"), "each") == 0)
        return AMBIENT_EACH;
    return sam_doc_bool(doc, root, "ambient_frame", false) ? AMBIENT_FIRST : AMBIENT_NONE;
}

static bool read_all(struct scene *scene, struct doc *doc)
{
    doc_node root = sam_doc_root(doc);
    if (sam_doc_int(doc, root, "goniocam_scene", 0, 0, 1000) != 1)
        sam_doc_wrong(doc, root, "'goniocam_scene: 1' is missing: the version of this format");
    copy_name(scene->name, sam_doc_text(doc, root, "name", "scene"));
    scene->seed = (uint64_t)sam_doc_number(doc, root, "seed", 1, 0, 1e15);
    read_camera(scene, doc, sam_doc_need(doc, root, "camera"));
    read_sensor(&scene->sensor, doc, sam_doc_get(doc, root, "sensor"));
    read_format(scene, doc, root);
    read_tone(&scene->tone, doc, root);
    sam_doc_text(doc, root, "materials", "");  // asked for where a material needs it
    read_sample(&scene->sample, doc, sam_doc_need(doc, root, "sample"));
    doc_node post = sam_doc_get(doc, root, "post");
    scene->post.radius = sam_doc_number(doc, post, "radius", 0, 0, 1e6);
    scene->post.albedo = sam_doc_number(doc, post, "albedo", 0.03, 0, 1);
    sam_read_things(&scene->things, doc, sam_doc_get(doc, root, "things"));
    scene->bounces = sam_doc_int(doc, root, "bounces", 0, 0, 2);
    if (scene->bounces && scene->sample.place.shape != SHAPE_SPHERE)
        sam_doc_wrong(doc, sam_doc_get(doc, root, "bounces"), "bounces: only around a sphere");
    scene->flat = sam_doc_bool(doc, root, "flat", false);
    scene->dark = sam_doc_bool(doc, root, "dark", false);
    scene->radiance = sam_doc_bool(doc, root, "radiance", false);
    scene->table = sam_doc_bool(doc, root, "table", false);
    sam_doc_numbers(doc, root, "ambient", scene->ambient, 3, true, 0, 1e9);
    scene->ambient_frames = read_ambient_frames(doc, root);
    bool memory = read_exposures(scene, doc, root) && read_lamps(scene, doc, root)
                  && sam_read_board(&scene->board, doc, sam_doc_need(doc, root, "board"))
                  && sam_read_patches(scene, doc, sam_doc_get(doc, root, "patch"));
    double jitter = sam_doc_number(doc, root, "power_jitter", 0, 0, 0.5);
    if (memory && sam_doc_fine(doc))
        memory = sam_read_shots(scene, doc);
    jitter_powers(scene, jitter);
    if (memory && sam_doc_fine(doc))
        check_places(scene, doc);
    return memory;
}

enum status sam_scene_read(struct scene *scene, const char *path, struct error *err)
{
    struct doc *doc;
    enum status status = sam_doc_open(&doc, path, err);
    if (status)
        return status;
    struct scene read = {0};
    bool memory = read_all(&read, doc);
    status = sam_doc_close(doc, err);
    if (!status && !memory)
        status = cap_fail(err, STATUS_MEMORY, "%s: out of memory", path);
    if (status)
        sam_scene_free(&read);
    else
        *scene = read;
    return status;
}

void sam_scene_free(struct scene *scene)
{
    free(scene->exposure);
    free(scene->lamp);
    sam_material_free(&scene->sample.material);
    cal_mesh_free(scene->sample.mesh);
    free(scene->sample.file);
    sam_things_free(&scene->things);
    free(scene->board.tag);
    free(scene->patch);
    free(scene->shot);
    *scene = (struct scene){0};
}
