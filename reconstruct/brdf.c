/* brdf.c -- a BRDF from whatever file holds one. */
#include "lobes.h"
#include "lookup.h"
#include "reconstruct.h"
#include "sampler.h"

#include <assert.h>
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

enum status rec_brdf_prepare(struct brdf *brdf, struct error *err)
{
    if (!brdf->table.value)
        return STATUS_OK;
    struct lookup *lookup = NULL;
    struct sampler *sampler = NULL;
    enum status status = rec_lookup_make(&lookup, &brdf->table, err);
    if (!status)
        status = rec_sampler_make(&sampler, lookup, err);
    if (status) {
        rec_lookup_free(lookup);
        return status;
    }
    brdf->lookup = lookup;
    brdf->sampler = sampler;
    return STATUS_OK;
}

static enum status read_table(struct brdf *brdf, const char *path, struct error *err)
{
    struct brdf read = {0};
    enum status status = rec_merl_read(&read.table, path, err);
    if (!status)
        status = rec_brdf_prepare(&read, err);
    if (status)
        rec_brdf_free(&read);
    else
        *brdf = read;
    return status;
}

enum status rec_brdf_read(struct brdf *brdf, const char *path, struct error *err)
{
    struct stat info;
    if (stat(path, &info) != 0)
        return cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
    if (S_ISDIR(info.st_mode)) {
        char *table = cap_path(path, "brdf.binary");
        enum status status = table ? read_table(brdf, table, err)
                                   : cap_fail(err, STATUS_MEMORY, "%s: no memory", path);
        free(table);
        return status;
    }
    if (looks_like_merl(path))
        return read_table(brdf, path, err);
    if (looks_like_text(path))
        return read_best_fit(brdf, path, err);
    return cap_fail(err, STATUS_FORMAT, "%s: neither a MERL table nor a fits.yaml", path);
}

void rec_brdf_free(struct brdf *brdf)
{
    rec_merl_free(&brdf->table);
    rec_lookup_free(brdf->lookup);
    rec_sampler_free(brdf->sampler);
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
    if (brdf->lookup) {
        double one[1][3];
        rec_lookup_eval(brdf->lookup, &wi, &wo, one, 1);
        memcpy(f, one[0], sizeof one[0]);
        return;
    }
    int bin = rec_merl_index(rec_half_diff(wi, wo));
    for (int c = 0; c < 3; c++)
        f[c] = fmax(0, brdf->table.value[(size_t)c * MERL_BINS + (size_t)bin]);
}

void rec_brdf_eval_many(const struct brdf *brdf, const vec3 *wi, const vec3 *wo, double (*f)[3],
                        size_t count)
{
    if (brdf->lookup)
        rec_lookup_eval(brdf->lookup, wi, wo, f, count);
    else
        for (size_t i = 0; i < count; i++)
            rec_brdf_eval(brdf, wi[i], wo[i], f[i]);
}

double rec_brdf_sample(const struct brdf *brdf, vec3 wi, const double u[3], vec3 *wo)
{
    assert(wi.z > 0 && (brdf->model || brdf->sampler));
    return brdf->model ? rec_lobes_sample(brdf->model, brdf->value, wi, u, wo)
                       : rec_sampler_draw(brdf->sampler, wi, u, wo);
}

double rec_brdf_pdf(const struct brdf *brdf, vec3 wi, vec3 wo)
{
    assert(brdf->model || brdf->sampler);
    if (wi.z <= 0 || wo.z <= 0)
        return 0;
    return brdf->model ? rec_lobes_pdf(brdf->model, brdf->value, wi, wo)
                       : rec_sampler_density(brdf->sampler, wi, wo);
}
