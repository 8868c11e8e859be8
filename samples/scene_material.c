/* scene_material.c -- materials of SCENE.yaml: models, published parameters, tables, sums. */
#include "scene_material.h"

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

static void read_published(struct material_part *part, struct doc *doc, doc_node node,
                           const char *kind)
{
    struct brdf brdf = {0};
    struct error why = {0};
    const char *file = sam_doc_text(doc, sam_doc_root(doc), "materials", NULL);
    const char *name = sam_doc_text(doc, node, kind, NULL);
    char *path = sam_doc_beside(doc, file);
    if (path && !rec_published_read(&brdf, path, kind, name, &why)) {
        part->model = brdf.model;
        memcpy(part->parameter, brdf.value, sizeof part->parameter);
    } else {
        sam_doc_wrong(doc, node, "materials: %s", path ? why.text : "out of memory");
    }
    free(path);
}

static void read_table(struct material_part *part, struct doc *doc, doc_node node)
{
    struct error why = {0};
    char *path = sam_doc_beside(doc, sam_doc_text(doc, node, "table", NULL));
    if (!path || rec_merl_read(&part->table.table, path, &why)
        || rec_brdf_prepare(&part->table, &why))
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
        rec_brdf_free(&part.table);
    } else if (part.model || part.table.table.value) {
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
