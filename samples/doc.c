/* doc.c -- a YAML document, read key by key, on libyaml. */
#include "doc.h"

#include <assert.h>
#include <errno.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <yaml.h>

struct doc {
    yaml_document_t yaml;
    char *path;
    bool *asked;  // [nodes + 1] of the keys of mappings
    struct error error;
};

static enum status parse(struct doc *doc, FILE *file, const char *path, struct error *err)
{
    yaml_parser_t parser;
    if (!yaml_parser_initialize(&parser))
        return cap_fail(err, STATUS_MEMORY, "%s: out of memory", path);
    yaml_parser_set_input_file(&parser, file);
    enum status status = STATUS_OK;
    if (!yaml_parser_load(&parser, &doc->yaml)) {
        status = cap_fail(err, STATUS_FORMAT, "%s:%zu: %s", path, parser.problem_mark.line + 1,
                          parser.problem ? parser.problem : "not YAML");
    } else if (!yaml_document_get_root_node(&doc->yaml)) {
        yaml_document_delete(&doc->yaml);
        status = cap_fail(err, STATUS_FORMAT, "%s: the file is empty", path);
    }
    yaml_parser_delete(&parser);
    return status;
}

static void free_doc(struct doc *doc)
{
    if (doc) {
        free(doc->path);
        free(doc->asked);
        free(doc);
    }
}

enum status sam_doc_open(struct doc **out, const char *path, struct error *err)
{
    struct doc *doc = calloc(1, sizeof *doc);
    FILE *file = fopen(path, "rb");
    enum status status = STATUS_OK;
    if (!file)
        status = cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
    else if (!doc || !(doc->path = strdup(path)))
        status = cap_fail(err, STATUS_MEMORY, "%s: out of memory", path);
    else
        status = parse(doc, file, path, err);
    if (!status) {
        assert(doc);
        size_t nodes = (size_t)(doc->yaml.nodes.top - doc->yaml.nodes.start);
        doc->asked = calloc(nodes + 1, sizeof *doc->asked);
        if (!doc->asked) {
            yaml_document_delete(&doc->yaml);
            status = cap_fail(err, STATUS_MEMORY, "%s: out of memory", path);
        }
    }
    if (file)
        fclose(file);
    if (status)
        free_doc(doc);
    else
        *out = doc;
    return status;
}

static yaml_node_t *node_of(const struct doc *doc, doc_node node)
{
    return yaml_document_get_node((yaml_document_t *)&doc->yaml, node);
}

static const char *text_of(const yaml_node_t *node)
{
    return node && node->type == YAML_SCALAR_NODE ? (const char *)node->data.scalar.value : "?";
}

/** The first key that nobody asked for, below any mapping. */
static void find_unasked(struct doc *doc)
{
    int nodes = (int)(doc->yaml.nodes.top - doc->yaml.nodes.start);
    for (int i = 1; i <= nodes && sam_doc_fine(doc); i++) {
        yaml_node_t *node = node_of(doc, i);
        if (!node || node->type != YAML_MAPPING_NODE)
            continue;
        for (yaml_node_pair_t *p = node->data.mapping.pairs.start; p < node->data.mapping.pairs.top;
             p++)
            if (!doc->asked[p->key])
                sam_doc_wrong(doc, p->key, "unknown key '%s'", text_of(node_of(doc, p->key)));
    }
}

enum status sam_doc_close(struct doc *doc, struct error *err)
{
    if (sam_doc_fine(doc))
        find_unasked(doc);
    enum status status = doc->error.status;
    if (status)
        cap_fail(err, status, "%s", doc->error.text);
    yaml_document_delete(&doc->yaml);
    free_doc(doc);
    return status;
}

bool sam_doc_fine(const struct doc *doc)
{
    return !doc->error.status;
}

void sam_doc_wrong(struct doc *doc, doc_node node, const char *format, ...)
{
    if (!sam_doc_fine(doc))
        return;
    const yaml_node_t *n = node_of(doc, node);
    char story[400];
    va_list args;
    va_start(args, format);
    vsnprintf(story, sizeof story, format, args);
    va_end(args);
    cap_fail(&doc->error, STATUS_FORMAT, "%s:%zu: %s", doc->path,
             n ? n->start_mark.line + 1 : (size_t)1, story);
}

char *sam_doc_beside(const struct doc *doc, const char *file)
{
    const char *slash = strrchr(doc->path, '/');
    if (file[0] == '/' || !slash)
        return strdup(file);
    char *path = NULL;
    int folder = (int)(slash - doc->path);
    return asprintf(&path, "%.*s/%s", folder, doc->path, file) < 0 ? NULL : path;
}

doc_node sam_doc_root(const struct doc *doc)
{
    assert(node_of(doc, 1));
    return 1;  // libyaml counts nodes from 1, and the root is the first
}

doc_node sam_doc_get(struct doc *doc, doc_node map, const char *key)
{
    const yaml_node_t *node = map ? node_of(doc, map) : NULL;
    if (!node)
        return 0;
    if (node->type != YAML_MAPPING_NODE) {
        sam_doc_wrong(doc, map, "keys and values are wanted here, with '%s' among them", key);
        return 0;
    }
    for (const yaml_node_pair_t *p = node->data.mapping.pairs.start;
         p < node->data.mapping.pairs.top; p++)
        if (strcmp(text_of(node_of(doc, p->key)), key) == 0) {
            doc->asked[p->key] = true;
            return p->value;
        }
    return 0;
}

doc_node sam_doc_need(struct doc *doc, doc_node map, const char *key)
{
    doc_node value = sam_doc_get(doc, map, key);
    if (!value && map)
        sam_doc_wrong(doc, map, "the key '%s' is missing here", key);
    return value;
}

bool sam_doc_is_list(const struct doc *doc, doc_node node)
{
    return node && node_of(doc, node)->type == YAML_SEQUENCE_NODE;
}

int sam_doc_count(struct doc *doc, doc_node list)
{
    if (!list)
        return 0;
    if (!sam_doc_is_list(doc, list)) {
        sam_doc_wrong(doc, list, "a list is wanted here");
        return 0;
    }
    const yaml_node_t *node = node_of(doc, list);
    return (int)(node->data.sequence.items.top - node->data.sequence.items.start);
}

doc_node sam_doc_item(struct doc *doc, doc_node list, int i)
{
    assert(i >= 0 && i < sam_doc_count(doc, list));
    return node_of(doc, list)->data.sequence.items.start[i];
}

/** The number that a scalar holds. false, and the story told: it holds none in [low, high]. */
static bool as_number(struct doc *doc, doc_node node, const char *key, double low, double high,
                      double *value)
{
    const yaml_node_t *n = node_of(doc, node);
    char *end = NULL;
    double number = n->type == YAML_SCALAR_NODE ? strtod(text_of(n), &end) : 0;
    if (!end || end == text_of(n) || *end)
        sam_doc_wrong(doc, node, "%s: a number is wanted, not '%s'", key, text_of(n));
    else if (!(number >= low && number <= high) || !isfinite(number))
        sam_doc_wrong(doc, node, "%s: %s is not in [%g, %g]", key, text_of(n), low, high);
    else {
        *value = number;
        return true;
    }
    return false;
}

double sam_doc_number(struct doc *doc, doc_node map, const char *key, double fallback, double low,
                      double high)
{
    doc_node node = isnan(fallback) ? sam_doc_need(doc, map, key) : sam_doc_get(doc, map, key);
    double value = isnan(fallback) ? fmax(low, fmin(high, 1)) : fallback;
    if (node)
        as_number(doc, node, key, low, high, &value);
    return value;
}

int sam_doc_int(struct doc *doc, doc_node map, const char *key, int fallback, int low, int high)
{
    doc_node node = sam_doc_get(doc, map, key);
    double value = fallback;
    if (node && as_number(doc, node, key, low, high, &value) && value != floor(value)) {
        sam_doc_wrong(doc, node, "%s: a whole number is wanted", key);
        value = fallback;
    }
    return (int)value;
}

bool sam_doc_bool(struct doc *doc, doc_node map, const char *key, bool fallback)
{
    doc_node node = sam_doc_get(doc, map, key);
    if (!node)
        return fallback;
    const char *text = text_of(node_of(doc, node));
    if (strcmp(text, "true") == 0)
        return true;
    if (strcmp(text, "false") != 0)
        sam_doc_wrong(doc, node, "%s: true or false is wanted, not '%s'", key, text);
    return false;
}

const char *sam_doc_text(struct doc *doc, doc_node map, const char *key, const char *fallback)
{
    doc_node node = fallback ? sam_doc_get(doc, map, key) : sam_doc_need(doc, map, key);
    if (!node)
        return fallback ? fallback : "";
    const yaml_node_t *n = node_of(doc, node);
    if (n->type != YAML_SCALAR_NODE) {
        sam_doc_wrong(doc, node, "%s: a text is wanted", key);
        return fallback ? fallback : "";
    }
    return text_of(n);
}

void sam_doc_numbers(struct doc *doc, doc_node map, const char *key, double *value, int count,
                     bool spread, double low, double high)
{
    doc_node node = sam_doc_get(doc, map, key);
    if (!node)
        return;
    if (spread && !sam_doc_is_list(doc, node)) {
        double one = 0;
        if (as_number(doc, node, key, low, high, &one))
            for (int i = 0; i < count; i++)
                value[i] = one;
    } else if (sam_doc_count(doc, node) != count) {
        sam_doc_wrong(doc, node, "%s: a list of %d numbers is wanted", key, count);
    } else {
        for (int i = 0; i < count; i++)
            as_number(doc, sam_doc_item(doc, node, i), key, low, high, &value[i]);
    }
}

vec3 sam_doc_vec3(struct doc *doc, doc_node map, const char *key, vec3 fallback)
{
    double v[3] = {fallback.x, fallback.y, fallback.z};
    sam_doc_numbers(doc, map, key, v, 3, false, -1e9, 1e9);
    return (vec3){v[0], v[1], v[2]};
}

vec3 sam_doc_as_vec3(struct doc *doc, doc_node node)
{
    double v[3] = {0, 0, 0};
    if (sam_doc_count(doc, node) != 3)
        sam_doc_wrong(doc, node, "a list of 3 numbers is wanted");
    else
        for (int i = 0; i < 3; i++)
            as_number(doc, sam_doc_item(doc, node, i), "coordinate", -1e9, 1e9, &v[i]);
    return (vec3){v[0], v[1], v[2]};
}
