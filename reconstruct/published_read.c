/* published_read.c -- parameters of models as JSON: of one material, or of many by name.
 *
 *      {"model": NAME, "parameters": {PARAMETER: number or [3], ...}}         as we export them
 *      {MODEL: {MATERIAL: {PARAMETER: number or [3], ...}, ...}, ...}         FILE#MODEL/MATERIAL
 *
 * Goniocam's sgd normalises D by itself; a `kap` beside its parameters, which does so too in all
 * published materials but chrome, goes into rhoS. Straight down f = kap exp(-alpha) / (pi^2
 * alpha^p) for rhoD = 0, rhoS = F = 1.
 */
#include "formats.h"

#include <ctype.h>
#include <jansson.h>
#include <stdlib.h>
#include <string.h>

// One parameter. false: it is not there, or not in its range.
static bool take_parameter(const struct parameter *p, const json_t *material, double *value)
{
    const json_t *given = json_object_get(material, p->name);
    bool list = json_is_array(given);
    for (int c = 0; c < p->size; c++) {
        const json_t *number = list ? json_array_get(given, (size_t)c) : given;
        value[c] = json_number_value(number);
        if (!json_is_number(number) || !(value[c] >= p->low && value[c] <= p->high))
            return false;
    }
    return list ? (int)json_array_size(given) == p->size : given != NULL;
}

// Where a parameter begins in the values of a model that has it.
static double *at(const struct model *model, double *value, const char *name)
{
    for (const struct parameter *p = model->parameter; strcmp(p->name, name) != 0; p++)
        value += p->size;
    return value;
}

static void keep_kap(const struct model *model, double *value, const json_t *given)
{
    double probe[MODEL_PARAMETERS_MAX], f[3];
    const vec3 n = {0, 0, 1};
    memcpy(probe, value, sizeof probe);
    for (int c = 0; c < 3; c++) {
        at(model, probe, "rhoD")[c] = at(model, probe, "F1")[c] = 0;
        at(model, probe, "lambda")[c] = 0;
        at(model, probe, "rhoS")[c] = at(model, probe, "F0")[c] = 1;
    }
    model->eval(probe, n, n, f);
    for (int c = 0; c < 3; c++) {
        double alpha = at(model, value, "alpha")[c], p = at(model, value, "p")[c];
        double kap = f[c] * CAP_PI * CAP_PI * exp(alpha) * pow(alpha, p);
        const json_t *number = json_array_get(given, (size_t)c);
        if (json_is_number(number))
            at(model, value, "rhoS")[c] *= json_number_value(number) / kap;
    }
}

static enum status take_material(struct brdf *brdf, const char *path, const char *kind,
                                 const json_t *material, struct error *err)
{
    struct brdf made = {.model = rec_model_find(kind)};
    if (!made.model)
        return cap_fail(err, STATUS_FORMAT, "%s: no model is called '%s'", path, kind);
    double *value = made.value;
    for (const struct parameter *p = made.model->parameter; p->name; p++) {
        if (!take_parameter(p, material, value))
            return cap_fail(err, STATUS_FORMAT, "%s: %s: %s is missing, or not %s in [%g, %g]",
                            path, kind, p->name, p->size == 1 ? "a number" : "three numbers",
                            p->low, p->high);
        value += p->size;
    }
    const json_t *kap = json_object_get(material, "kap");
    if (strcmp(kind, "sgd") == 0 && kap)
        keep_kap(made.model, made.value, kap);
    *brdf = made;
    return STATUS_OK;
}

enum status rec_published_read(struct brdf *brdf, const char *path, const char *kind,
                               const char *name, struct error *err)
{
    json_error_t why;
    json_t *root = json_load_file(path, 0, &why);
    if (!root)
        return cap_fail(err, STATUS_FORMAT, "%s: line %d: %s", path, why.line, why.text);
    const json_t *found = json_object_get(json_object_get(root, kind), name);
    enum status status = found
                             ? take_material(brdf, path, kind, found, err)
                             : cap_fail(err, STATUS_FORMAT, "%s: %s has no '%s'", path, kind, name);
    json_decref(root);
    return status;
}

// The one material of a file that holds one.
static enum status read_single(struct brdf *brdf, const char *path, struct error *err)
{
    json_error_t why;
    json_t *root = json_load_file(path, 0, &why);
    if (!root)
        return cap_fail(err, STATUS_FORMAT, "%s: line %d: not JSON: %s", path, why.line, why.text);
    const char *kind = json_string_value(json_object_get(root, "model"));
    const json_t *parameters = json_object_get(root, "parameters");
    enum status status =
        kind && json_is_object(parameters)
            ? take_material(brdf, path, kind, parameters, err)
            : cap_fail(
                err, STATUS_FORMAT,
                "%s: not one material (\"model\", \"parameters\"); of a collection name one, "
                "as '%s#sgd/NAME'",
                path, path);
    json_decref(root);
    return status;
}

static enum status published_read(struct brdf *brdf, const char *path, struct error *err)
{
    const char *mark = rec_path_mark(path);
    const char *slash = mark ? strchr(mark, '/') : NULL;
    if (!mark)
        return read_single(brdf, path, err);
    if (!slash)
        return cap_fail(err, STATUS_FORMAT, "%s: '#MODEL/MATERIAL' is wanted after the file's name",
                        path);
    char *file = strndup(path, (size_t)(mark - path)), *kind = NULL;
    if (file)
        kind = strndup(mark + 1, (size_t)(slash - mark - 1));
    enum status status = kind ? rec_published_read(brdf, file, kind, slash + 1, err)
                              : cap_fail(err, STATUS_MEMORY, "%s: no memory", path);
    free(file);
    free(kind);
    return status;
}

static bool published_probe(const char *start, size_t size)
{
    (void)size;
    while (isspace((unsigned char)*start))
        start++;
    return *start == '{';
}

const struct format rec_format_published = {"model parameters (JSON)", published_probe,
                                            published_read};
