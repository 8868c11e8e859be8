/* coverage.c -- which bins photographs measure, or would measure if they were made.
 *
 * Method.   A planned view goes the way of a real one (footprint.c, strip_angles.c) up to the point
 *           where a photograph would be read: the same photosites are left out at the outline and
 *           at the terminator. What a photograph alone tells (saturation, strays) is not foreseen.
 */
#include "coverage.h"

#include "bins_hdf5.h"
#include "plot.h"
#include "raster.h"

#include <stdlib.h>

void rec_seen_free(struct seen_bins *seen)
{
    free(seen->bin);
    *seen = (struct seen_bins){0};
}

// Mark the bins of the used photosites of a strip.
static void mark_strip(uint8_t *mark, struct strip *s, const struct viewing *v)
{
    rec_strip_footprints(s, v);
    rec_strip_block(s, v);
    if (!rec_strip_narrow(s))
        return;
    rec_strip_angles(s);
    for (int i = 0; i < LANES; i++)
        if (s->fate[i] == FATE_USED)
            mark[s->bin[i]] = 1;
}

static enum status mark_view(uint8_t *mark, const struct calibration *c, int view,
                             const struct lens_table *lens, int step, struct error *err)
{
    struct viewing v = rec_viewing(c, view, lens, NULL);
    pixel_box box = rec_sample_box(&v);
    struct raster raster = {0};
    enum status status = STATUS_OK;
    if (c->sample.shape == SHAPE_MESH)
        status = rec_raster_make(&raster, &v, box, err);
    v.raster = c->sample.shape == SHAPE_MESH ? &raster : NULL;
    struct strip s;
    for (s.y = box.y0; s.y < box.y1 && !status; s.y += step)
        for (s.x0 = box.x0 / LANES * LANES; s.x0 < box.x1; s.x0 += LANES) {
            s.from = s.x0 < box.x0 ? box.x0 - s.x0 : 0;
            s.to = s.x0 + LANES > box.x1 ? box.x1 - s.x0 : LANES;
            mark_strip(mark, &s, &v);
        }
    rec_raster_free(&raster);
    return status;
}

// The marked bins as a list; the marks are wiped.
static enum status list_marks(struct seen_bins *seen, uint8_t *mark, struct error *err)
{
    int count = 0;
    for (int b = 0; b < MERL_BINS; b++)
        count += mark[b];
    struct seen_bins list = {malloc(((size_t)count + 1) * sizeof *list.bin), 0};
    if (!list.bin)
        return cap_fail(err, STATUS_MEMORY, "no memory for the bins of a view");
    for (int b = 0; b < MERL_BINS; b++) {
        if (mark[b])
            list.bin[list.count++] = b;
        mark[b] = 0;
    }
    *seen = list;
    return STATUS_OK;
}

static enum status make_lenses(struct lens_table *lens, const struct calibration *c,
                               struct error *err)
{
    enum status status = lens ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "no memory for cameras");
    for (int k = 0; k < c->cameras && !status; k++)
        status = rec_lens_make(&lens[k], &c->camera[k], err);
    return status;
}

static enum status look(struct seen_bins *seen, const struct calibration *c,
                        const struct lens_table *lens, int step, struct run *run, struct error *err)
{
    enum status result = STATUS_OK;
#pragma omp parallel num_threads(run->threads)
    {
        struct error mine = {0};
        uint8_t *mark = calloc(MERL_BINS, 1);
        enum status status =
            mark ? STATUS_OK : cap_fail(&mine, STATUS_MEMORY, "no memory to mark bins");
#pragma omp for schedule(dynamic)
        for (int k = 0; k < c->views; k++) {
            if (!status)
                status = mark_view(mark, c, k, &lens[c->view[k].camera], step, &mine);
            if (!status)
                status = list_marks(&seen[k], mark, &mine);
            cap_step(run);
        }
#pragma omp critical(coverage)
        if (status && !result)
            result = cap_fail(err, status, "%s", mine.text);
        free(mark);
    }
    return result;
}

enum status rec_coverage(struct seen_bins *seen, const struct calibration *c, int step,
                         struct run *run, struct error *err)
{
    for (int k = 0; k < c->views; k++)
        seen[k] = (struct seen_bins){0};
    struct lens_table *lens = calloc((size_t)c->cameras + 1, sizeof *lens);
    enum status status = make_lenses(lens, c, err);
    if (!status)
        status = look(seen, c, lens, step, run, err);
    for (int k = 0; k < c->views && status; k++)
        rec_seen_free(&seen[k]);
    for (int k = 0; lens && k < c->cameras; k++)
        rec_lens_free(&lens[k]);
    free(lens);
    return status;
}

enum status rec_coverage_measured(uint8_t *seen, const char *out, struct error *err)
{
    struct bins bins = {0};
    char *path = cap_path(out, "bins.h5");
    enum status status = path ? rec_bins_read(&bins, path, err)
                              : cap_fail(err, STATUS_MEMORY, "no memory for a path");
    if (!status) {
        for (int b = 0; b < MERL_BINS; b++)
            seen[b] = 0;
        for (int k = 0; k < bins.count; k++)
            seen[bins.bin[k].index] = 1;
    }
    rec_bins_free(&bins);
    free(path);
    return status;
}

struct coverage rec_coverage_of(const uint8_t *seen)
{
    const double limit[3] = {60 * CAP_PI / 180, 75 * CAP_PI / 180, CAP_PI / 2};
    double all[3] = {0}, got[3] = {0};
    for (int b = 0; b < MERL_BINS; b++) {
        vec3 wi, wo;
        if (!rec_merl_above(b))
            continue;
        rec_directions(rec_merl_center(b), &wi, &wo);
        double steepest = acos(fmax(-1, fmin(1, fmin(wi.z, wo.z))));
        for (int k = 0; k < 3; k++)
            if (steepest <= limit[k]) {
                all[k]++;
                got[k] += seen[b];
            }
    }
    return (struct coverage){got[0] / all[0], got[1] / all[1], got[2] / all[2]};
}

// What is not seen is left to the fit.
static void status_of(uint8_t *status, const uint8_t *seen)
{
    for (int b = 0; b < MERL_BINS; b++)
        status[b] = seen[b] ? BIN_MEASURED : rec_merl_above(b) ? BIN_EXTRAPOLATED : BIN_IMPOSSIBLE;
}

enum status rec_coverage_draw(const uint8_t *before, const uint8_t *after, const char *path,
                              struct error *err)
{
    uint8_t *status = malloc(2 * (size_t)MERL_BINS);
    if (!status)
        return cap_fail(err, STATUS_MEMORY, "no memory to draw %s", path);
    status_of(status, before);
    status_of(status + MERL_BINS, after);
    char as_it_is[] = "as it is", then[] = "with the proposed shots";
    const struct plot_source source[2] = {{.name = as_it_is, .status = status},
                                          {.name = then, .status = status + MERL_BINS}};
    const struct plot_options options = {.threads = 1};
    enum status result = rec_plot(PLOT_COVERAGE, source, 2, &options, path, err);
    free(status);
    return result;
}
