/* materialx_write.c -- a MaterialX document with one standard_surface.
 *
 * Its specular_roughness is the root of GGX's alpha, and its gloss takes from the base what it
 * reflects: the base colour is the albedo over what passes straight down.
 */
#include "export.h"
#include "plain.h"

static void input(FILE *to, const char *name, double value)
{
    fprintf(to, "    <input name=\"%s\" type=\"float\" value=\"%.6g\"/>\n", name, value);
}

static void fill(FILE *to, const void *data)
{
    const struct plain *p = data;
    const double *color = p->kind == PLAIN_METAL ? p->f0 : p->albedo;
    double through = p->kind == PLAIN_METAL ? 1 : rec_plain_through(p);
    fprintf(to,
            "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
            "<!-- goniocam: the fit of model %s -->\n<materialx version=\"1.38\">\n"
            "  <standard_surface name=\"goniocam_surface\" type=\"surfaceshader\">\n",
            p->model);
    input(to, "base", 1);
    fprintf(to, "    <input name=\"base_color\" type=\"color3\" value=\"%.6g, %.6g, %.6g\"/>\n",
            fmin(1, color[0] / through), fmin(1, color[1] / through), fmin(1, color[2] / through));
    input(to, "specular", p->kind == PLAIN_MATT ? 0 : 1);
    input(to, "specular_roughness", sqrt(fmin(1, p->alpha)));
    if (p->kind == PLAIN_GLOSSY)
        input(to, "specular_IOR", p->ior);
    input(to, "metalness", p->kind == PLAIN_METAL ? 1 : 0);
    fprintf(to, "  </standard_surface>\n"
                "  <surfacematerial name=\"goniocam\" type=\"material\">\n"
                "    <input name=\"surfaceshader\" type=\"surfaceshader\" "
                "nodename=\"goniocam_surface\"/>\n"
                "  </surfacematerial>\n</materialx>\n");
}

enum status rec_materialx_write(const struct exported *what, const char *path, struct run *run,
                                struct error *err)
{
    struct plain plain;
    enum status status = rec_plain_find(&plain, what->brdf, what->source, run, err);
    return status ? status : rec_text_write(path, fill, &plain, err);
}
