/* surface.c -- SURFACE.yaml, and the patch that it describes. */
#include "surface.h"

#include "calib.h"
#include "scene_material.h"

#include <stdlib.h>
#include <string.h>

static void read_kind(struct surface *s, struct doc *doc, doc_node node)
{
    const char *kind = sam_doc_text(doc, node, "kind", NULL);
    if (strcmp(kind, "gaussian") == 0) {
        s->kind = SURFACE_GAUSSIAN;
        s->alpha = sam_doc_number(doc, node, "alpha", NAN, 0.001, 2);
        s->nodes = sam_doc_int(doc, node, "nodes", 512, 64, 4096);
    } else if (strcmp(kind, "fibres") == 0) {
        s->kind = SURFACE_FIBRES;
        s->fibres = sam_doc_int(doc, node, "count", 20000, 1, 1000000);
        s->radius = sam_doc_number(doc, node, "radius", 0.002, 1e-5, 0.1);
        s->length = sam_doc_number(doc, node, "length", 0.03, 1e-4, 0.5);
        s->tilt = sam_doc_number(doc, node, "tilt_deg", 25, 0, 89) * CAP_PI / 180;
    } else {
        sam_doc_wrong(doc, sam_doc_get(doc, node, "kind"), "kind: gaussian or fibres");
    }
}

// One model that can be sampled, or a mirror.
static void check_material(const struct material *m, struct doc *doc, doc_node node)
{
    bool mirror = sam_material_mirrors(m);
    if (!sam_doc_fine(doc))
        return;
    if (m->parts + mirror != 1 || (m->parts && !m->part[0].model))
        sam_doc_wrong(doc, node, "material: one model, or a mirror, is wanted");
}

enum status sam_surface_read(struct surface *surface, const char *path, struct error *err)
{
    struct doc *doc;
    struct surface s = {.nodes = 0};
    enum status status = sam_doc_open(&doc, path, err);
    if (status)
        return status;
    doc_node root = sam_doc_root(doc);
    sam_doc_int(doc, root, "goniocam_surface", -1, 1, 1);
    sam_doc_need(doc, root, "goniocam_surface");
    doc_node shape = sam_doc_need(doc, root, "surface");
    doc_node material = sam_doc_need(doc, root, "material");
    if (shape)
        read_kind(&s, doc, shape);
    if (material) {
        sam_read_material(&s.material, doc, material, true);
        check_material(&s.material, doc, material);
    }
    sam_doc_text(doc, root, "materials", "");
    s.rays = (long long)sam_doc_number(doc, root, "rays", 4e6, 1e3, 1e12);
    s.bounces = sam_doc_int(doc, root, "bounces", 16, 1, 1000);
    s.seed = (uint64_t)sam_doc_int(doc, root, "seed", 1, 0, 1 << 30);
    status = sam_doc_close(doc, err);
    if (status)
        sam_surface_free(&s);
    else
        *surface = s;
    return status;
}

void sam_surface_free(struct surface *surface)
{
    sam_material_free(&surface->material);
}

enum status sam_surface_make(struct patch_mesh *patch, const struct surface *surface, int threads,
                             struct error *err)
{
    bool fibres = surface->kind == SURFACE_FIBRES;
    struct geometry g = fibres ? sam_fibres(surface) : sam_gaussian_field(surface, threads);
    enum status status = STATUS_MEMORY;
    double top = 0;
    if (g.point && g.normal && g.triangle) {
        status = cal_mesh_make(&patch->mesh, g.point, g.normal, g.points,
                               (const unsigned(*)[3])g.triangle, g.triangles, err);
        for (int i = 0; i < g.points; i++)
            top = fmax(top, g.point[i].z);
        // The middle half of each side.
        patch->core = g.point ? 0.5 * fabs(g.point[0].x) : 0;
        patch->top = top * 1.01 + 1e-3 * patch->core;
    } else {
        cap_fail(err, STATUS_MEMORY, "no memory for %d triangles", g.triangles);
    }
    free(g.point);
    free(g.normal);
    free(g.triangle);
    return status;
}
