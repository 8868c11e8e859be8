/* truth.c -- truth.json: everything that a scene knows and its photographs do not tell.
 *
 * Keys are those of the shared captures, so that one judge reads both.
 */
#include "truth.h"

#include "expose.h"
#include "light.h"

#include <jansson.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

static int digits_for(int count)
{
    int digits = 2;
    for (int limit = 100; count > limit && digits < 9; limit *= 10)
        digits++;
    return digits;
}

void sam_shot_name(char name[PHOTO_NAME], const struct scene *scene, int shot)
{
    snprintf(name, PHOTO_NAME, "shot%0*d", digits_for(scene->shots), shot);
}

void sam_photo_name(char name[PHOTO_NAME], const struct scene *scene, int shot, int exposure)
{
    char first[PHOTO_NAME];
    sam_shot_name(first, scene, shot);
    snprintf(name, PHOTO_NAME, "%.30s_exp%d", first, exposure);
}

const char *sam_photo_extension(const struct scene *scene)
{
    static const char *const names[] = {
        [PHOTO_TIFF] = "tif", [PHOTO_JPEG] = "jpg", [PHOTO_DNG] = "dng", [PHOTO_PNG] = "png"};
    return names[scene->format];
}

uint32_t sam_photo_frame(const struct scene *scene, int shot, int exposure)
{
    return (uint32_t)(shot * scene->exposures + exposure);
}

// ---- pieces of JSON; the library's setters accept NULL and fail, so memory is asked for once

static json_t *numbers(const double *value, int count)
{
    json_t *list = json_array();
    for (int i = 0; i < count; i++)
        json_array_append_new(list, json_real(value[i]));
    return list;
}

static json_t *point(vec3 p)
{
    return numbers((const double[]){p.x, p.y, p.z}, 3);
}

static json_t *conventions(void)
{
    return json_pack(
        "{s:s, s:s, s:s, s:s, s:s, s:s, s:s}", "world",
        "board frame, millimetres, right handed, x right, y away, z up out of the board, paper "
        "surface of the tags at z=0",
        "pose", "X_cam = R X_world + t, OpenCV camera frame: x right, y down, z forward", "pixels",
        "OpenCV: the centre of the top left pixel is (0,0); u = fx x' + cx with x' the distorted "
        "normalised coordinate",
        "distortion", "OpenCV order k1 k2 p1 p2 k3, distorted = f(undistorted)", "radiance",
        "linear; the lamp's jitter is in it; without vignetting and noise; pixel = area mean (box)",
        "light",
        "intensity I per steradian for each channel; irradiance on a surface = I cos / r^2, r in "
        "mm; L = f_r E",
        "tag_corners",
        "bottom left, bottom right, top right, top left of the outer edge of the "
        "black border (order of libapriltag's detection p[0..3])");
}

static json_t *camera(const struct camera *c)
{
    return json_pack("{s:i, s:i, s:f, s:f, s:f, s:f, s:o}", "width", c->width, "height", c->height,
                     "fx", c->focal[0], "fy", c->focal[1], "cx", c->center[0], "cy", c->center[1],
                     "dist", numbers(c->distortion, 5));
}

// As a point, a distant lamp is this far from the origin: its rays converge by 1e-8 over a board.
static const double FAR = 1e10;

/** A lamp as the judge knows lamps, a place and an intensity there; beside it what it really is. */
static json_t *light(const struct scene_lamp *lamp)
{
    bool distant = lamp->kind == LAMP_DISTANT;
    vec3 place = distant ? vec3_scale(lamp->direction, FAR) : lamp->position;
    double intensity[3];
    for (int c = 0; c < 3; c++)
        intensity[c] = lamp->intensity[c] * (distant ? FAR * FAR : 1);
    json_t *map = json_pack("{s:s, s:s, s:s, s:o, s:o, s:f}", "name", lamp->name, "kind",
                            distant ? "distant" : "point", "frame",
                            lamp->on_camera ? "camera" : "world", "position", point(place),
                            "intensity", numbers(intensity, 3), "radius", lamp->radius);
    if (distant) {
        json_object_set_new(map, "direction", point(lamp->direction));
        json_object_set_new(map, "irradiance", numbers(lamp->intensity, 3));
    }
    if (lamp->beam_exponent > 0) {
        json_object_set_new(map, "beam", point(lamp->beam));
        json_object_set_new(map, "beam_exponent", json_real(lamp->beam_exponent));
    }
    return map;
}

static json_t *lights(const struct scene *scene)
{
    json_t *list = json_array();
    for (int i = 0; i < scene->lamps; i++)
        json_array_append_new(list, light(&scene->lamp[i]));
    return list;
}

/** The lamps' radii, which the shared captures list under `render`. */
static json_t *radii(const struct scene *scene)
{
    json_t *list = json_array();
    for (int i = 0; i < scene->lamps; i++)
        json_array_append_new(list, json_real(scene->lamp[i].radius));
    return list;
}

// ---- the material, in the judge's words where it has them

/** Where a parameter of a model begins; NULL: it has none of that name. */
static const double *parameter(const struct material_part *part, const char *name)
{
    const double *value = part->parameter;
    for (const struct parameter *p = part->model->parameter; p->name; p++) {
        if (strcmp(p->name, name) == 0)
            return value;
        value += p->size;
    }
    return NULL;
}

// A lobe of constant colour beside a matt part is the judge's mix, of one half each.
static const double MIX = 0.5;

/** The type by which the judge knows the material; NULL: it does not. */
static const char *judge_type(const struct material_part *part)
{
    const char *name = part->model->name;
    const double *albedo = parameter(part, "albedo"), *edge = parameter(part, "edge");
    bool constant = edge && edge[0] == 0;
    bool lobe_only = albedo && albedo[0] + albedo[1] + albedo[2] == 0;
    if (strcmp(name, "lambert") == 0)
        return "lambert";
    if (strcmp(name, "ggx") == 0)
        return "plastic";
    if (constant && strcmp(name, "ggx_schlick") == 0)
        return lobe_only ? "ggx" : "mix";
    if (constant && strcmp(name, "beckmann_schlick") == 0)
        return lobe_only ? "beckmann" : "mix";
    return NULL;
}

static json_t *scaled(const double *colour, double factor)
{
    return numbers((const double[]){colour[0] * factor, colour[1] * factor, colour[2] * factor}, 3);
}

/** What the judge calls by other names, over the model's own. */
static void add_judge_keys(json_t *map, const struct material_part *part, const char *type)
{
    const double *f0 = parameter(part, "f0");
    if (!f0)
        return;
    bool mix = strcmp(type, "mix") == 0;
    json_object_set_new(map, "color", scaled(f0, mix ? 1 / MIX : 1));
    if (mix) {
        json_object_set_new(map, "albedo", scaled(parameter(part, "albedo"), 1 / (1 - MIX)));
        json_object_set_new(map, "factor", json_real(MIX));
        bool ggx = strncmp(part->model->name, "ggx", 3) == 0;
        json_object_set_new(map, "distribution", json_string(ggx ? "ggx" : "beckmann"));
    }
}

/** Every parameter under its own name, then as the judge wants it. A table's values are in
 *  truth.binary, when the scene asks for it. */
static json_t *material_part(const struct material_part *part)
{
    static const double one[3] = {1, 1, 1};
    json_t *map = json_object();
    bool whole = memcmp(part->scale, one, sizeof one) == 0;
    const char *type = part->model && whole ? judge_type(part) : NULL;
    json_object_set_new(map, "type", json_string(type ? type : part->model ? "model" : "table"));
    if (!whole)
        json_object_set_new(map, "scale", numbers(part->scale, 3));
    if (!part->model)
        return map;
    const double *value = part->parameter;
    json_object_set_new(map, "model", json_string(part->model->name));
    for (const struct parameter *p = part->model->parameter; p->name; p++) {
        json_object_set_new(map, p->name, p->size == 1 ? json_real(*value) : numbers(value, 3));
        value += p->size;
    }
    if (type)
        add_judge_keys(map, part, type);
    return map;
}

static json_t *material(const struct material *m)
{
    if (m->parts == 1 && !sam_material_mirrors(m))
        return material_part(&m->part[0]);
    json_t *parts = json_array();
    for (int i = 0; i < m->parts; i++)
        json_array_append_new(parts, material_part(&m->part[i]));
    return json_pack("{s:s, s:o, s:o}", "type", "sum", "parts", parts, "mirror",
                     numbers(m->mirror, 3));
}

static json_t *sample(const struct scene_sample *s)
{
    static const char *const kinds[] = {
        [SHAPE_SPHERE] = "sphere", [SHAPE_CYLINDER] = "cylinder", [SHAPE_MESH] = "mesh"};
    json_t *map = json_pack("{s:s, s:o, s:f, s:o}", "kind", kinds[s->place.shape], "center",
                            point(s->place.center), "radius", s->place.radius, "material",
                            material(&s->material));
    if (s->place.shape == SHAPE_CYLINDER) {
        json_object_set_new(map, "axis", point(s->place.axis));
        json_object_set_new(map, "length", json_real(s->place.height));
    }
    if (s->mesh) {
        json_object_set_new(map, "file", json_string(sam_mesh_name(s)));
        json_object_set_new(map, "scale", json_real(s->scale));
        json_object_set_new(map, "triangles", json_integer(cal_mesh_triangles(s->mesh)));
    }
    return map;
}

static json_t *things(const struct things *list)
{
    static const char *const names[] = {"ball", "cylinder", "box"};
    json_t *all = json_array();
    for (int i = 0; i < list->count; i++) {
        const struct thing *t = &list->item[i];
        json_t *map =
            json_pack("{s:s, s:o}", "kind", names[t->shape], "material", material(&t->material));
        if (t->shape == THING_BOX) {
            json_object_set_new(map, "center", point(t->box.center));
            json_object_set_new(map, "x_axis", point(t->box.axis[0]));
            json_object_set_new(map, "half_size", numbers(t->box.half, 3));
        } else {
            json_object_set_new(map, "center", point(t->rod.center));
            json_object_set_new(map, "radius", json_real(t->rod.radius));
        }
        if (t->shape == THING_ROD) {
            json_object_set_new(map, "axis", point(t->rod.axis));
            json_object_set_new(map, "length", json_real(2 * t->rod.half));
        }
        json_array_append_new(all, map);
    }
    return all;
}

// ---- board, patches, sensor

static json_t *tags(const struct scene_board *board)
{
    json_t *list = json_array();
    for (int i = 0; i < board->tags; i++) {
        json_t *corners = json_array();
        for (int k = 0; k < 4; k++)
            json_array_append_new(corners, point(cap_tag_corner(&board->tag[i], k)));
        json_array_append_new(list, json_pack("{s:i, s:s, s:f, s:o}", "id", board->tag[i].id,
                                              "family", board->family, "size", board->tag[i].size,
                                              "corners", corners));
    }
    return list;
}

static json_t *patches(const struct scene *scene)
{
    json_t *list = json_array();
    for (int i = 0; i < scene->patches; i++) {
        const struct scene_patch *patch = &scene->patch[i];
        json_t *corners = json_array();
        for (int k = 0; k < 4; k++)
            json_array_append_new(corners, point(patch->patch.corner[k]));
        json_array_append_new(list, json_pack("{s:o, s:f, s:f}", "corners", corners, "albedo",
                                              patch->patch.albedo, "thickness", patch->thickness));
    }
    return list;
}

static json_t *sensor(const struct sensor_model *s)
{
    return json_pack(
        "{s:f, s:f, s:f, s:f, s:i, s:i, s:o, s:o, s:f, s:f, s:f, s:s}",
        "electrons_per_radiance_second", s->electrons, "dn_per_electron", s->dn_per_electron,
        "full_well", s->full_well, "read_noise_e", s->read_noise, "black_level", s->black_level,
        "adc_max", s->adc_max, "channel_gain", numbers(s->channel_gain, 3), "vignetting",
        numbers(s->vignetting, 3), "prnu", s->prnu, "hot_fraction", s->hot_fraction, "hot_rate_e",
        s->hot_rate, "model",
        "DN = clip(round(black + (min(Poisson(L channel_gain k t V), full_well) + read_noise "
        "N(0,1)) dn_per_electron), 0, adc_max); V = 1 + v1 q + v2 q^2 + v3 q^3, q = |pixel - "
        "(cx,cy)|^2 / ((width/2)^2 + (height/2)^2)");
}

// ---- shots

static json_t *exposures(const struct scene *scene, int shot)
{
    json_t *list = json_array();
    for (int e = 0; e < scene->exposures; e++) {
        char name[PHOTO_NAME];
        sam_photo_name(name, scene, shot, e);
        json_array_append_new(list,
                              json_pack("{s:s, s:f}", "file", name, "time", scene->exposure[e]));
    }
    return list;
}

/** Where a shot's lamp is, or would be if it were a point. */
static vec3 lamp_place(const struct lighting *light)
{
    return light->kind == LAMP_DISTANT ? vec3_scale(light->direction, FAR) : light->position;
}

/** The angle between lamp and camera, seen from the sample. */
static double phase_deg(const struct scene *scene, vec3 lamp, vec3 eye)
{
    vec3 center = scene->sample.place.center;
    vec3 a = vec3_sub(lamp, center), b = vec3_sub(eye, center);
    return atan2(vec3_length(vec3_cross(a, b)), vec3_dot(a, b)) * 180 / CAP_PI;
}

static json_t *shot(const struct scene *scene, int index)
{
    const struct scene_shot *s = &scene->shot[index];
    struct lighting light = sam_lighting(scene, s);
    mat3 r = cal_rotation(s->view_from_world.rotation);
    vec3 eye = cal_eye(s->view_from_world), lamp = lamp_place(&light);
    for (int c = 0; c < 3 && light.kind == LAMP_DISTANT; c++)
        light.intensity[c] *= FAR * FAR;
    json_t *rows = json_array();
    for (int i = 0; i < 3; i++)
        json_array_append_new(rows, numbers(r.m[i], 3));
    json_t *map =
        json_pack("{s:i, s:o, s:o, s:o, s:i, s:o, s:o, s:f, s:f}", "index", index, "R", rows, "t",
                  point(s->view_from_world.translation), "eye", point(eye), "light", s->lamp,
                  "light_position", point(lamp), "light_intensity", numbers(light.intensity, 3),
                  "light_jitter", s->power, "phase_deg", phase_deg(scene, lamp, eye));
    if (scene->radiance) {
        char name[PHOTO_NAME];
        sam_shot_name(name, scene, index);
        json_object_set_new(map, "radiance", json_sprintf("radiance/%s.exr", name));
    }
    json_object_set_new(map, "exposures", exposures(scene, index));
    return map;
}

static json_t *truth(const struct scene *scene)
{
    const struct scene_board *board = &scene->board;
    json_t *shots = json_array();
    for (int i = 0; i < scene->shots; i++)
        json_array_append_new(shots, shot(scene, i));
    return json_pack("{s:s, s:I, s:o, s:o, s:{s:i, s:o}, s:o, s:o, s:{s:o, s:f, s:f, s:f},"
                     " s:{s:f, s:f}, s:{s:f, s:f}, s:[], s:o, s:o, s:o, s:o, s:o, s:o}",
                     "name", scene->name, "seed", (json_int_t)scene->seed, "conventions",
                     conventions(), "camera", camera(&scene->camera), "render", "max_bounces",
                     scene->bounces, "light_radius_mm", radii(scene), "lights", lights(scene),
                     "sample", sample(&scene->sample), "board", "size", numbers(board->size, 2),
                     "albedo", board->albedo, "margin", board->margin, "paper_thickness",
                     board->thickness, "paper", "white", board->white, "black", board->black,
                     "post", "radius", scene->post.radius, "albedo", scene->post.albedo, "panels",
                     "things", things(&scene->things), "tags", tags(board), "white_patches",
                     patches(scene), "sensor", sensor(&scene->sensor), "exposure_times",
                     numbers(scene->exposure, scene->exposures), "shots", shots);
}

enum status sam_truth_write(const struct scene *scene, const char *path, struct error *err)
{
    json_t *root = truth(scene);
    char *text = root ? json_dumps(root, JSON_INDENT(1) | JSON_REAL_PRECISION(17)) : NULL;
    struct atomic_file file;
    enum status status = STATUS_OK;
    if (!text) {
        status = cap_fail(err, STATUS_MEMORY, "%s: out of memory", path);
    } else if (!(status = cap_file_begin(&file, path, true, err))) {
        fputs(text, file.stream);
        fputc('\n', file.stream);
        status = cap_file_commit(&file, err);
    }
    free(text);
    json_decref(root);
    return status;
}
