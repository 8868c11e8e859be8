/* gather.c -- all shots of a calibrated capture become bins: one shot a thread at a time. */
#include "gather.h"

#include "bins.h"
#include "bounce_map.h"
#include "team.h"

#include <math.h>
#include <stdlib.h>

// What the threads share: they read it all, and write `status` and `err` one at a time.
struct gathering {
    const struct calibration *calibration;
    const struct lens_table *lens;  // [cameras]
    const struct board_extent *board;
    const struct consensus *consensus;
    struct samples_file *samples;
    const char *out;
    struct run *run;
    enum status status;
    struct error *err;
};

static enum status make_lenses(struct lens_table **lenses, const struct calibration *c,
                               struct error *err)
{
    struct lens_table *lens = calloc((size_t)c->cameras + 1, sizeof *lens);
    if (!lens)
        return cap_fail(err, STATUS_MEMORY, "no memory for cameras");
    *lenses = lens;
    for (int k = 0; k < c->cameras; k++) {
        enum status status = rec_lens_make(&lens[k], &c->camera[k], err);
        if (status)
            return status;
    }
    return STATUS_OK;
}

static void free_lenses(struct lens_table *lens, int cameras)
{
    for (int k = 0; lens && k < cameras; k++)
        rec_lens_free(&lens[k]);
    free(lens);
}

static enum status read_map(struct radiance *map, const struct gathering *g,
                            const struct viewing *v, struct error *err)
{
    char name[512];
    snprintf(name, sizeof name, "radiance/%s.exr", v->view->name);
    char *path = cap_path(g->out, name);
    if (!path)
        return cap_fail(err, STATUS_MEMORY, "no memory for a path");
    enum status status = cap_radiance_read(map, path, err);
    if (!status && (map->width != v->camera->width || map->height != v->camera->height)) {
        status =
            cap_fail(err, STATUS_FORMAT, "%s: %d x %d pixels, but camera %s has %d x %d", path,
                     map->width, map->height, v->camera->name, v->camera->width, v->camera->height);
        cap_radiance_free(map);
    }
    free(path);
    return status;
}

static enum status add_shot(struct tally *tally, struct census *census, const struct gathering *g,
                            int view, struct error *err)
{
    const struct calibration *c = g->calibration;
    struct viewing v = rec_viewing(c, view, &g->lens[c->view[view].camera], g->board);
    struct radiance map = {0};
    enum status status = read_map(&map, g, &v, err);
    if (status)
        return status;
    pixel_box box = rec_sample_box(&v);
    struct bounce_map bounce = {0};
    struct shot_residuals residuals = {0};
    struct sample_block block = {0};
    status = rec_bounce_make(&bounce, c, view, &v, box, err);
    v.bounce = &bounce;
    v.consensus = g->consensus;
    v.bounce_scatter = g->consensus ? g->consensus->bounce_scatter : 0;
    int64_t used = census->photosites[FATE_USED];
    for (int y = box.y0; y < box.y1 && !status; y++)
        for (int x = box.x0; x < box.x1 && !status; x++) {
            reflectance_sample sample;
            bool hit;
            enum fate fate = rec_sample_at(&sample, &v, &map, x, y, &hit);
            census->photosites[fate] += hit;
            if (fate != FATE_USED)
                continue;
            double b = rec_mean_bounced(&sample);
            census->bounced_ppm += llround(1e6 * b / (1 + b));
            rec_residual_add(&residuals, &sample, &c->sample);
            status = rec_tally_add(tally, &sample, err);
            if (!status && g->samples)
                status = rec_samples_put(g->samples, &block, v.view->name, &sample, x, y, err);
        }
    if (!status && g->samples)
        status = rec_samples_flush(g->samples, &block, v.view->name, err);
    free(block.row);
    if (census->photosites[FATE_USED] == used)
        cap_warn(g->run, "shot %s: no photosite shows lit sample", v.view->name);
    census->shots++;
    rec_residuals_end_shot(&census->residuals, &residuals);
    rec_bounce_free(&bounce);
    cap_radiance_free(&map);
    return status;
}

static void note_failure(struct gathering *g, enum status status, const struct error *err)
{
    if (!status)
        return;
#pragma omp critical(gathering)
    if (!g->status) {
        g->status = status;
        cap_fail(g->err, status, "%s", err->text);
    }
}

void rec_census_add(struct census *to, const struct census *from)
{
    for (int k = 0; k < FATES; k++)
        to->photosites[k] += from->photosites[k];
    to->bounced_ppm += from->bounced_ppm;
    to->shots += from->shots;
    rec_residuals_merge(&to->residuals, &from->residuals);
}

// Each thread fills a tally of its own; the first to finish hands it over, the others add theirs.
static void gather_shots(struct tally *total, struct census *census, struct gathering *g)
{
#pragma omp parallel num_threads(g->run->threads)
    {
        struct tally mine = {0};
        struct census seen = {0};
        struct error err = {0};
        enum status status = rec_tally_begin(&mine, &err);
#pragma omp for schedule(dynamic)
        for (int k = 0; k < g->calibration->views; k++) {
            if (!status && cap_ours(g->run, k)) {
                status = add_shot(&mine, &seen, g, k, &err);
                cap_step(g->run);
            }
        }
#pragma omp critical(tally)
        {
            rec_census_add(census, &seen);
            if (!status && !total->slot) {
                *total = mine;
                mine = (struct tally){0};
            } else if (!status) {
                status = rec_tally_merge(total, &mine, &err);
            }
        }
        note_failure(g, status, &err);
        rec_tally_free(&mine);
    }
}

enum status rec_gather(struct bins *bins, struct census *census,
                       const struct calibration *calibration, const struct board_extent *board,
                       const struct consensus *consensus, struct samples_file *samples,
                       const char *out, struct run *run, struct error *err)
{
    struct lens_table *lens = NULL;
    struct tally total = {0};
    struct census seen = {0};
    enum status status = make_lenses(&lens, calibration, err);
    if (!status) {
        struct gathering g = {calibration, lens, board,     consensus, samples,
                              out,         run,  STATUS_OK, err};
        gather_shots(&total, &seen, &g);
        status = g.status;
    }
    status = rec_team_agree(status, err);
    if (!status)
        status = rec_team_sum(&total, &seen, err);
    if (!status && rec_leads() && total.count == 0)
        status = cap_fail(err, STATUS_DATA,
                          "no photosite shows the sample lit: are its place and the lamps right?");
    if (!status && rec_leads())
        status = rec_tally_finish(bins, &total, err);
    if (!status)
        *census = seen;
    rec_tally_free(&total);
    free_lenses(lens, calibration->cameras);
    return status;
}
