/* interchange_read.c -- calibrations of other programs, read: OpenCV's YAML (also ROS's
 * camera_info), Kalibr's camchain, COLMAP's text model (colmap_read.c), and our own. */
#include "interchange.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <yaml.h>

// ---- a YAML tree

struct tree {
    yaml_document_t document;
};

static yaml_node_t *find(struct tree *t, yaml_node_t *map, const char *key)
{
    if (!map || map->type != YAML_MAPPING_NODE)
        return NULL;
    for (yaml_node_pair_t *p = map->data.mapping.pairs.start; p < map->data.mapping.pairs.top;
         p++) {
        yaml_node_t *k = yaml_document_get_node(&t->document, p->key);
        if (k && k->type == YAML_SCALAR_NODE && strcmp((char *)k->data.scalar.value, key) == 0)
            return yaml_document_get_node(&t->document, p->value);
    }
    return NULL;
}

static yaml_node_t *find_any(struct tree *t, yaml_node_t *map, const char *const *keys)
{
    yaml_node_t *node = NULL;
    for (; *keys && !node; keys++)
        node = find(t, map, *keys);
    return node;
}

static const char *text_of(const yaml_node_t *node)
{
    return node && node->type == YAML_SCALAR_NODE ? (const char *)node->data.scalar.value : "";
}

static bool number_of(const yaml_node_t *node, double *value)
{
    char *end;
    const char *text = text_of(node);
    *value = strtod(text, &end);
    return *text && !*end && isfinite(*value);
}

// Numbers of a list, or of the list `data` of a matrix; -> how many, at most room; -1: none.
static int numbers_of(struct tree *t, yaml_node_t *node, double *value, int room)
{
    yaml_node_t *data = find(t, node, "data");
    int n = 0;
    node = data ? data : node;
    if (!node || node->type != YAML_SEQUENCE_NODE)
        return -1;
    for (yaml_node_item_t *i = node->data.sequence.items.start; i < node->data.sequence.items.top;
         i++) {
        yaml_node_t *item = yaml_document_get_node(&t->document, *i);
        if (item && item->type == YAML_SEQUENCE_NODE) {  // rows of a matrix
            int more = numbers_of(t, item, value + n, room - n);
            if (more < 0)
                return -1;
            n += more;
        } else if (n == room || !number_of(item, value + n)) {
            return -1;
        } else {
            n++;
        }
    }
    return n;
}

// OpenCV begins its files with "%YAML:1.0", which is no YAML: that line is left out.
static enum status tree_load(struct tree *t, const char *path, struct error *err)
{
    yaml_parser_t parser;
    char first[80];
    FILE *file = fopen(path, "rb");
    if (!file)
        return cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
    bool skipped = fgets(first, sizeof first, file) && strncmp(first, "%YAML:", 6) == 0;
    if (!skipped)
        rewind(file);
    if (!yaml_parser_initialize(&parser)) {
        fclose(file);
        return cap_fail(err, STATUS_MEMORY, "%s", path);
    }
    enum status status = STATUS_OK;
    yaml_parser_set_input_file(&parser, file);
    if (!yaml_parser_load(&parser, &t->document)) {
        status = cap_fail(err, STATUS_FORMAT, "%s: line %zu: %s", path,
                          parser.problem_mark.line + 1 + skipped,
                          parser.problem ? parser.problem : "no YAML");
    } else if (!yaml_document_get_root_node(&t->document)) {
        status = cap_fail(err, STATUS_FORMAT, "%s: is empty", path);
        yaml_document_delete(&t->document);
    }
    yaml_parser_delete(&parser);
    fclose(file);
    return status;
}

// ---- cameras

enum status cal_add_camera(struct calibration *c, const struct camera *camera, const char *name,
                           struct error *err)
{
    bool sound = camera->width > 0 && camera->height > 0 && camera->focal[0] > 0
                 && camera->focal[1] > 0 && isfinite(camera->center[0] + camera->center[1]);
    if (!sound)
        return cap_fail(err, STATUS_FORMAT, "camera %s: size and focal lengths must be above 0",
                        name);
    struct camera *grown = realloc(c->camera, (size_t)(c->cameras + 1) * sizeof *grown);
    char *copy = strdup(name);
    if (grown)
        c->camera = grown;
    if (!grown || !copy) {
        free(copy);
        return cap_fail(err, STATUS_MEMORY, "camera %s", name);
    }
    c->camera[c->cameras] = *camera;
    c->camera[c->cameras++].name = copy;
    return STATUS_OK;
}

// Distortion in OpenCV's order; more than five numbers are another model, unless they are 0.
static enum status take_distortion(struct camera *m, const double *d, int count, struct error *err)
{
    for (int i = 5; i < count; i++)
        if (d[i] != 0)
            return cap_fail(err, STATUS_FORMAT,
                            "a distortion of %d terms: known are the five k1 k2 p1 p2 k3", count);
    for (int i = 0; i < count && i < 5; i++)
        m->distortion[i] = d[i];
    return STATUS_OK;
}

static enum status take_opencv(struct calibration *c, struct tree *t, struct error *err)
{
    static const char *const widths[] = {"image_width", "width", "image_Width", NULL};
    static const char *const heights[] = {"image_height", "height", "image_Height", NULL};
    static const char *const matrices[] = {
        "camera_matrix", "cameraMatrix", "Camera_Matrix", "K", "M1", NULL};
    static const char *const distortions[] = {"distortion_coefficients",
                                              "Distortion_Coefficients",
                                              "dist_coeffs",
                                              "distCoeffs",
                                              "D",
                                              "D1",
                                              NULL};
    yaml_node_t *root = yaml_document_get_root_node(&t->document);
    struct camera m = {0};
    double k[9], d[14] = {0}, width, height, sigma[LENS_PARAMETERS];
    const char *model = text_of(find(t, root, "distortion_model")),
               *name = text_of(find(t, root, "camera_name"));
    if (!number_of(find_any(t, root, widths), &width)
        || !number_of(find_any(t, root, heights), &height) || width > 1e6 || height > 1e6)
        return cap_fail(err, STATUS_FORMAT, "wants image_width and image_height");
    if (numbers_of(t, find_any(t, root, matrices), k, 9) != 9)
        return cap_fail(err, STATUS_FORMAT, "wants camera_matrix, 3 x 3 numbers");
    if (strcmp(model, "equidistant") == 0 || strcmp(model, "fisheye") == 0)
        return cap_fail(err, STATUS_FORMAT, "distortion model %s: known is plumb_bob", model);
    int terms = numbers_of(t, find_any(t, root, distortions), d, 14);
    m.width = (int)width;
    m.height = (int)height;
    m.focal[0] = k[0];
    m.focal[1] = k[4];
    m.center[0] = k[2];
    m.center[1] = k[5];
    number_of(find(t, root, "avg_reprojection_error"), &m.rms_px);
    if (numbers_of(t, find(t, root, "sigma"), sigma, LENS_PARAMETERS) == LENS_PARAMETERS) {
        memcpy(m.sigma_focal, sigma, sizeof m.sigma_focal);
        memcpy(m.sigma_center, sigma + 2, sizeof m.sigma_center);
        memcpy(m.sigma_distortion, sigma + 4, sizeof m.sigma_distortion);
    }
    enum status status = take_distortion(&m, d, terms, err);
    return status ? status : cal_add_camera(c, &m, *name ? name : "camera0", err);
}

// Kalibr's camchain: cam0, cam1, ... with intrinsics [fx, fy, cx, cy] and radtan distortion.
static enum status take_kalibr(struct calibration *c, struct tree *t, struct error *err)
{
    yaml_node_t *root = yaml_document_get_root_node(&t->document), *node;
    enum status status = STATUS_OK;
    char key[24] = "cam0";
    for (int i = 0; !status && (node = find(t, root, key));
         snprintf(key, sizeof key, "cam%d", ++i)) {
        struct camera m = {0};
        double k[4], size[2], d[14] = {0};
        const char *model = text_of(find(t, node, "camera_model")),
                   *lens = text_of(find(t, node, "distortion_model"));
        bool radtan = strcmp(lens, "radtan") == 0, none = strcmp(lens, "none") == 0 || !*lens;
        if (strcmp(model, "pinhole") != 0 || (!radtan && !none))
            return cap_fail(err, STATUS_FORMAT, "%s: %s with %s: known is pinhole with radtan", key,
                            *model ? model : "no camera_model", *lens ? lens : "none");
        if (numbers_of(t, find(t, node, "intrinsics"), k, 4) != 4
            || numbers_of(t, find(t, node, "resolution"), size, 2) != 2)
            return cap_fail(err, STATUS_FORMAT, "%s: wants intrinsics and resolution", key);
        int terms = radtan ? numbers_of(t, find(t, node, "distortion_coeffs"), d, 14) : 0;
        m.width = (int)size[0];
        m.height = (int)size[1];
        memcpy(m.focal, k, sizeof m.focal);
        memcpy(m.center, k + 2, sizeof m.center);
        status = take_distortion(&m, d, terms, err);
        if (!status)
            status = cal_add_camera(c, &m, key, err);
    }
    return status;
}

static enum status read_yaml(struct calibration *c, const char *path, struct error *err)
{
    struct tree tree;
    enum status status = tree_load(&tree, path, err);
    if (status)
        return status;
    yaml_node_t *root = yaml_document_get_root_node(&tree.document);
    bool ours = find(&tree, root, "cameras") != NULL, kalibr = find(&tree, root, "cam0") != NULL;
    if (!ours)
        status = kalibr ? take_kalibr(c, &tree, err) : take_opencv(c, &tree, err);
    yaml_document_delete(&tree.document);
    if (status)
        return cap_fail_within(err, "%s", path);
    return ours ? cal_calibration_read(c, path, err) : STATUS_OK;
}

// A folder is what goniocam wrote, or COLMAP's model.
static enum status read_folder(struct calibration *c, const char *path, struct error *err)
{
    char *own = cap_path(path, "calibration.yaml");
    if (!own)
        return cap_fail(err, STATUS_MEMORY, "%s", path);
    enum status status = access(own, R_OK) == 0 ? cal_calibration_read(c, own, err)
                                                : colmap_read_model(c, path, err);
    free(own);
    return status;
}

enum status cal_calibration_import(struct calibration *calibration, const char *path,
                                   struct error *err)
{
    struct calibration c = {0};
    struct stat info;
    const char *dot = strrchr(path, '.');
    enum status status = STATUS_OK;
    if (stat(path, &info) != 0)
        status = cap_fail(err, STATUS_IO, "%s: there is no such file or folder", path);
    else if (S_ISDIR(info.st_mode))
        status = read_folder(&c, path, err);
    else if (dot && strcmp(dot, ".txt") == 0)
        status = colmap_read_cameras(&c, path, err);
    else
        status = read_yaml(&c, path, err);
    if (status)
        cal_calibration_free(&c);
    else
        *calibration = c;
    return status;
}
