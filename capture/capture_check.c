/* capture_check.c -- what capture.yaml's values mean: units, unit vectors, planes, unique ids.
 *
 * Everything found wrong is told with the file, the line and the key.
 */
#include "capture_yaml.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static vec3 vec3_of(const double v[3])
{
    return (vec3){v[0], v[1], v[2]};
}

static bool is_there(const struct capture_yaml *yaml, const char *path)
{
    return yaml_source_line(&yaml->source, path) > 0;
}

enum status capture_check_axis(vec3 *axis, const struct capture_yaml *yaml, const char *path,
                               const double given[3], vec3 fallback, struct error *err)
{
    *axis = fallback;
    if (!is_there(yaml, path))
        return STATUS_OK;
    vec3 v = vec3_of(given);
    if (!(fabs(vec3_length(v) - 1) <= CAPTURE_AXIS_TOLERANCE))
        return yaml_source_fail(&yaml->source, err, path, "this axis has length %g, not 1",
                                vec3_length(v));
    *axis = vec3_normalize(v);
    return STATUS_OK;
}

/* A mesh: its file from the capture's folder, and a rotation vector and a translation. */
static enum status check_mesh(struct sample_place *sample, const char *folder,
                              const struct capture_yaml *yaml, struct error *err)
{
    static const char *const not_of_mesh[] = {"sample.radius", "sample.radius_sigma",
                                              "sample.height", "sample.axis", "sample.center"};
    const struct yaml_sample *given = yaml->root->sample;
    for (int i = 0; i < 5; i++)
        if (is_there(yaml, not_of_mesh[i]))
            return yaml_source_fail(&yaml->source, err, not_of_mesh[i],
                                    "a mesh has none: its file and `pose` say it all");
    if (!is_there(yaml, "sample.file"))
        return yaml_source_fail(
            &yaml->source, err, "sample.file",
            "is missing: the PLY or OBJ file of the mesh, in mm, or with a `scale`");
    if (is_there(yaml, "sample.scale") && !(given->scale > 0))
        return yaml_source_fail(&yaml->source, err, "sample.scale",
                                "has to be positive: how many mm a unit of the file is");
    sample->shape = SHAPE_MESH;
    sample->scale = given->scale > 0 ? given->scale : 1;
    sample->rotation = vec3_of(given->pose);
    sample->translation = vec3_of(given->pose + 3);
    sample->file = *given->file == '/' ? strdup(given->file) : cap_path(folder, given->file);
    return sample->file ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%s", given->file);
}

static enum status check_sample(struct capture *capture, const struct capture_yaml *yaml,
                                struct error *err)
{
    const struct yaml_sample *given = yaml->root->sample;
    struct sample_place *sample = &capture->sample;
    if (!given)
        return STATUS_OK;
    if (strcmp(given->shape, "sphere") == 0)
        sample->shape = SHAPE_SPHERE;
    else if (strcmp(given->shape, "cylinder") == 0)
        sample->shape = SHAPE_CYLINDER;
    else if (strcmp(given->shape, "mesh") == 0)
        return check_mesh(sample, capture->folder, yaml, err);
    else
        return yaml_source_fail(&yaml->source, err, "sample.shape",
                                "'%s' is no shape; use sphere, cylinder or mesh", given->shape);
    bool cylinder = sample->shape == SHAPE_CYLINDER;
    static const char *const mesh_only[] = {"sample.file", "sample.pose", "sample.scale"};
    for (int i = 0; i < 3; i++)
        if (is_there(yaml, mesh_only[i]))
            return yaml_source_fail(&yaml->source, err, mesh_only[i], "only a mesh has this");
    if (!is_there(yaml, "sample.center"))
        return yaml_source_fail(&yaml->source, err, "sample.center", "is missing");
    if (!(given->radius > 0))
        return yaml_source_fail(&yaml->source, err, "sample.radius", "has to be positive");
    if (is_there(yaml, "sample.radius_sigma") && !(given->radius_sigma > 0))
        return yaml_source_fail(&yaml->source, err, "sample.radius_sigma", "has to be positive");
    if (cylinder && !(given->height > 0))
        return yaml_source_fail(&yaml->source, err, "sample.height", "has to be positive");
    if (!cylinder && (is_there(yaml, "sample.height") || is_there(yaml, "sample.axis")))
        return yaml_source_fail(&yaml->source, err,
                                is_there(yaml, "sample.height") ? "sample.height" : "sample.axis",
                                "a sphere has none");
    if (cylinder && !is_there(yaml, "sample.axis"))
        return yaml_source_fail(&yaml->source, err, "sample.axis", "is missing");
    sample->radius = given->radius;
    sample->radius_sigma =
        given->radius_sigma > 0 ? given->radius_sigma : CAPTURE_CALIPER * given->radius;
    sample->height = cylinder ? given->height : 0;
    sample->center = vec3_of(given->center);
    return capture_check_axis(&sample->axis, yaml, "sample.axis", given->axis, (vec3){0, 0, 1},
                              err);
}

static enum status check_light(struct light_place *light, const struct capture_yaml *yaml,
                               unsigned i, struct error *err)
{
    const struct yaml_light *given = &yaml->root->light[i];
    char path[64];
    snprintf(path, sizeof path, "lights[%u].name", i);
    for (unsigned k = 0; k < i; k++)
        if (strcmp(yaml->root->light[k].name, given->name) == 0)
            return yaml_source_fail(&yaml->source, err, path, "two lamps are called '%s'",
                                    given->name);
    snprintf(path, sizeof path, "lights[%u].frame", i);
    if (given->frame && strcmp(given->frame, "world") != 0 && strcmp(given->frame, "camera") != 0)
        return yaml_source_fail(&yaml->source, err, path, "'%s' is neither world nor camera",
                                given->frame);
    light->on_camera = given->frame && strcmp(given->frame, "camera") == 0;
    snprintf(path, sizeof path, "lights[%u].position", i);
    light->has_position = is_there(yaml, path);
    light->position = vec3_of(given->position);
    snprintf(path, sizeof path, "lights[%u].radius", i);
    if (!(given->radius >= 0))
        return yaml_source_fail(&yaml->source, err, path, "has to be positive");
    light->radius = given->radius;
    light->name = strdup(given->name);
    return light->name ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%s", yaml->source.file);
}

static enum status check_lights(struct capture *capture, const struct capture_yaml *yaml,
                                struct error *err)
{
    unsigned count = yaml->root->lights;
    capture->light = calloc(count > 0 ? count : 1, sizeof *capture->light);
    if (!capture->light)
        return cap_fail(err, STATUS_MEMORY, "%s", yaml->source.file);
    capture->lights = count > 0 ? (int)count : 1;
    enum status status = STATUS_OK;
    if (count == 0 && !(capture->light[0].name = strdup("light")))
        status = cap_fail(err, STATUS_MEMORY, "%s", yaml->source.file);
    for (unsigned i = 0; i < count && !status; i++)
        status = check_light(&capture->light[i], yaml, i, err);
    return status;
}

static enum status check_response(struct capture *capture, const struct capture_yaml *yaml,
                                  struct error *err)
{
    const char *name = yaml->root->response;
    capture->response = RESPONSE_RECOVER;
    if (!name || strcmp(name, "recover") == 0)
        return STATUS_OK;
    capture->response = strcmp(name, "srgb") == 0     ? RESPONSE_SRGB
                        : strcmp(name, "linear") == 0 ? RESPONSE_LINEAR
                                                      : RESPONSE_FILE;
    if (capture->response != RESPONSE_FILE)
        return STATUS_OK;
    char *path = capture->folder ? cap_path(capture->folder, name) : NULL;
    bool there = path && access(path, R_OK) == 0;
    free(path);
    if (!there)
        return yaml_source_fail(&yaml->source, err, "response",
                                "'%s' is none of recover, srgb and linear, and no file in the "
                                "capture's folder",
                                name);
    capture->response_file = strdup(name);
    return capture->response_file ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%s", name);
}

static enum status check_noise(struct capture *capture, const struct capture_yaml *yaml,
                               struct error *err)
{
    const struct yaml_noise none = {0}, *given = yaml->root->noise ? yaml->root->noise : &none;
    capture->black = is_there(yaml, "noise.black") ? given->black : NAN;
    capture->white = is_there(yaml, "noise.white") ? given->white : NAN;
    capture->gain = is_there(yaml, "noise.gain") ? given->gain : NAN;
    capture->read_noise = is_there(yaml, "noise.read_noise") ? given->read_noise : NAN;
    if (capture->white <= 0 || capture->white <= capture->black)
        return yaml_source_fail(&yaml->source, err, "noise.white",
                                "has to be positive and above black");
    if (capture->gain <= 0)
        return yaml_source_fail(&yaml->source, err, "noise.gain", "has to be positive");
    if (capture->read_noise < 0)
        return yaml_source_fail(&yaml->source, err, "noise.read_noise", "is not negative");
    if (!isnan(capture->read_noise) && isnan(capture->gain))
        return yaml_source_fail(&yaml->source, err, "noise.read_noise",
                                "is in electrons: gain (electrons per DN) is needed with it");
    return STATUS_OK;
}

static enum status check_supported(const struct capture_yaml *yaml, struct error *err)
{
    if (yaml->root->goniocam != 1)
        return yaml_source_fail(&yaml->source, err, "goniocam",
                                "format %d is unknown to this version, which reads format 1",
                                yaml->root->goniocam);
    return STATUS_OK;
}

enum status capture_check(struct capture *capture, const struct capture_yaml *yaml,
                          struct error *err)
{
    enum status status = check_supported(yaml, err);
    if (!status)
        status = capture_check_board(capture, yaml, err);
    if (!status)
        status = capture_check_cameras(capture, yaml, err);
    if (!status)
        status = check_sample(capture, yaml, err);
    if (!status)
        status = capture_check_reference(capture, yaml, err);
    if (!status)
        status = check_lights(capture, yaml, err);
    if (!status)
        status = check_response(capture, yaml, err);
    if (!status)
        status = check_noise(capture, yaml, err);
    if (!status)
        status = capture_check_occluders(capture, yaml, err);
    if (!status)
        status = capture_check_balls(capture, yaml, err);
    return status;
}
