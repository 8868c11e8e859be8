/* scene_material.c -- materials of SCENE.yaml: models, published parameters, tables, sums. */
#include "scene_material.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>

static void read_model(struct material_part *part, struct doc *doc, doc_node node)
{
    const char *name = sam_doc_text(doc, node, "model", NULL);
    part->model = rec_model_find(name);
    if (!part->model) {
        sam_doc_wrong(doc, sam_doc_get(doc, node, "model"), "model: none is called '%s'", name);
        return;
    }
    double *value = part->parameter;
    for (const struct parameter *p = part->model->parameter; p->name; p++) {
        sam_doc_need(doc, node, p->name);
        sam_doc_numbers(doc, node, p->name, value, p->size, true, p->low, p->high);
        value += p->size;
    }
}

// ---- published materials: {"sgd": {NAME: {PARAMETER: number or [3]}}, "abc": ...}

/** A parameter of a published material. false: it is not there or not physical. */
static bool published_parameter(const struct parameter *p, const json_t *material, double *value)
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

/** Where a parameter begins in a part that has it. */
static double *at(struct material_part *part, const char *name)
{
    double *value = part->parameter;
    for (const struct parameter *p = part->model->parameter; strcmp(p->name, name) != 0; p++)
        value += p->size;
    return value;
}

/** Goniocam's sgd normalises D by itself; the published kap, which does so too in all materials but
 *  chrome, goes into rhoS. Straight down f = kap exp(-alpha) / (pi^2 alpha^p) for rhoD = 0, rhoS =
 *  F = 1. */
static void keep_published_kap(struct material_part *part, const json_t *material)
{
    struct material_part probe = *part;
    for (int c = 0; c < 3; c++) {
        at(&probe, "rhoD")[c] = at(&probe, "F1")[c] = at(&probe, "lambda")[c] = 0;
        at(&probe, "rhoS")[c] = at(&probe, "F0")[c] = 1;
    }
    double f[3];
    vec3 n = {0, 0, 1};
    probe.model->eval(probe.parameter, n, n, f);
    for (int c = 0; c < 3; c++) {
        double alpha = at(part, "alpha")[c], p = at(part, "p")[c];
        double kap = f[c] * CAP_PI * CAP_PI * exp(alpha) * pow(alpha, p);
        json_t *given = json_array_get(json_object_get(material, "kap"), (size_t)c);
        if (json_is_number(given))
            at(part, "rhoS")[c] *= json_number_value(given) / kap;
    }
}

static void take_published(struct material_part *part, struct doc *doc, doc_node node,
                           const json_t *root, const char *kind, const char *name)
{
    const json_t *family = json_object_get(root, kind), *found = json_object_get(family, name);
    if (!found) {
        sam_doc_wrong(doc, node, "%s: the file `materials` has no '%s'", kind, name);
        return;
    }
    part->model = rec_model_find(kind);
    double *value = part->parameter;
    for (const struct parameter *p = part->model->parameter; p->name; p++) {
        if (!published_parameter(p, found, value))
            sam_doc_wrong(doc, node, "%s: '%s' has no proper %s in the file `materials`", kind,
                          name, p->name);
        value += p->size;
    }
    if (strcmp(kind, "sgd") == 0 && sam_doc_fine(doc))
        keep_published_kap(part, found);
}

static void read_published(struct material_part *part, struct doc *doc, doc_node node,
                           const char *kind)
{
    const char *file = sam_doc_text(doc, sam_doc_root(doc), "materials", NULL);
    const char *name = sam_doc_text(doc, node, kind, NULL);
    char *path = sam_doc_beside(doc, file);
    json_error_t why;
    json_t *root = path ? json_load_file(path, 0, &why) : NULL;
    if (root)
        take_published(part, doc, node, root, kind, name);
    else
        sam_doc_wrong(doc, sam_doc_get(doc, sam_doc_root(doc), "materials"), "materials: %s",
                      path ? why.text : "out of memory");
    json_decref(root);
    free(path);
}

static void read_table(struct material_part *part, struct doc *doc, doc_node node)
{
    struct error why = {0};
    char *path = sam_doc_beside(doc, sam_doc_text(doc, node, "table", NULL));
    if (!path || rec_merl_read(&part->table, path, &why))
        sam_doc_wrong(doc, node, "table: %s", path ? why.text : "out of memory");
    free(path);
}

// ---- one material, or a sum

static void read_mirror(struct material *material, struct doc *doc, doc_node node, bool allowed)
{
    double reflectance[3] = {0, 0, 0};
    sam_doc_numbers(doc, node, "mirror", reflectance, 3, true, 0, 1);
    for (int c = 0; c < 3; c++)
        material->mirror[c] += reflectance[c];
    if (!allowed)
        sam_doc_wrong(doc, node,
                      "mirror: a sample's reflectance is finite; a ball of `things` may "
                      "be a mirror");
}

static void read_one(struct material *material, struct doc *doc, doc_node node, bool may_mirror)
{
    struct material_part part = {.scale = {1, 1, 1}};
    if (sam_doc_get(doc, node, "mirror")) {
        read_mirror(material, doc, node, may_mirror);
        return;
    }
    if (sam_doc_get(doc, node, "sgd"))
        read_published(&part, doc, node, "sgd");
    else if (sam_doc_get(doc, node, "abc"))
        read_published(&part, doc, node, "abc");
    else if (sam_doc_get(doc, node, "table"))
        read_table(&part, doc, node);
    else
        read_model(&part, doc, node);
    sam_doc_numbers(doc, node, "scale", part.scale, 3, true, 0, 1e6);
    if (material->parts == MATERIAL_PARTS) {
        sam_doc_wrong(doc, node, "material: a sum of at most %d", MATERIAL_PARTS);
        rec_merl_free(&part.table);
    } else if (part.model || part.table.value) {
        material->part[material->parts++] = part;
    }
}

void sam_read_material(struct material *material, struct doc *doc, doc_node node, bool may_mirror)
{
    if (!sam_doc_is_list(doc, node)) {
        read_one(material, doc, node, may_mirror);
        return;
    }
    int count = sam_doc_count(doc, node);
    for (int i = 0; i < count; i++)
        read_one(material, doc, sam_doc_item(doc, node, i), may_mirror);
    if (count == 0)
        sam_doc_wrong(doc, node, "material: at least one is wanted");
}
