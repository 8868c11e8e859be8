/* occluders.c -- what stands in the way, as capture.yaml tells: holders, thick patches, rods. */
#include "capture_yaml.h"

#include <stdlib.h>
#include <string.h>

static vec3 vec3_of(const double v[3])
{
    return (vec3){v[0], v[1], v[2]};
}

/* occluders[i].key, as the source knows it. */
static const char *path_of(char path[64], unsigned i, const char *key)
{
    snprintf(path, 64, "occluders[%u].%s", i, key);
    return path;
}

static bool is_there(const struct capture_yaml *yaml, unsigned i, const char *key)
{
    char path[64];
    return yaml_source_line(&yaml->source, path_of(path, i, key)) > 0;
}

/* Keys that a shape needs, and those it has not; each list ends with NULL. */
static enum status check_keys(const struct capture_yaml *yaml, unsigned i, const char *const *need,
                              const char *const *has_not, struct error *err)
{
    char path[64];
    for (; *need; need++)
        if (!is_there(yaml, i, *need))
            return yaml_source_fail(&yaml->source, err, path_of(path, i, *need), "is missing");
    for (; *has_not; has_not++)
        if (is_there(yaml, i, *has_not))
            return yaml_source_fail(&yaml->source, err, path_of(path, i, *has_not),
                                    "this shape has none");
    return STATUS_OK;
}

static enum status check_cylinder(struct occluder *o, const struct capture_yaml *yaml, unsigned i,
                                  struct error *err)
{
    const struct yaml_occluder *given = &yaml->root->occluder[i];
    char path[64];
    enum status status =
        check_keys(yaml, i, (const char *[]){"radius", "height", "center", NULL},
                   (const char *[]){"size", "file", "pose", "rotation", NULL}, err);
    if (status)
        return status;
    if (!(given->radius > 0) || !(given->height > 0))
        return yaml_source_fail(&yaml->source, err,
                                path_of(path, i, given->radius > 0 ? "height" : "radius"),
                                "has to be positive");
    double length = vec3_length(vec3_of(given->axis));
    bool has_axis = is_there(yaml, i, "axis");
    if (has_axis && !(fabs(length - 1) < 1e-3))
        return yaml_source_fail(&yaml->source, err, path_of(path, i, "axis"),
                                "this axis has length %g, not 1", length);
    o->shape = OCCLUDER_CYLINDER;
    o->radius = given->radius;
    o->height = given->height;
    o->axis = has_axis ? vec3_normalize(vec3_of(given->axis)) : (vec3){0, 0, 1};
    return STATUS_OK;
}

static enum status check_box(struct occluder *o, const struct capture_yaml *yaml, unsigned i,
                             struct error *err)
{
    const struct yaml_occluder *given = &yaml->root->occluder[i];
    char path[64];
    enum status status =
        check_keys(yaml, i, (const char *[]){"size", "center", NULL},
                   (const char *[]){"radius", "height", "axis", "file", "pose", NULL}, err);
    if (status)
        return status;
    for (int k = 0; k < 3; k++)
        if (!(given->size[k] > 0))
            return yaml_source_fail(&yaml->source, err, path_of(path, i, "size"),
                                    "has to be three positive lengths");
    o->shape = OCCLUDER_BOX;
    o->size = vec3_of(given->size);
    o->rotation = vec3_of(given->rotation);
    return STATUS_OK;
}

static enum status check_mesh(struct occluder *o, const char *folder,
                              const struct capture_yaml *yaml, unsigned i, struct error *err)
{
    const struct yaml_occluder *given = &yaml->root->occluder[i];
    enum status status = check_keys(
        yaml, i, (const char *[]){"file", NULL},
        (const char *[]){"radius", "height", "axis", "size", "center", "rotation", NULL}, err);
    if (status)
        return status;
    o->shape = OCCLUDER_MESH;
    o->rotation = vec3_of(given->pose);
    o->center = vec3_of(given->pose + 3);
    o->file = *given->file == '/' ? strdup(given->file) : cap_path(folder, given->file);
    return o->file ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%s", given->file);
}

enum status capture_check_occluders(struct capture *capture, const struct capture_yaml *yaml,
                                    struct error *err)
{
    const unsigned count = yaml->root->occluders;
    capture->occluder = calloc((size_t)count + 1, sizeof *capture->occluder);
    if (!capture->occluder)
        return cap_fail(err, STATUS_MEMORY, "%s", yaml->source.file);
    enum status status = STATUS_OK;
    for (unsigned i = 0; i < count && !status; i++) {
        const char *shape = yaml->root->occluder[i].shape;
        struct occluder *o = &capture->occluder[capture->occluders++];
        char path[64];
        o->center = vec3_of(yaml->root->occluder[i].center);
        if (strcmp(shape, "cylinder") == 0)
            status = check_cylinder(o, yaml, i, err);
        else if (strcmp(shape, "box") == 0)
            status = check_box(o, yaml, i, err);
        else if (strcmp(shape, "mesh") == 0)
            status = check_mesh(o, capture->folder, yaml, i, err);
        else
            status = yaml_source_fail(&yaml->source, err, path_of(path, i, "shape"),
                                      "'%s' is no shape; use cylinder, box or mesh", shape);
    }
    return status;
}
