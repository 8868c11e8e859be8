/* fits_yaml.c -- fits.yaml, written and read. */
#include "reconstruct.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <yaml.h>

static void write_colour_or_number(struct yaml_out *out, const char *key, const double *value,
                                   int size)
{
    if (size == 1)
        cap_yaml_number(out, key, *value);
    else
        cap_yaml_numbers(out, key, value, size);
}

// low and high: 95 % of a normal distribution, within the physical range.
static void write_interval(struct yaml_out *out, const struct fit *fit, const struct parameter *p,
                           int k)
{
    double low[3], high[3];
    for (int c = 0; c < p->size; c++) {
        low[c] = fmax(p->low, fit->value[k + c] - 1.96 * fit->sigma[k + c]);
        high[c] = fmin(p->high, fit->value[k + c] + 1.96 * fit->sigma[k + c]);
    }
    write_colour_or_number(out, "low", low, p->size);
    write_colour_or_number(out, "high", high, p->size);
}

// Rows of the parameters in their order, colours as three; up to the diagonal.
static void write_covariance(struct yaml_out *out, const struct fit *fit)
{
    const int size = rec_model_size(fit->model);
    cap_yaml_list(out, "covariance");
    for (int i = 0; i < size; i++)
        cap_yaml_numbers(out, NULL, &fit->covariance[i * size], i + 1);
    cap_yaml_close(out);
}

static void write_pictures(struct yaml_out *out, const struct fit *fit)
{
    static const char *const psnr[2] = {"psnr", "psnr_room"};
    static const char *const delta_e[2] = {"delta_e", "delta_e_room"};
    for (int k = 0; k < 2 && fit->psnr[k] > 0; k++) {
        cap_yaml_number(out, psnr[k], fit->psnr[k]);
        cap_yaml_number(out, delta_e[k], fit->delta_e[k]);
    }
}

static void write_fit(struct yaml_out *out, const struct fit *fit)
{
    int k = 0;
    cap_yaml_map(out, NULL);
    cap_yaml_text(out, "name", fit->model->name);
    cap_yaml_map(out, "parameters");
    for (const struct parameter *p = fit->model->parameter; p->name; p++) {
        cap_yaml_flow_map(out, p->name);
        write_colour_or_number(out, "value", &fit->value[k], p->size);
        write_colour_or_number(out, "sigma", &fit->sigma[k], p->size);
        write_interval(out, fit, p, k);
        cap_yaml_close(out);
        k += p->size;
    }
    cap_yaml_close(out);
    cap_yaml_map(out, "errors");
    cap_yaml_number(out, "log_rms", fit->log_rms);
    cap_yaml_number(out, "relative_median", fit->relative_median);
    cap_yaml_number(out, "chi", fit->chi);
    cap_yaml_int(out, "bins", fit->bins);
    write_pictures(out, fit);
    cap_yaml_close(out);
    write_covariance(out, fit);
    cap_yaml_text(out, "source", fit->model->source);
    cap_yaml_close(out);
}

enum status rec_fits_write(const struct fits *fits, const char *path, struct error *err)
{
    struct yaml_out *out;
    enum status status = cap_yaml_begin(&out, path, err);
    if (status)
        return status;
    cap_yaml_list(out, "models");
    for (int i = 0; i < fits->count; i++)
        write_fit(out, &fits->fit[i]);
    cap_yaml_close(out);
    return cap_yaml_end(out, true, err);
}

/* ---- reading: libyaml's tree of the document --------------------------------------------------
 */

// A document, and what its errors are told with.
struct reading {
    yaml_document_t document;
    const char *path;
    struct error *err;
};

static enum status complain(struct reading *r, const yaml_node_t *at, const char *what,
                            const char *name)
{
    return cap_fail(r->err, STATUS_FORMAT, "%s: line %zu: %s%s", r->path,
                    at ? at->start_mark.line + 1 : 1, name, what);
}

// The member of a map; NULL: it is not there, or this is no map.
static const yaml_node_t *member(struct reading *r, const yaml_node_t *map, const char *key)
{
    if (!map || map->type != YAML_MAPPING_NODE)
        return NULL;
    for (const yaml_node_pair_t *p = map->data.mapping.pairs.start; p < map->data.mapping.pairs.top;
         p++) {
        const yaml_node_t *name = yaml_document_get_node(&r->document, p->key);
        if (name->type == YAML_SCALAR_NODE
            && strcmp((const char *)name->data.scalar.value, key) == 0)
            return yaml_document_get_node(&r->document, p->value);
    }
    return NULL;
}

static int items(const yaml_node_t *list)
{
    if (!list || list->type != YAML_SEQUENCE_NODE)
        return 0;
    return (int)(list->data.sequence.items.top - list->data.sequence.items.start);
}

static const yaml_node_t *item(struct reading *r, const yaml_node_t *list, int i)
{
    return yaml_document_get_node(&r->document, list->data.sequence.items.start[i]);
}

static bool number(const yaml_node_t *node, double *value)
{
    if (!node || node->type != YAML_SCALAR_NODE || !node->data.scalar.length)
        return false;
    const char *text = (const char *)node->data.scalar.value;
    char *end = NULL;
    *value = strtod(text, &end);
    if (strcmp(text, ".nan") != 0)
        return !*end;
    *value = NAN;
    return true;
}

// A number, or a list of `size` of them, or one number for all of them.
static bool numbers(struct reading *r, const yaml_node_t *node, double *value, int size)
{
    if (!node)
        return false;
    if (node->type == YAML_SCALAR_NODE) {
        bool ok = number(node, value);
        for (int i = 1; i < size; i++)
            value[i] = value[0];
        return ok;
    }
    bool ok = items(node) == size;
    for (int i = 0; ok && i < size; i++)
        ok = number(item(r, node, i), &value[i]);
    return ok;
}

static enum status read_parameters(struct reading *r, struct fit *fit, const yaml_node_t *map)
{
    int k = 0;
    for (const struct parameter *p = fit->model->parameter; p->name; k += p->size, p++) {
        const yaml_node_t *node = member(r, map, p->name);
        const yaml_node_t *value =
            node && node->type == YAML_MAPPING_NODE ? member(r, node, "value") : node;
        if (!value || !numbers(r, value, &fit->value[k], p->size))
            return complain(r, node ? node : map,
                            p->size == 1 ? ": a number is wanted" : ": three numbers are wanted",
                            p->name);
        for (int c = 0; c < p->size; c++)
            if (!(fit->value[k + c] >= p->low && fit->value[k + c] <= p->high))
                return cap_fail(r->err, STATUS_FORMAT, "%s: line %zu: %s is not in [%g, %g]",
                                r->path, value->start_mark.line + 1, p->name, p->low, p->high);
        if (!numbers(r, member(r, node, "sigma"), &fit->sigma[k], p->size))
            for (int c = 0; c < p->size; c++)
                fit->sigma[k + c] = NAN;
    }
    return STATUS_OK;
}

static enum status read_fit(struct reading *r, struct fit *fit, const yaml_node_t *node)
{
    const yaml_node_t *name = member(r, node, "name"), *errors = member(r, node, "errors");
    if (!name || name->type != YAML_SCALAR_NODE)
        return complain(r, node, "a model has no name", "");
    *fit = (struct fit){.model = rec_model_find((const char *)name->data.scalar.value),
                        .log_rms = NAN,
                        .relative_median = NAN,
                        .chi = NAN};
    if (!fit->model)
        return complain(r, name, ": no model is called so", (const char *)name->data.scalar.value);
    double bins = 0;
    number(member(r, errors, "log_rms"), &fit->log_rms);
    number(member(r, errors, "relative_median"), &fit->relative_median);
    number(member(r, errors, "chi"), &fit->chi);
    if (number(member(r, errors, "bins"), &bins) && bins >= 0 && bins <= MERL_BINS)
        fit->bins = (int)bins;
    const yaml_node_t *parameters = member(r, node, "parameters");
    if (!parameters || parameters->type != YAML_MAPPING_NODE)
        return complain(r, node, ": no parameters", fit->model->name);
    return read_parameters(r, fit, parameters);
}

static enum status read_document(struct reading *r, struct fits *fits)
{
    const yaml_node_t *root = yaml_document_get_root_node(&r->document);
    const yaml_node_t *models = member(r, root, "models");
    int count = items(models);
    if (!count)
        return complain(r, models ? models : root, "not a fits.yaml: a list 'models' is wanted",
                        "");
    struct fit *fit = calloc((size_t)count, sizeof *fit);
    if (!fit)
        return cap_fail(r->err, STATUS_MEMORY, "%s: no memory to read it", r->path);
    enum status status = STATUS_OK;
    for (int i = 0; i < count && !status; i++)
        status = read_fit(r, &fit[i], item(r, models, i));
    if (status)
        free(fit);
    else
        *fits = (struct fits){fit, count};
    return status;
}

enum status rec_fits_read(struct fits *fits, const char *path, struct error *err)
{
    struct reading r = {.path = path, .err = err};
    yaml_parser_t parser;
    FILE *file = fopen(path, "rb");
    if (!file)
        return cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
    if (!yaml_parser_initialize(&parser)) {
        fclose(file);
        return cap_fail(err, STATUS_MEMORY, "%s: no memory to read it", path);
    }
    yaml_parser_set_input_file(&parser, file);
    enum status status;
    if (yaml_parser_load(&parser, &r.document)) {
        status = read_document(&r, fits);
        yaml_document_delete(&r.document);
    } else {
        status = cap_fail(err, STATUS_FORMAT, "%s: line %zu: not YAML: %s", path,
                          parser.problem_mark.line + 1, parser.problem ? parser.problem : "");
    }
    yaml_parser_delete(&parser);
    fclose(file);
    return status;
}
