/* colmap_read.c -- COLMAP's text model, read: cameras.txt, and images.txt where there is one.
 *
 * COLMAP's pixels are counted from the corner of the first one, half a pixel before its centre.
 */
#include "interchange.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { NUMBERS_MAX = 12 };

// The lens models that are ours with some terms 0: where each of their numbers goes, in the order
// fx fy cx cy k1 k2 p1 p2 k3; F is a focal length for both, X a term that has to be 0.
enum { FX, FY, CX, CY, K1, K2, P1, P2, K3, F, X };
static const struct {
    const char *name;
    int count, to[NUMBERS_MAX];
} models[] = {
    {"SIMPLE_PINHOLE", 3, {F, CX, CY}},
    {"PINHOLE", 4, {FX, FY, CX, CY}},
    {"SIMPLE_RADIAL", 4, {F, CX, CY, K1}},
    {"RADIAL", 5, {F, CX, CY, K1, K2}},
    {"OPENCV", 8, {FX, FY, CX, CY, K1, K2, P1, P2}},
    {"FULL_OPENCV", 12, {FX, FY, CX, CY, K1, K2, P1, P2, K3, X, X, X}},
};
enum { MODELS = sizeof models / sizeof *models };

static enum status take_model(struct camera *m, const char *name, const double *number, int count,
                              struct error *err)
{
    double lens[LENS_PARAMETERS] = {0};
    for (int i = 0; i < MODELS; i++) {
        if (strcmp(models[i].name, name) != 0)
            continue;
        if (count != models[i].count)
            return cap_fail(err, STATUS_FORMAT, "%s has %d numbers, not %d", name, models[i].count,
                            count);
        for (int k = 0; k < count; k++) {
            if (models[i].to[k] == X && number[k] != 0)
                return cap_fail(err, STATUS_FORMAT, "%s: k4 k5 k6 must be 0", name);
            if (models[i].to[k] == F)
                lens[FX] = lens[FY] = number[k];
            else if (models[i].to[k] != X)
                lens[models[i].to[k]] = number[k];
        }
        lens[CX] -= 0.5;
        lens[CY] -= 0.5;
        lens_from_array(m, lens);
        return STATUS_OK;
    }
    return cap_fail(
        err, STATUS_FORMAT,
        "lens model %s: known are SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV "
        "and FULL_OPENCV",
        name);
}

// "ID MODEL WIDTH HEIGHT NUMBERS..."
static enum status take_camera(struct calibration *c, char *line, struct error *err)
{
    char name[24], model[40];
    int width, height, used = 0, id;
    double number[NUMBERS_MAX];
    int count = 0;
    struct camera m = {0};
    if (sscanf(line, "%d %39s %d %d%n", &id, model, &width, &height, &used) != 4)
        return cap_fail(err, STATUS_FORMAT, "wants CAMERA_ID MODEL WIDTH HEIGHT and numbers");
    for (char *at = line + used, *end; count < NUMBERS_MAX; at = end, count++) {
        number[count] = strtod(at, &end);
        if (end == at)
            break;
    }
    m.width = width;
    m.height = height;
    enum status status = take_model(&m, model, number, count, err);
    snprintf(name, sizeof name, "%d", id);
    return status ? status : cal_add_camera(c, &m, name, err);
}

// "ID QW QX QY QZ TX TY TZ CAMERA_ID NAME"; the next line is its points.
static enum status take_image(struct calibration *c, char *line, struct error *err)
{
    double q[4], t[3];
    int used = 0, id;
    char camera[24];
    struct view v = {.light = -1, .power = 1, .camera = -1};
    if (sscanf(line, "%d %lf %lf %lf %lf %lf %lf %lf %23s %n", &id, q, q + 1, q + 2, q + 3, t,
               t + 1, t + 2, camera, &used)
            != 9
        || !line[used])
        return cap_fail(err, STATUS_FORMAT, "wants IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME");
    for (int i = 0; i < c->cameras; i++)
        if (strcmp(c->camera[i].name, camera) == 0)
            v.camera = i;
    double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (v.camera < 0 || !(length > 0))
        return cap_fail(err, STATUS_FORMAT, "image %s: no camera %s, or no rotation", line + used,
                        camera);
    for (int i = 0; i < 4; i++)
        q[i] /= q[0] < 0 ? -length : length;
    vec3 axis = {q[1], q[2], q[3]};
    double sine = vec3_length(axis);
    v.view_from_world.rotation = vec3_scale(axis, sine > 1e-12 ? 2 * atan2(sine, q[0]) / sine : 2);
    v.view_from_world.translation = (vec3){t[0], t[1], t[2]};
    struct view *grown = realloc(c->view, (size_t)(c->views + 1) * sizeof *grown);
    if (grown)
        c->view = grown;
    const char *name = line + used, *dot = strrchr(name, '.'), *slash = strrchr(name, '/');
    size_t length_name = dot && (!slash || dot > slash) ? (size_t)(dot - name) : strlen(name);
    if (!grown || !(v.name = strndup(name, length_name)))
        return cap_fail(err, STATUS_MEMORY, "image %s", name);
    c->view[c->views++] = v;
    return STATUS_OK;
}

// Lines that are no comments go to `take`; with skip, every other one.
static enum status read_lines(struct calibration *c, const char *path, bool skip,
                              enum status (*take)(struct calibration *, char *, struct error *),
                              struct error *err)
{
    FILE *file = fopen(path, "r");
    if (!file)
        return cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
    char *line = NULL;
    size_t room = 0;
    int number = 0;
    bool points = false;
    enum status status = STATUS_OK;
    while (!status && getline(&line, &room, file) >= 0) {
        number++;
        line[strcspn(line, "\r\n")] = '\0';
        if (*line == '#')
            continue;
        if (points) {
            points = false;
            continue;
        }
        if (!line[strspn(line, " \t")])
            continue;
        status = take(c, line, err);
        if (status)
            cap_fail_within(err, "%s: line %d", path, number);
        points = skip;
    }
    free(line);
    fclose(file);
    return status;
}

enum status colmap_read_cameras(struct calibration *c, const char *path, struct error *err)
{
    enum status status = read_lines(c, path, false, take_camera, err);
    if (!status && c->cameras == 0)
        status = cap_fail(err, STATUS_FORMAT, "%s: holds no camera", path);
    return status;
}

enum status colmap_read_model(struct calibration *c, const char *folder, struct error *err)
{
    char *cameras = cap_path(folder, "cameras.txt"), *images = cap_path(folder, "images.txt");
    enum status status = cameras && images ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%s", folder);
    if (!status && access(cameras, R_OK) != 0)
        status =
            cap_fail(err, STATUS_IO, "%s: no COLMAP text model: cameras.txt is not there", folder);
    if (!status)
        status = colmap_read_cameras(c, cameras, err);
    if (!status && access(images, R_OK) == 0)
        status = read_lines(c, images, true, take_image, err);
    free(cameras);
    free(images);
    return status;
}
