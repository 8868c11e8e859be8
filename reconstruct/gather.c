/* gather.c -- all shots of a calibrated capture become bins: one shot a thread at a time. */
#include "gather.h"

#include "bounce_map.h"
#include "raster.h"
#include "shot_bins.h"
#include "team.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// What the threads share: they read it all, and write the tallies, `status` and `err` one at a
// time.
struct gathering {
    const struct calibration *calibration;
    const struct lens_table *lens;  // [cameras]
    const struct board_extent *board;
    const struct blockers *blockers;
    const struct consensus *consensus;
    struct samples_file *samples;
    const char *out;
    struct run *run;
    struct tally tally, fine;  // fine: on the user's grid, if any
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

// The photosites of the box and those next to them.
static enum status read_map(struct radiance *map, const struct gathering *g,
                            const struct viewing *v, pixel_box box, struct error *err)
{
    char name[512];
    snprintf(name, sizeof name, "radiance/%s.exr", v->view->name);
    char *path = cap_path(g->out, name);
    if (!path)
        return cap_fail(err, STATUS_MEMORY, "no memory for a path");
    const int low[2] = {box.x0 - LANES, box.y0 - 2}, end[2] = {box.x1 + LANES, box.y1 + 2};
    enum status status = cap_radiance_open(map, path, err);
    if (!status
        && ((status = cap_glare_remove(map, v->view->glare, v->view->sigma_glare, err))
            || (status = cap_radiance_load(map, low, end, err))))
        cap_radiance_free(map);
    if (!status && (map->width != v->camera->width || map->height != v->camera->height)) {
        status =
            cap_fail(err, STATUS_FORMAT, "%s: %d x %d pixels, but camera %s has %d x %d", path,
                     map->width, map->height, v->camera->name, v->camera->width, v->camera->height);
        cap_radiance_free(map);
    }
    free(path);
    return status;
}

/** What a thread fills: sums of the shot under way, and what it says of all that it took. */
struct harvest {
    struct shot_bins shot, fine_shot;
    struct census census;
};

// The shot under way is over: its sums are added, exactly, in whatever order shots end.
static enum status end_shot(struct harvest *h, struct gathering *g, struct error *err)
{
    enum status status;
#pragma omp critical(tally)
    {
        status = rec_shot_end(&h->shot, &g->tally, err);
        if (!status && g->fine.slot)
            status = rec_shot_end(&h->fine_shot, &g->fine, err);
    }
    return status;
}

// The used photosites of a strip, one by one, where somebody wants to know them.
static enum status look_closer(const struct strip *s, struct shot_residuals *residuals,
                               struct shot_trend *trend, struct sample_block *block,
                               const struct gathering *g, const char *shot, struct error *err)
{
    enum status status = STATUS_OK;
    for (int i = 0; i < LANES && !status; i++) {
        if (s->fate[i] != FATE_USED)
            continue;
        reflectance_sample sample = rec_strip_sample(s, i);
        rec_residual_add(residuals, &sample, &g->calibration->sample);
        rec_trend_add(trend, &sample);
        if (g->samples)
            status = rec_samples_put(g->samples, block, shot, &sample, s->x0 + i, s->y, err);
    }
    return status;
}

static void count_fates(struct census *census, const struct strip *s)
{
    for (int i = 0; i < LANES; i++) {
        census->photosites[s->fate[i]] += s->hit[i] > 0;
        if (s->fate[i] != FATE_USED)
            continue;
        double sum = s->bounced[0][i] + s->bounced[1][i] + s->bounced[2][i];
        double b = s->channel[i] < 0 ? sum / 3 : sum;
        census->bounced_ppm += llround(1e6 * b / (1 + b));
    }
}

static enum status add_strips(struct harvest *h, const struct gathering *g, const struct viewing *v,
                              const struct radiance *map, pixel_box box, struct error *err)
{
    struct strip s;
    struct shot_residuals residuals = {0};
    struct shot_trend trend = {0};
    struct shot_night night = {0};
    struct sample_block block = {0};
    enum status status = STATUS_OK;
    for (s.y = box.y0; s.y < box.y1 && !status; s.y++)
        for (s.x0 = box.x0 / LANES * LANES; s.x0 < box.x1 && !status; s.x0 += LANES) {
            s.from = s.x0 < box.x0 ? box.x0 - s.x0 : 0;
            s.to = s.x0 + LANES > box.x1 ? box.x1 - s.x0 : LANES;
            rec_strip_make(&s, v, map);
            count_fates(&h->census, &s);
            status = rec_night_add(&night, &s, v, map, box, err);
            if (status || !rec_strip_narrow(&s))
                continue;
            status = rec_shot_add(&h->shot, &s, err);
            if (!status && g->fine.slot)
                status = rec_shot_add(&h->fine_shot, &s, err);
            if (!status && (g->samples || g->consensus))
                status = look_closer(&s, &residuals, &trend, &block, g, v->view->name, err);
        }
    if (!status && g->samples)
        status = rec_samples_flush(g->samples, &block, v->view->name, err);
    rec_residuals_end_shot(&h->census.residuals, &residuals);
    rec_trend_end_shot(&h->census.trend, &trend);
    rec_night_end_shot(&h->census.night, &night);
    free(block.row);
    return status;
}

static enum status add_shot(struct harvest *h, struct gathering *g, int view, struct error *err)
{
    const struct calibration *c = g->calibration;
    struct viewing v = rec_viewing(c, view, &g->lens[c->view[view].camera], g->board);
    struct radiance map = {0};
    struct bounce_map bounce = {0};
    struct raster raster = {0};
    v.consensus = g->consensus;
    v.table = g->consensus ? g->consensus->table : NULL;
    pixel_box box = rec_sample_box(&v);
    enum status status = read_map(&map, g, &v, box, err);
    if (status)
        return status;
    memcpy(v.chroma, map.chroma, sizeof v.chroma);
    status = rec_bounce_make(&bounce, c, view, &v, box, err);
    if (!status && c->sample.shape == SHAPE_MESH)
        status = rec_raster_make(&raster, &v, box, err);
    v.raster = c->sample.shape == SHAPE_MESH ? &raster : NULL;
    v.blockers = g->blockers;
    v.bounce = &bounce;
    v.bounce_scatter = g->consensus ? g->consensus->bounce_scatter : 0;
    v.bounce_caution = fmax(v.bounce_sigma, g->consensus ? g->consensus->bounce_caution : 0);
    int64_t used = h->census.photosites[FATE_USED];
    if (!status)
        status = add_strips(h, g, &v, &map, box, err);
    enum status ended = end_shot(h, g, err);
    if (h->census.photosites[FATE_USED] == used)
        cap_warn(g->run, "shot %s: no photosite shows lit sample", v.view->name);
    h->census.shots++;
    rec_raster_free(&raster);
    rec_bounce_free(&bounce);
    cap_radiance_free(&map);
    return status ? status : ended;
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
    rec_trend_merge(&to->trend, &from->trend);
    rec_night_merge(&to->night, &from->night);
}

// All shots; the threads' censuses are added up.
static void gather_shots(struct census *census, struct gathering *g)
{
#pragma omp parallel num_threads(g->run->threads)
    {
        struct harvest mine = {.shot.grid = g->tally.grid, .fine_shot.grid = g->fine.grid};
        struct error err = {0};
        enum status status = STATUS_OK;
#pragma omp for schedule(dynamic)
        for (int k = 0; k < g->calibration->views; k++) {
            if (!status && cap_ours(g->run, k)) {
                status = add_shot(&mine, g, k, &err);
                cap_step(g->run);
            }
        }
#pragma omp critical(tally)
        rec_census_add(census, &mine.census);
        note_failure(g, status, &err);
        rec_shot_free(&mine.shot);
        rec_shot_free(&mine.fine_shot);
    }
}

// The sums of all members become the leader's bins.
static enum status conclude(struct bins *bins, struct bins *fine, struct gathering *g,
                            struct census *census, struct error *err)
{
    struct census none = {0};
    enum status status = rec_team_sum(&g->tally, census, err);
    if (!status && fine)
        status = rec_team_sum(&g->fine, &none, err);
    if (status || !rec_leads())
        return status;
    if (g->tally.count == 0)
        return cap_fail(err, STATUS_DATA,
                        "no photosite shows the sample lit: are its place and the lamps right?");
    status = rec_tally_finish(bins, &g->tally, err);
    if (!status)
        bins->bounce_scatter = g->consensus ? g->consensus->bounce_scatter : 0;
    return !status && fine ? rec_tally_finish(fine, &g->fine, err) : status;
}

enum status rec_gather(struct bins *bins, struct bins *fine, struct census *census,
                       const struct calibration *calibration, const struct board_extent *board,
                       const struct blockers *blockers, const struct consensus *consensus,
                       struct samples_file *samples, const char *out, struct run *run,
                       struct error *err)
{
    struct lens_table *lens = NULL;
    struct census total = {0};
    struct gathering g = {.calibration = calibration,
                          .board = board,
                          .blockers = blockers,
                          .consensus = consensus,
                          .samples = samples,
                          .out = out,
                          .run = run,
                          .err = err};
    enum status status = make_lenses(&lens, calibration, err);
    if (!status)
        status = rec_tally_begin(&g.tally, rec_merl_grid, err);
    if (!status && fine)
        status = rec_tally_begin(&g.fine, fine->grid, err);
    if (!status) {
        g.lens = lens;
        gather_shots(&total, &g);
        status = g.status;
    }
    status = rec_team_agree(status, err);
    if (!status)
        status = conclude(bins, fine, &g, &total, err);
    if (!status)
        *census = total;
    rec_tally_free(&g.tally);
    rec_tally_free(&g.fine);
    free_lenses(lens, calibration->cameras);
    return status;
}
