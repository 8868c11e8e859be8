/* plain.c -- a material reduced to what most renderers know: matt, glossy over matt, or metal.
 *
 * A gloss with Schlick's f0 is the dielectric with the same reflectance at normal incidence, its
 * ior by f0 = ((n - 1) / (n + 1))^2; one that reflects more than a dielectric can, or has colour,
 * is a metal.
 */
#include "formats.h"
#include "plain.h"

#include <stdlib.h>
#include <string.h>

static double mean(const double v[3])
{
    return (v[0] + v[1] + v[2]) / 3;
}

double rec_plain_through(const struct plain *plain)
{
    return plain->kind == PLAIN_GLOSSY ? 1 - mean(plain->f0) : 1;
}

static bool from_ggx(struct plain *p, const double *value)
{
    *p = (struct plain){.kind = PLAIN_GLOSSY, .alpha = value[3], .ior = value[4]};
    memcpy(p->albedo, value, sizeof p->albedo);
    for (int c = 0; c < 3; c++)
        p->f0[c] = pow((p->ior - 1) / (p->ior + 1), 2);
    return true;
}

// A metal's f0 is above any clear dielectric's (diamond: 0.17), or has colour.
static bool from_schlick(struct plain *p, const double *value)
{
    const double *albedo = value, *f0 = value + 3;
    double most = fmax(f0[0], fmax(f0[1], f0[2])), least = fmin(f0[0], fmin(f0[1], f0[2]));
    bool metal = mean(f0) > 0.2 || (most > 0.08 && most - least > 0.3 * most);
    double root = sqrt(fmin(mean(f0), 0.99));
    *p = (struct plain){.kind = metal ? PLAIN_METAL : PLAIN_GLOSSY,
                        .alpha = value[6],
                        .ior = (1 + root) / (1 - root)};
    memcpy(p->albedo, albedo, sizeof p->albedo);
    memcpy(p->f0, f0, sizeof p->f0);
    return true;
}

static bool from_model(struct plain *p, const struct model *model, const double *value)
{
    bool known = true;
    if (strcmp(model->name, "ggx") == 0) {
        from_ggx(p, value);
    } else if (strcmp(model->name, "ggx_schlick") == 0) {
        from_schlick(p, value);
    } else if (strcmp(model->name, "lambert") == 0) {
        *p = (struct plain){.kind = PLAIN_MATT, .alpha = 1, .ior = 1};
        memcpy(p->albedo, value, sizeof p->albedo);
    } else {
        known = false;
    }
    p->model = model->name;
    return known;
}

static bool from_fits(struct plain *p, const struct fits *fits)
{
    for (int i = 0; i < fits->count; i++)
        if (from_model(p, fits->fit[i].model, fits->fit[i].value))
            return true;
    return false;
}

// Every so many bins are enough for a handful of parameters.
static void thin(struct bins *bins, int step)
{
    int kept = 0;
    for (int i = 0; i < bins->count; i += step)
        bins->bin[kept++] = bins->bin[i];
    bins->count = kept;
}

static enum status fit(struct plain *p, const struct brdf *brdf, struct run *run, struct error *err)
{
    const struct model *models[] = {rec_model_find("lambert"), rec_model_find("ggx"),
                                    rec_model_find("ggx_schlick")};
    struct merl table = {0};
    struct bins bins = {0};
    struct fits fits = {0};
    enum status status = rec_brdf_table(&table, brdf, run->threads, err);
    if (!status)
        status = rec_bins_of_table(&bins, &table, err);
    rec_merl_free(&table);
    if (!status) {
        thin(&bins, 23);
        status = rec_fit_by(&fits, &bins, FIT_PICTURE, models, 3, run, err);
    }
    if (!status)
        from_fits(p, &fits);
    rec_fits_free(&fits);
    rec_bins_free(&bins);
    return status;
}

enum status rec_plain_find(struct plain *plain, const struct brdf *brdf, const char *path,
                           struct run *run, struct error *err)
{
    struct fits fits = {0};
    bool found = brdf->model && from_model(plain, brdf->model, brdf->value);
    enum status status = STATUS_OK;
    if (!found && rec_format_of(path, NULL) == &rec_format_fits) {
        status = rec_fits_read(&fits, path, err);
        found = !status && from_fits(plain, &fits);
        rec_fits_free(&fits);
    }
    return found || status ? status : fit(plain, brdf, run, err);
}
