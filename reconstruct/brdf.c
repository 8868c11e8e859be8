/* brdf.c -- a BRDF from whatever file held one: evaluated, sampled, tabulated. */
#include "lobes.h"
#include "lookup.h"
#include "reconstruct.h"
#include "sampler.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

static enum status prepare_table(struct brdf *brdf, const struct merl *table, struct error *err)
{
    struct lookup *lookup = NULL;
    struct sampler *sampler = NULL;
    enum status status = rec_lookup_make(&lookup, table, err);
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

enum status rec_brdf_prepare(struct brdf *brdf, struct error *err)
{
    struct merl table = {0};
    if (brdf->table.value)
        return prepare_table(brdf, &brdf->table, err);
    if (!brdf->kind)
        return STATUS_OK;
    enum status status = rec_brdf_table(&table, brdf, 1, err);
    if (!status)
        status = prepare_table(brdf, &table, err);
    rec_merl_free(&table);
    return status;
}

void rec_brdf_free(struct brdf *brdf)
{
    rec_merl_free(&brdf->table);
    rec_lookup_free(brdf->lookup);
    rec_sampler_free(brdf->sampler);
    if (brdf->kind)
        brdf->kind->free(brdf->data);
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
    if (brdf->kind) {
        brdf->kind->eval(brdf->data, wi, wo, f);
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
    if (brdf->lookup && !brdf->kind)
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

enum status rec_brdf_table(struct merl *table, const struct brdf *brdf, int threads,
                           struct error *err)
{
    const size_t count = 3 * (size_t)MERL_BINS;
    double *value = malloc(count * sizeof *value);
    if (!value)
        return cap_fail(err, STATUS_MEMORY, "no memory for a table");
    if (brdf->table.value)
        memcpy(value, brdf->table.value, count * sizeof *value);
#pragma omp parallel for schedule(dynamic, 4096) num_threads(threads)
    for (int bin = 0; bin < (brdf->table.value ? 0 : MERL_BINS); bin++) {
        vec3 wi, wo;
        double f[3] = {-1, -1, -1};
        rec_directions(rec_merl_center(bin), &wi, &wo);
        if (wi.z > 0 && wo.z > 0)
            rec_brdf_eval(brdf, wi, wo, f);
        for (size_t c = 0; c < 3; c++)
            value[c * MERL_BINS + (size_t)bin] = f[c];
    }
    table->value = value;
    return STATUS_OK;
}
