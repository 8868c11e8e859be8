/* reference_check.c -- what gives reflectance its scale: patches, or a capture of its own. */
#include "capture_yaml.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static bool is_there(const struct capture_yaml *yaml, unsigned i, const char *key)
{
    char path[64];
    snprintf(path, sizeof path, "reference[%u].%s", i, key);
    return yaml_source_line(&yaml->source, path) > 0;
}

static enum status wrong(const struct capture_yaml *yaml, struct error *err, unsigned i,
                         const char *key, const char *story)
{
    char path[64];
    snprintf(path, sizeof path, "reference[%u]%s%s", i, *key ? "." : "", key);
    return yaml_source_fail(&yaml->source, err, path, "%s", story);
}

/* A patch: plane to a hundredth of its size, convex, its corners in order and apart. */
static bool is_flat_convex(const vec3 corner[4])
{
    vec3 normal = vec3_cross(vec3_sub(corner[2], corner[0]), vec3_sub(corner[3], corner[1]));
    double twice_area = vec3_length(normal);
    double diagonal = vec3_length(vec3_sub(corner[2], corner[0]));
    if (!(twice_area > 1e-6 * diagonal * diagonal))
        return false;
    normal = vec3_scale(normal, 1 / twice_area);
    for (int k = 0; k < 4; k++) {
        vec3 along = vec3_sub(corner[(k + 1) % 4], corner[k]);
        vec3 next = vec3_sub(corner[(k + 2) % 4], corner[(k + 1) % 4]);
        if (!(vec3_dot(vec3_cross(along, next), normal) > 0)
            || fabs(vec3_dot(along, normal)) > 0.01 * diagonal)
            return false;
    }
    return true;
}

static enum status check_albedo(const struct capture_yaml *yaml, unsigned i, struct error *err)
{
    const double albedo = yaml->root->patch[i].albedo;
    return albedo > 0 && albedo <= 1
               ? STATUS_OK
               : wrong(yaml, err, i, "albedo", "has to be above 0 and at most 1");
}

static enum status check_patch(struct patch *patch, const struct capture_yaml *yaml, unsigned i,
                               struct error *err)
{
    const struct yaml_patch *given = &yaml->root->patch[i];
    if (!is_there(yaml, i, "albedo"))
        return wrong(yaml, err, i, "albedo", "is missing");
    if (!is_there(yaml, i, "corners"))
        return wrong(yaml, err, i, "corners", "is missing");
    enum status status = check_albedo(yaml, i, err);
    if (status)
        return status;
    patch->albedo = given->albedo;
    for (int k = 0; k < 4; k++)
        patch->corner[k] = (vec3){given->corner[k][0], given->corner[k][1], given->corner[k][2]};
    return is_flat_convex(patch->corner)
               ? STATUS_OK
               : wrong(yaml, err, i, "corners",
                       "these are not the corners of a flat patch: bottom left, bottom right, top "
                       "right, top left");
}

/* A second capture, from the first one's folder. It is the only reference: two might disagree. */
static enum status check_capture(struct capture *capture, const struct capture_yaml *yaml,
                                 unsigned i, struct error *err)
{
    const char *given = yaml->root->patch[i].capture;
    if (yaml->root->patches > 1)
        return wrong(yaml, err, i, "capture", "a capture is the only reference, or none");
    if (is_there(yaml, i, "corners"))
        return wrong(yaml, err, i, "corners",
                     "are those of a patch in these photographs: a capture has its own");
    enum status status = is_there(yaml, i, "albedo") ? check_albedo(yaml, i, err) : STATUS_OK;
    if (status)
        return status;
    capture->reference_albedo = yaml->root->patch[i].albedo;
    capture->reference =
        *given == '/' || !capture->folder ? strdup(given) : cap_path(capture->folder, given);
    char *file = capture->reference ? cap_path(capture->reference, "capture.yaml") : NULL;
    bool there = file && access(file, R_OK) == 0;
    if (!file)
        status = cap_fail(err, STATUS_MEMORY, "%s", given);
    else if (!there)
        status = wrong(yaml, err, i, "capture",
                       "is no capture: there is no such folder with a capture.yaml in it");
    free(file);
    return status;
}

enum status capture_check_reference(struct capture *capture, const struct capture_yaml *yaml,
                                    struct error *err)
{
    unsigned count = yaml->root->patches;
    enum status status = STATUS_OK;
    for (unsigned i = 0; i < count; i++)
        if (yaml->root->patch[i].capture)
            return check_capture(capture, yaml, i, err);
    capture->patch = calloc(count + 1, sizeof *capture->patch);
    if (!capture->patch)
        return cap_fail(err, STATUS_MEMORY, "%s", yaml->source.file);
    capture->patches = (int)count;
    for (unsigned i = 0; i < count && !status; i++)
        status = check_patch(&capture->patch[i], yaml, i, err);
    return status;
}
