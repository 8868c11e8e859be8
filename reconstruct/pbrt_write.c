/* pbrt_write.c -- a pbrt-v4 material with fitted parameters: diffuse, coateddiffuse, conductor.
 *
 * coateddiffuse's base is seen through its coat: as for Mitsuba, its reflectance is the albedo over
 * what passes straight down.
 */
#include "export.h"
#include "plain.h"

static void fill(FILE *to, const void *data)
{
    static const char *const type[] = {"diffuse", "coateddiffuse", "conductor"};
    const struct plain *p = data;
    const double *color = p->kind == PLAIN_METAL ? p->f0 : p->albedo;
    double through = p->kind == PLAIN_METAL ? 1 : rec_plain_through(p);
    fprintf(to,
            "# goniocam: the fit of model %s\n"
            "MakeNamedMaterial \"goniocam\"\n    \"string type\" [ \"%s\" ]\n",
            p->model, type[p->kind]);
    fprintf(to, "    \"rgb reflectance\" [ %.6g %.6g %.6g ]\n", fmin(1, color[0] / through),
            fmin(1, color[1] / through), fmin(1, color[2] / through));
    if (p->kind != PLAIN_MATT)
        fprintf(to, "    \"float roughness\" [ %.6g ]\n    \"bool remaproughness\" [ false ]\n",
                p->alpha);
    if (p->kind == PLAIN_GLOSSY)
        fprintf(to, "    \"float eta\" [ %.6g ]\n", p->ior);
    fprintf(to, "NamedMaterial \"goniocam\"\n");
}

enum status rec_pbrt_write(const struct exported *what, const char *path, struct run *run,
                           struct error *err)
{
    struct plain plain;
    enum status status = rec_plain_find(&plain, what->brdf, what->source, run, err);
    return status ? status : rec_text_write(path, fill, &plain, err);
}
