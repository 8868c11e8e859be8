/* brdf.c -- a BRDF from whatever file holds one. */
#include "lobes.h"
#include "reconstruct.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

// Does the file begin like a MERL table? A file too short to tell does not.
static bool looks_like_merl(const char *path)
{
    int32_t n[3] = {0};
    FILE *file = fopen(path, "rb");
    bool yes = file && fread(n, sizeof n, 1, file) == 1 && n[0] == MERL_THETA_H
               && n[1] == MERL_THETA_D && n[2] == MERL_PHI_D;
    if (file)
        fclose(file);
    return yes;
}

// Zero bytes never stand in text.
static bool looks_like_text(const char *path)
{
    char start[256];
    FILE *file = fopen(path, "rb");
    size_t n = file ? fread(start, 1, sizeof start, file) : 0;
    if (file)
        fclose(file);
    return n > 0 && !memchr(start, 0, n);
}

static enum status read_best_fit(struct brdf *brdf, const char *path, struct error *err)
{
    struct fits fits = {0};
    enum status status = rec_fits_read(&fits, path, err);
    if (!status) {
        *brdf = (struct brdf){.model = fits.fit[0].model};
        memcpy(brdf->value, fits.fit[0].value, sizeof brdf->value);
    }
    rec_fits_free(&fits);
    return status;
}

enum status rec_brdf_read(struct brdf *brdf, const char *path, struct error *err)
{
    struct stat info;
    if (stat(path, &info) != 0)
        return cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
    if (S_ISDIR(info.st_mode)) {
        char *table = cap_path(path, "brdf.binary");
        enum status status = table ? rec_merl_read(&brdf->table, table, err)
                                   : cap_fail(err, STATUS_MEMORY, "%s: no memory", path);
        free(table);
        return status;
    }
    if (looks_like_merl(path))
        return rec_merl_read(&brdf->table, path, err);
    if (looks_like_text(path))
        return read_best_fit(brdf, path, err);
    return cap_fail(err, STATUS_FORMAT, "%s: neither a MERL table nor a fits.yaml", path);
}

void rec_brdf_free(struct brdf *brdf)
{
    rec_merl_free(&brdf->table);
    *brdf = (struct brdf){0};
}

void rec_brdf_eval(const struct brdf *brdf, vec3 wi, vec3 wo, double f[3])
{
    f[0] = f[1] = f[2] = 0;
    if (wi.z <= 0 || wo.z <= 0)
        return;
    if (brdf->model) {
        brdf->model->eval(brdf->value, wi, wo, f);
        return;
    }
    int bin = rec_merl_index(rec_half_diff(wi, wo));
    for (int c = 0; c < 3; c++)
        f[c] = fmax(0, brdf->table.value[(size_t)c * MERL_BINS + (size_t)bin]);
}

// What a table is sampled by until something fits it better.
static const struct model *sampled_model(const struct brdf *brdf, const double **value)
{
    static const double white[3] = {1, 1, 1};
    *value = brdf->model ? brdf->value : white;
    return brdf->model ? brdf->model : rec_model_find("lambert");
}

double rec_brdf_sample(const struct brdf *brdf, vec3 wi, const double u[3], vec3 *wo)
{
    const double *value;
    const struct model *model = sampled_model(brdf, &value);
    return rec_lobes_sample(model, value, wi, u, wo);
}

double rec_brdf_pdf(const struct brdf *brdf, vec3 wi, vec3 wo)
{
    const double *value;
    const struct model *model = sampled_model(brdf, &value);
    return wi.z > 0 && wo.z > 0 ? rec_lobes_pdf(model, value, wi, wo) : 0;
}
