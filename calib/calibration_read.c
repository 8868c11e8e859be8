/* calibration_read.c -- calibration.yaml, read: libcyaml checks it against calibration_schema.c and
 * fills plain nodes, which become a struct calibration; cameras and lights are found by name. */
#include "calibration_schema.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

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
    if (s->scale < 0)
        return cap_fail(err, STATUS_FORMAT, "sample: scale must be above 0");
    sample->file = take(&s->file);
    sample->scale = s->scale > 0 ? s->scale : 1;
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
    cyaml_err_t result =
        cyaml_load_file(path, &config, &cal_calibration_schema, (cyaml_data_t **)&root, NULL);
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
    cyaml_free(&config, &cal_calibration_schema, root, 0);
    return status;
}
