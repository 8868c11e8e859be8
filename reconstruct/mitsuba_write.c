/* mitsuba_write.c -- a Mitsuba 3 BSDF with fitted parameters: diffuse, roughplastic,
 * roughconductor.
 *
 * roughplastic lets light through its surface twice, T(wi) T(wo) diff / (pi (1 - F_out)), where
 * goniocam's matt part is albedo / pi. The mean of T over wo is 1 - F_out, so that diff = albedo /
 * T straight down makes the reflectance of light along the normal the same. roughconductor wants
 * eta and k: of all metals with a given reflectance straight down, the one with eta = (1 - r) / (1
 * + r), the most metallic (O. Gulbrandsen, "Artist Friendly Metallic Fresnel", JCGT 2014).
 */
#include "export.h"
#include "plain.h"

static void write_diffuse(FILE *to, const struct plain *p, const char *name)
{
    double through = rec_plain_through(p);
    fprintf(to, "        <rgb name=\"%s\" value=\"%.6g, %.6g, %.6g\"/>\n", name,
            fmin(1, p->albedo[0] / through), fmin(1, p->albedo[1] / through),
            fmin(1, p->albedo[2] / through));
}

static void write_gloss(FILE *to, const struct plain *p)
{
    fprintf(to,
            "        <string name=\"distribution\" value=\"ggx\"/>\n"
            "        <float name=\"alpha\" value=\"%.6g\"/>\n",
            p->alpha);
}

static void write_metal(FILE *to, const struct plain *p)
{
    double eta[3], k[3];
    for (int c = 0; c < 3; c++) {
        double r = fmin(fmax(p->f0[c], 0), 0.999);
        eta[c] = (1 - r) / (1 + r);
        k[c] = sqrt((r * (eta[c] + 1) * (eta[c] + 1) - (eta[c] - 1) * (eta[c] - 1)) / (1 - r));
    }
    fprintf(to,
            "        <rgb name=\"eta\" value=\"%.6g, %.6g, %.6g\"/>\n"
            "        <rgb name=\"k\" value=\"%.6g, %.6g, %.6g\"/>\n",
            eta[0], eta[1], eta[2], k[0], k[1], k[2]);
}

static void fill(FILE *to, const void *data)
{
    static const char *const type[] = {"diffuse", "roughplastic", "roughconductor"};
    const struct plain *p = data;
    fprintf(to,
            "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
            "<!-- goniocam: the fit of model %s -->\n<scene version=\"3.0.0\">\n"
            "    <bsdf type=\"%s\" id=\"goniocam\">\n",
            p->model, type[p->kind]);
    if (p->kind != PLAIN_MATT)
        write_gloss(to, p);
    if (p->kind == PLAIN_METAL)
        write_metal(to, p);
    else
        write_diffuse(to, p, p->kind == PLAIN_MATT ? "reflectance" : "diffuse_reflectance");
    if (p->kind == PLAIN_GLOSSY)
        fprintf(to, "        <float name=\"int_ior\" value=\"%.6g\"/>\n", p->ior);
    fprintf(to, "    </bsdf>\n</scene>\n");
}

enum status rec_mitsuba_write(const struct exported *what, const char *path, struct run *run,
                              struct error *err)
{
    struct plain plain;
    enum status status = rec_plain_find(&plain, what->brdf, what->source, run, err);
    return status ? status : rec_text_write(path, fill, &plain, err);
}
