/* gltf_write.c -- a glTF 2.0 document with one metallic-roughness material.
 *
 * roughnessFactor is the root of GGX's alpha; the ior of a gloss other than 1.5 goes into
 * KHR_materials_ior. A matt material is a gloss of ior 1, which reflects nothing.
 */
#include "export.h"
#include "plain.h"

#include <jansson.h>

static json_t *material(const struct plain *p)
{
    const double *color = p->kind == PLAIN_METAL ? p->f0 : p->albedo;
    double through = p->kind == PLAIN_METAL ? 1 : rec_plain_through(p);
    json_t *m =
        json_pack("{s:s, s:{s:[f,f,f,f], s:f, s:f}}", "name", "goniocam", "pbrMetallicRoughness",
                  "baseColorFactor", fmin(1, color[0] / through), fmin(1, color[1] / through),
                  fmin(1, color[2] / through), 1.0, "metallicFactor",
                  p->kind == PLAIN_METAL ? 1.0 : 0.0, "roughnessFactor", sqrt(fmin(1, p->alpha)));
    if (p->kind != PLAIN_METAL)
        json_object_set_new(m, "extensions",
                            json_pack("{s:{s:f}}", "KHR_materials_ior", "ior", p->ior));
    return m;
}

static void fill(FILE *to, const void *data)
{
    const struct plain *p = data;
    json_t *root = json_pack("{s:{s:s, s:s}}", "asset", "version", "2.0", "generator", "goniocam");
    if (p->kind != PLAIN_METAL)
        json_object_set_new(root, "extensionsUsed", json_pack("[s]", "KHR_materials_ior"));
    json_object_set_new(root, "materials", json_pack("[o]", material(p)));
    json_dumpf(root, to, JSON_INDENT(2) | JSON_REAL_PRECISION(9));
    fputc('\n', to);
    json_decref(root);
}

enum status rec_gltf_write(const struct exported *what, const char *path, struct run *run,
                           struct error *err)
{
    struct plain plain;
    enum status status = rec_plain_find(&plain, what->brdf, what->source, run, err);
    return status ? status : rec_text_write(path, fill, &plain, err);
}
