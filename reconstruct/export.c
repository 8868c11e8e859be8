/* export.c -- the table of formats that a BRDF is written in. A new one is a file and a line here.
 */
#include "export.h"
#include "rgl.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

static enum status merl_write(const struct exported *what, const char *path, struct run *run,
                              struct error *err)
{
    struct merl table = {0};
    enum status status = rec_brdf_table(&table, what->brdf, run->threads, err);
    if (!status)
        status = rec_merl_write(&table, path, err);
    rec_merl_free(&table);
    return status;
}

// X, X.bsdf, X_rgb.bsdf: all stand for X_rgb.bsdf and X_spec.bsdf.
static enum status rgl_write(const struct exported *what, const char *path, struct run *run,
                             struct error *err)
{
    static const char *const endings[] = {".bsdf", "_rgb", "_spec"};
    char *base = strdup(path);
    if (!base)
        return cap_fail(err, STATUS_MEMORY, "%s: no memory", path);
    for (int i = 0; i < 3; i++) {
        size_t length = strlen(base), ending = strlen(endings[i]);
        if (length > ending && strcmp(base + length - ending, endings[i]) == 0)
            base[length - ending] = '\0';
    }
    enum status status = rec_rgl_write(what->brdf, base, run, err);
    free(base);
    return status;
}

const struct exporter rec_exporters[] = {
    {"merl", ".binary", "MERL table", merl_write},
    {"rgl", ".bsdf", "X_rgb.bsdf and X_spec.bsdf: `measured` of Mitsuba 3, of pbrt-v4", rgl_write},
    {"mitsuba", ".xml", "Mitsuba 3 BSDF with fitted parameters", rec_mitsuba_write},
    {"pbrt", ".pbrt", "pbrt-v4 material with fitted parameters", rec_pbrt_write},
    {"materialx", ".mtlx", "MaterialX standard_surface", rec_materialx_write},
    {"gltf", ".gltf", "glTF 2.0 metallic-roughness material", rec_gltf_write},
    {"exr", ".exr", "X_slice.exr (theta_h x theta_d) and X_sphere.exr, linear", rec_exr_write},
    {"csv", ".csv", "every bin's angles and r, g, b", rec_csv_write},
    {"json", ".json", "a model's parameters, or the table's bins", rec_json_write},
    {0},
};

const struct exporter *rec_exporter_find(const char *name)
{
    for (const struct exporter *e = rec_exporters; e->name; e++)
        if (strcmp(e->name, name) == 0)
            return e;
    return NULL;
}

enum status rec_text_write(const char *path, void (*fill)(FILE *to, const void *data),
                           const void *data, struct error *err)
{
    struct atomic_file file;
    enum status status = cap_file_begin(&file, path, true, err);
    if (status)
        return status;
    fill(file.stream, data);
    if (!ferror(file.stream))
        return cap_file_commit(&file, err);
    status = cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
    cap_file_abandon(&file);
    return status;
}
