/* run_json.c -- run.json: version, options, timings, warnings, exclusions, physical checks. */
#include "run_json.h"

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
        json_array_append_new(list, json_pack("{s:s, s:f, s:f}", "name", run->stage[i].name,
                                              "seconds", run->stage[i].seconds, "processor_seconds",
                                              run->stage[i].processor_seconds));
    return list;
}

static json_t *warnings(const struct run *run)
{
    json_t *list = json_array();
    for (int i = 0; i < run->warnings; i++)
        json_array_append_new(list, json_string(run->warning[i]));
    return list;
}

// A list of points.
static json_t *points(const vec3 *p, int count)
{
    json_t *list = json_array();
    for (int k = 0; k < count; k++)
        json_array_append_new(list, json_pack("[f, f, f]", p[k].x, p[k].y, p[k].z));
    return list;
}

// Corners of the white patches: bottom left, bottom right, top right, top left.
static json_t *patches(const struct capture *capture)
{
    json_t *list = json_array();
    for (int i = 0; capture && i < capture->patches; i++)
        json_array_append_new(list, points(capture->patch[i].corner, 4));
    return list;
}

static json_t *photosites(const struct census *census)
{
    json_t *counts = json_object();
    for (int k = 0; k < FATES; k++)
        json_object_set_new(counts, rec_fate_name[k], json_integer(census->photosites[k]));
    return counts;
}

static json_t *reciprocity(const struct checks *k)
{
    return json_pack("{s:i, s:f, s:f, s:f, s:f}", "bins", k->reciprocity.bins, "mean_relative",
                     k->reciprocity.mean, "sigma", k->reciprocity.sigma, "median_relative",
                     k->reciprocity.typical, "chi2", k->reciprocity.chi2);
}

static json_t *evenness(const unevenness *u)
{
    return json_pack("{s:i, s:f, s:f, s:f}", "cells", u->cells, "rms_relative", u->rms, "sigma",
                     u->sigma, "chi2", u->chi2);
}

static json_t *albedo(const struct checks *k)
{
    json_t *list = json_array();
    for (int i = 0; i < ALBEDO_ANGLES; i++) {
        const struct albedo *a = &k->albedo[i];
        const double *v = a->value, *s = a->sigma, *f = a->filled;
        json_array_append_new(list,
                              json_pack("{s:f, s:[f, f, f], s:[f, f, f], s:[f, f, f], s:b}",
                                        "theta_i_deg", a->theta_i_deg, "albedo", v[0], v[1], v[2],
                                        "sigma", s[0], s[1], s[2], "not_measured", f[0], f[1], f[2],
                                        "conserves_energy", v[0] <= 1 && v[1] <= 1 && v[2] <= 1));
    }
    return list;
}

static json_t *coverage(const struct checks *k)
{
    json_t *list = json_array();
    for (int i = 0; i < COVERAGE_BANDS; i++)
        json_array_append_new(list,
                              json_pack("{s:i, s:i, s:i}", "to_deg", 10 * (i + 1), "bins",
                                        k->coverage[i].bins, "measured", k->coverage[i].measured));
    return list;
}

static json_t *darkness_json(const darkness *d)
{
    return isnan(d->sigma) ? json_pack("{s:i}", "shots", d->shots)
                           : json_pack("{s:i, s:f, s:f}", "shots", d->shots, "part_of_lamp",
                                       d->mean, "sigma", d->sigma);
}

static json_t *checks(const struct checks *k)
{
    return json_pack("{s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:f}", "reciprocity", reciprocity(k),
                     "isotropy", evenness(&k->isotropy), "homogeneity", evenness(&k->homogeneity),
                     "directional_albedo", albedo(k), "coverage", coverage(k), "dusk",
                     darkness_json(&k->dark[ZONE_DUSK]), "night",
                     darkness_json(&k->dark[ZONE_NIGHT]), "stray_part", k->stray);
}

// How much of the light came by way of the board, and was taken out.
static json_t *interreflection(const struct run_story *s)
{
    int64_t used = s->census->photosites[FATE_USED];
    double mean = used ? 1e-6 * (double)s->census->bounced_ppm / (double)used : 0;
    const struct surroundings *around = &s->calibration->surroundings;
    return json_pack("{s:f, s:f, s:f}", "strength", around->strength, "sigma_strength",
                     around->sigma_strength, "mean_part_of_radiance", mean);
}

// What the photosite, the lens and the lamp's disc blunted, and was undone.
static json_t *resolution(const struct bins *bins)
{
    struct sharpening s = rec_bins_sharpening(bins);
    return json_pack("{s:i, s:i, s:f}", "bins_corrected", s.bins, "mostly_uncertain_by_it",
                     s.uncertain, "largest_relative", s.largest);
}

// What share of the light the lens spread, and was taken off: of the worst view.
static json_t *glare(const struct calibration *c)
{
    double share, sigma;
    cal_glare_of(c, &share, &sigma);
    return json_pack("{s:f, s:f}", "share", share, "sigma_share", sigma);
}

static json_t *story_json(const struct run_story *s)
{
    return json_pack(
        "{s:s, s:o, s:s, s:o, s:o, s:i, s:o, s:o, s:o, s:o, s:i, s:f, s:s, s:o, s:o, s:{s:i, s:i}}",
        "version", GONIOCAM_VERSION, "options", options(s), "input_xxh3", s->input_hash, "stages",
        stages(s->run), "warnings", warnings(s->run), "shots", s->census->shots, "photosites",
        photosites(s->census), "interreflection", interreflection(s), "resolution",
        resolution(s->bins), "glare", glare(s->calibration), "measured_bins", s->bins->count,
        "median_relative_sigma", s->median_sigma, "best_fit", s->fits->fit[0].model->name, "checks",
        checks(s->checks), "patches", patches(s->layout), "defective_photosites", "hot",
        s->run->hot, "dead", s->run->dead);
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
