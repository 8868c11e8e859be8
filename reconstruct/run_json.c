/* run_json.c -- run.json: version, options, timings, warnings, exclusions, physical checks. */
#include "run_json.h"

#include "quantile.h"

#include <errno.h>
#include <jansson.h>
#include <stdlib.h>
#include <string.h>

static json_t *options(const struct run_story *s)
{
    return json_pack("{s:s, s:s, s:s?, s:i}", "capture", s->capture, "out", s->out, "calibration",
                     s->calibration_file, "threads", s->run->threads);
}

static json_t *stages(const struct run *run)
{
    json_t *list = json_array();
    for (int i = 0; i < run->stages; i++)
        json_array_append_new(list, json_pack("{s:s, s:f}", "name", run->stage[i].name, "seconds",
                                              run->stage[i].seconds));
    return list;
}

static json_t *warnings(const struct run *run)
{
    json_t *list = json_array();
    for (int i = 0; i < run->warnings; i++)
        json_array_append_new(list, json_string(run->warning[i]));
    return list;
}

static json_t *photosites(const struct census *census)
{
    json_t *counts = json_object();
    for (int k = 0; k < FATES; k++)
        json_object_set_new(counts, rec_fate_name[k], json_integer(census->photosites[k]));
    return counts;
}

// f(wi, wo) against f(wo, wi): median |difference| / mean over bins that hold both kinds.
static json_t *reciprocity(const struct bins *bins)
{
    double *residual = malloc(3 * (size_t)bins->count * sizeof *residual + sizeof *residual);
    int n = 0;
    for (int i = 0; residual && i < bins->count; i++)
        for (int c = 0; c < 3; c++) {
            const struct bin *b = &bins->bin[i];
            if (!isnan(b->swapped[c]) && b->mean[c] > 0)
                residual[n++] = fabs(b->swapped[c]) / b->mean[c];
        }
    json_t *found = json_pack("{s:i, s:o}", "bins", n / 3, "median_relative",
                              n ? json_real(rec_quantile(residual, n, 0.5)) : json_null());
    free(residual);
    return found;
}

static json_t *albedo(const struct merl *table)
{
    static const double theta_deg[] = {0, 15, 30, 45, 60, 75, 85};
    json_t *list = json_array();
    for (size_t i = 0; i < sizeof theta_deg / sizeof *theta_deg; i++) {
        double a[3];
        rec_table_albedo(a, table, theta_deg[i] * CAP_PI / 180);
        json_array_append_new(
            list, json_pack("{s:f, s:[f, f, f], s:b}", "theta_i_deg", theta_deg[i], "albedo", a[0],
                            a[1], a[2], "conserves_energy", a[0] <= 1 && a[1] <= 1 && a[2] <= 1));
    }
    return list;
}

// How much of the light came by way of the board, and was taken out.
static json_t *interreflection(const struct run_story *s)
{
    int64_t used = s->census->photosites[FATE_USED];
    double mean = used ? 1e-6 * (double)s->census->bounced_ppm / (double)used : 0;
    return json_pack("{s:f, s:f, s:f}", "strength", s->surroundings->strength, "sigma_strength",
                     s->surroundings->sigma_strength, "mean_part_of_radiance", mean);
}

static json_t *story_json(const struct run_story *s)
{
    return json_pack("{s:s, s:o, s:s, s:o, s:o, s:i, s:o, s:o, s:i, s:f, s:s, s:{s:o, s:o}}",
                     "version", GONIOCAM_VERSION, "options", options(s), "input_xxh3",
                     s->input_hash, "stages", stages(s->run), "warnings", warnings(s->run), "shots",
                     s->census->shots, "photosites", photosites(s->census), "interreflection",
                     interreflection(s), "measured_bins", s->bins->count, "median_relative_sigma",
                     s->median_sigma, "best_fit", s->fits->fit[0].model->name, "checks",
                     "reciprocity", reciprocity(s->bins), "directional_albedo", albedo(s->table));
}

enum status rec_run_json(const struct run_story *story, const char *path, struct error *err)
{
    json_t *json = story_json(story);
    if (!json)
        return cap_fail(err, STATUS_MEMORY, "%s: no memory to write it", path);
    struct atomic_file file;
    enum status status = cap_file_begin(&file, path, true, err);
    if (!status
        && (json_dumpf(json, file.stream, JSON_INDENT(2)) != 0
            || fputc('\n', file.stream) == EOF)) {
        status = cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
        cap_file_abandon(&file);
    } else if (!status) {
        status = cap_file_commit(&file, err);
    }
    json_decref(json);
    return status;
}
