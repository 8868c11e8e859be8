/* calibration_read.c -- calibration.yaml, read: libcyaml checks it against a schema and fills plain
 * nodes, which become a struct calibration; cameras and lights are found by name. */
#include "calib.h"

#include <cyaml/cyaml.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

// ---- the schema

struct shot_node {
    char *name, *camera, *light;
    double rotation[3], translation[3], sigma_rotation[3], sigma_translation[3];
    double power, sigma_power, rms_px, blur_px, glare[GLARE_TERMS], sigma_glare;
    struct seen_tag *tag;
    int tags;
};
struct cue_node {
    enum cue cue;
    double direction[3], sigma_direction, distance, sigma_distance;
};
struct light_node {
    char *name, *frame;
    double *position, *direction, *intensity, *irradiance;  // [3] each, or NULL
    double *beam_axis, beam_falloff[2], sigma_beam[2];
    double radius, sigma_radius, sigma_position[3], sigma_direction[3], sigma_intensity[3],
        sigma_irradiance[3];
    double covariance[16];
    struct cue_node *cue;
    int cues;
};
struct sample_node {
    enum shape shape;
    char *file;
    double rotation[3], translation[3];
    double radius, height, center[3], axis[3], sigma_center[3], sigma_radius, sigma_turn[3],
        outline_rms_px;
    int outline_edges;
};
struct board_tag_node {
    int id, shots;
    double size, center[3], x_axis[3], y_axis[3], sigma_center[3], sigma_turn[3], rms_px;
};
struct board_node {
    char *family;
    struct board_tag_node *tag;
    int tags;
};
struct root_node {
    int goniocam;
    struct camera *camera;
    struct shot_node *shot;
    struct light_node *light;
    struct sample_node *sample, *ball;
    struct board_node *board;
    int cameras, shots, lights, balls;
};

enum { NEED = CYAML_FLAG_DEFAULT, MAY = CYAML_FLAG_OPTIONAL };

// clang-format off: a table of keys reads best with one key a line
#define NUMBER(flags, type, key) CYAML_FIELD_FLOAT(#key, flags, struct type, key)
#define NUMBERS(flags, type, key, count)                                                           \
    CYAML_FIELD_SEQUENCE_FIXED(#key, flags, struct type, key, &number, count)
#define VECTOR(type, key)                                                                          \
    CYAML_FIELD_SEQUENCE_FIXED(#key, CYAML_FLAG_OPTIONAL | CYAML_FLAG_POINTER, struct type, key,   \
                               &number, 3)
#define TEXT(flags, type, key)                                                                     \
    CYAML_FIELD_STRING_PTR(#key, (flags) | CYAML_FLAG_POINTER, struct type, key, 1, CYAML_UNLIMITED)
#define LIST(key, flags, type, member, entry)                                                      \
    CYAML_FIELD_SEQUENCE_COUNT(key, (flags) | CYAML_FLAG_POINTER, struct type, member, member##s,  \
                               entry, 0, CYAML_UNLIMITED)

static const cyaml_schema_value_t number = {CYAML_VALUE_FLOAT(CYAML_FLAG_DEFAULT, double)};
static const cyaml_schema_value_t corner = {
    CYAML_VALUE_SEQUENCE_FIXED(CYAML_FLAG_DEFAULT, double, &number, 2)};

static const cyaml_schema_field_t camera_fields[] = {
    TEXT(NEED, camera, name),
    CYAML_FIELD_INT("width", NEED, struct camera, width),
    CYAML_FIELD_INT("height", NEED, struct camera, height),
    NUMBERS(NEED, camera, focal, 2),
    NUMBERS(NEED, camera, center, 2),
    NUMBERS(MAY, camera, distortion, 5),
    NUMBERS(MAY, camera, vignetting, 2),
    NUMBERS(MAY, camera, sigma_focal, 2),
    NUMBERS(MAY, camera, sigma_center, 2),
    NUMBERS(MAY, camera, sigma_distortion, 5),
    NUMBER(MAY, camera, rms_px),
    CYAML_FIELD_END};
static const cyaml_schema_field_t tag_fields[] = {
    CYAML_FIELD_INT("id", NEED, struct seen_tag, id),
    CYAML_FIELD_SEQUENCE_FIXED("corners", NEED, struct seen_tag, corner, &corner, 4),
    CYAML_FIELD_END};
static const cyaml_schema_value_t tag_value = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct seen_tag, tag_fields)};
static const cyaml_schema_field_t shot_fields[] = {TEXT(NEED, shot_node, name),
                                                   TEXT(NEED, shot_node, camera),
                                                   TEXT(MAY, shot_node, light),
                                                   NUMBERS(NEED, shot_node, rotation, 3),
                                                   NUMBERS(NEED, shot_node, translation, 3),
                                                   NUMBERS(MAY, shot_node, sigma_rotation, 3),
                                                   NUMBERS(MAY, shot_node, sigma_translation, 3),
                                                   NUMBER(MAY, shot_node, power),
                                                   NUMBER(MAY, shot_node, sigma_power),
                                                   NUMBER(MAY, shot_node, rms_px),
                                                   NUMBER(MAY, shot_node, blur_px),
                                                   NUMBERS(MAY, shot_node, glare, GLARE_TERMS),
                                                   NUMBER(MAY, shot_node, sigma_glare),
                                                   LIST("tags", MAY, shot_node, tag, &tag_value),
                                                   CYAML_FIELD_END};
static const cyaml_strval_t cue_names[] = {{"board", CUE_BOARD},
                                           {"sample", CUE_SAMPLE},
                                           {"highlight", CUE_HIGHLIGHT},
                                           {"shadow", CUE_SHADOW},
                                           {"ball", CUE_BALL}};
static const cyaml_schema_field_t cue_fields[] = {CYAML_FIELD_ENUM("cue", CYAML_FLAG_STRICT,
                                                                   struct cue_node, cue, cue_names,
                                                                   CYAML_ARRAY_LEN(cue_names)),
                                                  NUMBERS(NEED, cue_node, direction, 3),
                                                  NUMBER(NEED, cue_node, sigma_direction),
                                                  NUMBER(MAY, cue_node, distance),
                                                  NUMBER(MAY, cue_node, sigma_distance),
                                                  CYAML_FIELD_END};
static const cyaml_schema_value_t cue_value = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct cue_node, cue_fields)};
static const cyaml_schema_field_t light_fields[] = {TEXT(NEED, light_node, name),
                                                    TEXT(MAY, light_node, frame),
                                                    VECTOR(light_node, position),
                                                    VECTOR(light_node, direction),
                                                    VECTOR(light_node, intensity),
                                                    VECTOR(light_node, irradiance),
                                                    NUMBER(MAY, light_node, radius),
                                                    NUMBER(MAY, light_node, sigma_radius),
                                                    VECTOR(light_node, beam_axis),
                                                    NUMBERS(MAY, light_node, beam_falloff, 2),
                                                    NUMBERS(MAY, light_node, sigma_beam, 2),
                                                    NUMBERS(MAY, light_node, sigma_position, 3),
                                                    NUMBERS(MAY, light_node, sigma_direction, 3),
                                                    NUMBERS(MAY, light_node, sigma_intensity, 3),
                                                    NUMBERS(MAY, light_node, covariance, 16),
                                                    NUMBERS(MAY, light_node, sigma_irradiance, 3),
                                                    LIST("cues", MAY, light_node, cue, &cue_value),
                                                    CYAML_FIELD_END};
static const cyaml_strval_t shapes[] = {
    {"sphere", SHAPE_SPHERE}, {"cylinder", SHAPE_CYLINDER}, {"mesh", SHAPE_MESH}};
static const cyaml_schema_field_t sample_fields[] = {
    CYAML_FIELD_ENUM("shape", CYAML_FLAG_STRICT, struct sample_node, shape, shapes,
                     CYAML_ARRAY_LEN(shapes)),
    NUMBERS(NEED, sample_node, center, 3),
    NUMBER(MAY, sample_node, radius),
    NUMBER(MAY, sample_node, height),
    NUMBERS(MAY, sample_node, axis, 3),
    TEXT(MAY, sample_node, file),
    NUMBERS(MAY, sample_node, rotation, 3),
    NUMBERS(MAY, sample_node, translation, 3),
    NUMBERS(MAY, sample_node, sigma_center, 3),
    NUMBER(MAY, sample_node, sigma_radius),
    NUMBERS(MAY, sample_node, sigma_turn, 3),
    NUMBER(MAY, sample_node, outline_rms_px),
    CYAML_FIELD_INT("outline_edges", MAY, struct sample_node, outline_edges),
    CYAML_FIELD_END};
static const cyaml_schema_field_t board_tag_fields[] = {
    CYAML_FIELD_INT("id", NEED, struct board_tag_node, id),
    NUMBER(NEED, board_tag_node, size),
    NUMBERS(NEED, board_tag_node, center, 3),
    NUMBERS(NEED, board_tag_node, x_axis, 3),
    NUMBERS(NEED, board_tag_node, y_axis, 3),
    NUMBERS(MAY, board_tag_node, sigma_center, 3),
    NUMBERS(MAY, board_tag_node, sigma_turn, 3),
    CYAML_FIELD_INT("shots", MAY, struct board_tag_node, shots),
    NUMBER(MAY, board_tag_node, rms_px),
    CYAML_FIELD_END};
static const cyaml_schema_value_t board_tag_value = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct board_tag_node, board_tag_fields)};
static const cyaml_schema_field_t board_fields[] = {
    TEXT(NEED, board_node, family), LIST("tags", NEED, board_node, tag, &board_tag_value),
    CYAML_FIELD_END};
static const cyaml_schema_value_t camera_value = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct camera, camera_fields)};
static const cyaml_schema_value_t shot_value = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct shot_node, shot_fields)};
static const cyaml_schema_value_t light_value = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct light_node, light_fields)};
static const cyaml_schema_value_t ball_value = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct sample_node, sample_fields)};
static const cyaml_schema_field_t root_fields[] = {
    CYAML_FIELD_INT("goniocam", MAY, struct root_node, goniocam),
    LIST("cameras", NEED, root_node, camera, &camera_value),
    LIST("shots", NEED, root_node, shot, &shot_value),
    LIST("lights", NEED, root_node, light, &light_value),
    CYAML_FIELD_MAPPING_PTR("sample", CYAML_FLAG_OPTIONAL | CYAML_FLAG_POINTER, struct root_node,
                            sample, sample_fields),
    LIST("balls", MAY, root_node, ball, &ball_value),
    CYAML_FIELD_MAPPING_PTR("board", CYAML_FLAG_OPTIONAL | CYAML_FLAG_POINTER, struct root_node,
                            board, board_fields),
    CYAML_FIELD_END};
static const cyaml_schema_value_t root_value = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_POINTER, struct root_node, root_fields)};
// clang-format on

// ---- from nodes to the calibration

static vec3 vec3_of(const double v[3])
{
    return (vec3){v[0], v[1], v[2]};
}

// Take a string from a node, which forgets it.
static char *take(char **text)
{
    char *taken = *text;
    *text = NULL;
    return taken;
}

static enum status take_cameras(struct calibration *c, struct root_node *root, struct error *err)
{
    c->camera = calloc((size_t)root->cameras + 1, sizeof *c->camera);
    if (!c->camera)
        return cap_fail(err, STATUS_MEMORY, "%d cameras", root->cameras);
    for (int i = 0; i < root->cameras; i++) {
        struct camera *camera = root->camera + i;
        bool sound =
            camera->width > 0 && camera->height > 0 && camera->focal[0] > 0 && camera->focal[1] > 0;
        if (!sound)
            return cap_fail(err, STATUS_FORMAT,
                            "camera %s: width, height and focal must be above 0", camera->name);
        c->camera[c->cameras] = *camera;
        c->camera[c->cameras++].name = take(&camera->name);
    }
    return STATUS_OK;
}

static enum status take_light(struct lamp *lamp, struct light_node *node, struct error *err)
{
    bool point = node->position && node->intensity && !node->direction && !node->irradiance;
    bool distant = node->direction && node->irradiance && !node->position && !node->intensity;
    if (!point && !distant)
        return cap_fail(err, STATUS_FORMAT,
                        "light %s: wants position and intensity, or direction and irradiance",
                        node->name);
    if (node->frame && strcmp(node->frame, "world") != 0 && strcmp(node->frame, "camera") != 0)
        return cap_fail(err, STATUS_FORMAT, "light %s: frame is world or camera, not '%s'",
                        node->name, node->frame);
    if (!(node->radius >= 0) || (distant && node->radius > 0))
        return cap_fail(err, STATUS_FORMAT,
                        "light %s: only a point has a radius, which is positive", node->name);
    *lamp = (struct lamp){.at_infinity = distant,
                          .on_camera = node->frame && strcmp(node->frame, "camera") == 0};
    if (point) {
        lamp->position = vec3_of(node->position);
        lamp->radius = node->radius;
        lamp->sigma_radius = node->sigma_radius;
        if (node->beam_axis && node->beam_falloff[1] > 0)
            lamp->beam =
                (struct beam){vec3_of(node->beam_axis), node->beam_falloff[0],
                              node->beam_falloff[1], node->sigma_beam[0], node->sigma_beam[1]};
    } else {
        vec3 direction = vec3_of(node->direction);
        if (!(vec3_length(direction) > 0))
            return cap_fail(err, STATUS_FORMAT, "light %s: a direction of no length", node->name);
        // What is unit to rounding stays as it is, so that a file read is a file written.
        lamp->direction =
            fabs(vec3_length(direction) - 1) < 1e-12 ? direction : vec3_normalize(direction);
    }
    memcpy(lamp->intensity, point ? node->intensity : node->irradiance, sizeof lamp->intensity);
    memcpy(lamp->sigma_position, node->sigma_position, sizeof lamp->sigma_position);
    memcpy(lamp->sigma_direction, node->sigma_direction, sizeof lamp->sigma_direction);
    memcpy(lamp->sigma_intensity, point ? node->sigma_intensity : node->sigma_irradiance,
           sizeof lamp->sigma_intensity);
    memcpy(lamp->covariance, node->covariance, sizeof lamp->covariance);
    for (int i = 0; i < node->cues; i++) {
        const struct cue_node *cue = node->cue + i;
        lamp->cue[cue->cue] = (struct lamp_cue){vec3_of(cue->direction), cue->sigma_direction,
                                                cue->distance, cue->sigma_distance};
    }
    lamp->name = take(&node->name);
    return STATUS_OK;
}

static enum status take_lights(struct calibration *c, struct root_node *root, struct error *err)
{
    c->lamp = calloc((size_t)root->lights + 1, sizeof *c->lamp);
    if (!c->lamp)
        return cap_fail(err, STATUS_MEMORY, "%d lights", root->lights);
    enum status status = STATUS_OK;
    for (int i = 0; !status && i < root->lights; i++) {
        status = take_light(c->lamp + c->lamps, root->light + i, err);
        c->lamps += !status;
    }
    return status;
}

static int find_camera(const struct calibration *c, const char *name)
{
    int i = 0;
    while (i < c->cameras && strcmp(c->camera[i].name, name) != 0)
        i++;
    return i < c->cameras ? i : -1;
}

static int find_lamp(const struct calibration *c, const char *name)
{
    int i = 0;
    while (i < c->lamps && strcmp(c->lamp[i].name, name) != 0)
        i++;
    return i < c->lamps ? i : -1;
}

static enum status take_shot(struct calibration *c, struct shot_node *node, struct error *err)
{
    struct view v = {.camera = find_camera(c, node->camera),
                     .light = node->light ? find_lamp(c, node->light) : -1,
                     .view_from_world = {vec3_of(node->rotation), vec3_of(node->translation)},
                     .power = node->power > 0 ? node->power : 1,
                     .sigma_power = node->sigma_power,
                     .rms_px = node->rms_px,
                     .blur_px = node->blur_px};
    if (v.camera < 0)
        return cap_fail(err, STATUS_FORMAT, "shot %s: no camera is called '%s'", node->name,
                        node->camera);
    if (node->light && v.light < 0)
        return cap_fail(err, STATUS_FORMAT, "shot %s: no light is called '%s'", node->name,
                        node->light);
    double veil = 0;
    for (int k = 0; k < GLARE_TERMS; k++)
        veil += node->glare[k] >= 0 ? node->glare[k] : INFINITY;
    if (!(veil < 0.5))
        return cap_fail(err, STATUS_FORMAT,
                        "shot %s: glare: shares of light are not below 0 and add up to less than "
                        "0.5",
                        node->name);
    v.sigma_glare = node->sigma_glare;
    memcpy(v.glare, node->glare, sizeof v.glare);
    memcpy(v.sigma_rotation, node->sigma_rotation, sizeof v.sigma_rotation);
    memcpy(v.sigma_translation, node->sigma_translation, sizeof v.sigma_translation);
    if (node->tags > 0 && !(v.tag = malloc((size_t)node->tags * sizeof *v.tag)))
        return cap_fail(err, STATUS_MEMORY, "shot %s: %d tags", node->name, node->tags);
    if (node->tags > 0)
        memcpy(v.tag, node->tag, (size_t)node->tags * sizeof *v.tag);
    v.tags = node->tags;
    v.name = take(&node->name);
    c->view[c->views++] = v;
    return STATUS_OK;
}

static enum status take_shots(struct calibration *c, struct root_node *root, struct error *err)
{
    c->view = calloc((size_t)root->shots + 1, sizeof *c->view);
    if (!c->view)
        return cap_fail(err, STATUS_MEMORY, "%d shots", root->shots);
    enum status status = STATUS_OK;
    for (int i = 0; !status && i < root->shots; i++)
        status = take_shot(c, root->shot + i, err);
    return status;
}

static enum status take_sample(struct sample *sample, struct sample_node *s, struct error *err)
{
    if (!s)
        return STATUS_OK;
    if (s->shape != SHAPE_MESH && !(s->radius > 0))
        return cap_fail(err, STATUS_FORMAT, "sample: radius must be above 0");
    *sample = (struct sample){.shape = s->shape,
                              .radius = s->radius,
                              .height = s->height,
                              .center = vec3_of(s->center),
                              .axis = vec3_of(s->axis),
                              .sigma_radius = s->sigma_radius,
                              .outline_rms_px = s->outline_rms_px,
                              .outline_edges = s->outline_edges};
    memcpy(sample->sigma_center, s->sigma_center, sizeof s->sigma_center);
    memcpy(sample->sigma_turn, s->sigma_turn, sizeof s->sigma_turn);
    if (s->shape != SHAPE_MESH)
        return STATUS_OK;
    sample->file = take(&s->file);
    sample->world_from_file = (pose){vec3_of(s->rotation), vec3_of(s->translation)};
    return cal_sample_load(sample, err);
}

static enum status take_balls(struct calibration *c, struct root_node *root, struct error *err)
{
    enum status status = STATUS_OK;
    for (int i = 0; i < root->balls && !status; i++) {
        if (i == BALLS_MAX || root->ball[i].shape != SHAPE_SPHERE)
            return cap_fail(err, STATUS_FORMAT, "balls: at most %d, and spheres", BALLS_MAX);
        status = take_sample(&c->ball[c->balls++], &root->ball[i], err);
    }
    return status;
}

static enum status take_board(struct calibration *c, struct root_node *root, struct error *err)
{
    struct board_node *board = root->board;
    if (!board)
        return STATUS_OK;
    c->family = take(&board->family);
    c->tag = calloc((size_t)board->tags + 1, sizeof *c->tag);
    if (!c->tag)
        return cap_fail(err, STATUS_MEMORY, "%d tags", board->tags);
    for (int i = 0; i < board->tags; i++) {
        const struct board_tag_node *node = board->tag + i;
        struct board_tag *tag = c->tag + c->tags++;
        tag->place = (struct tag_place){.id = node->id,
                                        .size = node->size,
                                        .center = vec3_of(node->center),
                                        .x_axis = vec3_of(node->x_axis),
                                        .y_axis = vec3_of(node->y_axis)};
        memcpy(tag->sigma_center, node->sigma_center, sizeof tag->sigma_center);
        memcpy(tag->sigma_turn, node->sigma_turn, sizeof tag->sigma_turn);
        tag->views = node->shots;
        tag->rms_px = node->rms_px;
        if (!(node->size > 0))
            return cap_fail(err, STATUS_FORMAT, "board: tag %d: size must be above 0", node->id);
    }
    return STATUS_OK;
}

// ---- reading

// What libcyaml complains of: its first message, and of the backtrace that follows, innermost place
// first, the first line and the first key.
struct complaint {
    char what[320], key[80];
    unsigned line;
};

static void keep_complaint(cyaml_log_t level, void *context, const char *format, va_list args)
{
    (void)level;
    struct complaint *c = context;
    char message[300], key[sizeof c->key];
    vsnprintf(message, sizeof message, format, args);
    message[strcspn(message, "\n")] = '\0';
    const char *place = strstr(message, "(line: ");
    if (!place && !*c->what && strncmp(message, "Load: ", 6) == 0)
        snprintf(c->what, sizeof c->what, "%s", message + 6);
    if (place && c->line == 0)
        c->line = (unsigned)strtoul(place + 7, NULL, 10);
    if (place && !*c->key && sscanf(message, " in mapping field '%79[^']'", key) == 1)
        snprintf(c->key, sizeof c->key, "%s", key);
}

static enum status tell(struct error *err, const char *path, const struct complaint *c,
                        cyaml_err_t result)
{
    char line[40] = "";
    if (c->line > 0)
        snprintf(line, sizeof line, "line %u: ", c->line);
    return cap_fail(err, STATUS_FORMAT, "%s: %s%s%s%s", path, line, c->key, *c->key ? ": " : "",
                    *c->what ? c->what : cyaml_strerror(result));
}

static enum status take_all(struct calibration *c, struct root_node *root, struct error *err)
{
    if (root->goniocam != 0 && root->goniocam != 1)
        return cap_fail(err, STATUS_FORMAT, "version %d of the format; known is 1", root->goniocam);
    enum status status = take_cameras(c, root, err);
    if (!status)
        status = take_lights(c, root, err);
    if (!status)
        status = take_shots(c, root, err);
    if (!status)
        status = take_sample(&c->sample, root->sample, err);
    if (!status)
        status = take_balls(c, root, err);
    if (!status)
        status = take_board(c, root, err);
    return status;
}

enum status cal_calibration_read(struct calibration *calibration, const char *path,
                                 struct error *err)
{
    struct complaint complaint = {0};
    const cyaml_config_t config = {.log_level = CYAML_LOG_ERROR,
                                   .log_fn = keep_complaint,
                                   .log_ctx = &complaint,
                                   .mem_fn = cyaml_mem};
    struct root_node *root = NULL;
    struct calibration made = {0};
    enum status status = STATUS_OK;
    cyaml_err_t result = cyaml_load_file(path, &config, &root_value, (cyaml_data_t **)&root, NULL);
    if (result == CYAML_ERR_FILE_OPEN)
        status = cap_fail(err, STATUS_IO, "%s: cannot be opened", path);
    else if (result != CYAML_OK || !root)
        status = tell(err, path, &complaint, result);
    else if ((status = take_all(&made, root, err)) != STATUS_OK)
        cap_fail_within(err, "%s", path);
    if (!status) {
        *calibration = made;
        made = (struct calibration){0};
    }
    cal_calibration_free(&made);
    cyaml_free(&config, &root_value, root, 0);
    return status;
}
