/* solid_place.c -- a cylinder or a mesh placed by its outline in all photographs.
 *
 * Edges are looked for around the outline that the present place predicts, coarse ones at first;
 * the sample is moved to them (solid_fit.c), and so on until it stays. Where it stands then, its
 * shape is checked.
 */
#include "solid_place.h"

#include "dusk.h"
#include "limb.h"
#include "shape_check.h"
#include "view_map.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

static const double FINE_ENOUGH = 0.02;  // px: a step that moves the sample less is the last
static const double SUSPECT_PX = 0.2;    // an outline that strays more may have another size
static const double SIZE_UNKNOWN = 0.2;  // of a mesh, relative
static const double SIZE_SIGMAS = 5, SIZE_MATTERS = 0.005;  // a size that is off by more is told
static const double TRUSTED = 0.01;  // a radius known to this, relative, needs no fit at first

/** The edges of one view. */
struct view_edges {
    struct contour_edge *edge;
    int count;
};

static enum status look(struct view_edges *to, const struct calibration *c, int v, const char *out,
                        double search, bool fine, struct error *err)
{
    struct radiance map = {0};
    const struct view *view = &c->view[v];
    enum status status = cal_view_map(&map, out, view, err);
    if (!status)
        status = cal_contour_edges(&to->edge, &to->count, &map, &c->sample,
                                   &c->camera[view->camera], view, v, search, fine, err);
    cap_radiance_free(&map);
    return status;
}

/** Copy the edges that are the sample's, not where light ends. -> how many. */
static int leave_dusk(struct contour_edge *kept, const struct contour_edge *edge, int count,
                      const struct calibration *c)
{
    int n = 0;
    for (int i = 0; i < count; i++) {
        const struct contour_point *at = &edge[i].at;
        if (!cal_dusk_at_limb(c, edge[i].view, at->point, at->across,
                              c->sample.radius * at->px_per_mm))
            kept[n++] = edge[i];
    }
    return n;
}

/** All edges of all views, in the order of views. The caller owns *edge. */
static enum status find_edges(struct contour_edge **edge, int *count, const struct calibration *c,
                              const char *out, double search, bool fine, struct run *run,
                              struct error *err)
{
    struct view_edges *of_view = calloc((size_t)c->views, sizeof *of_view);
    enum status status = of_view ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%d views", c->views);
    int views = of_view ? c->views : 0;
#pragma omp parallel for schedule(dynamic) num_threads(run->threads)
    for (int v = 0; v < views; v++) {
        struct error own = {0};
        if (look(&of_view[v], c, v, out, search, fine, &own)) {
#pragma omp critical(solid_error)
            status = cap_fail(err, own.status, "%s", own.text);
        }
    }
    int total = 0;
    for (int v = 0; v < views; v++)
        total += of_view[v].count;
    *count = 0;
    *edge = calloc((size_t)total + 1, sizeof **edge);
    if (!*edge && !status)
        status = cap_fail(err, STATUS_MEMORY, "%d edges", total);
    for (int v = 0; v < views; v++) {
        for (int i = 0; *edge && i < of_view[v].count; i++)
            (*edge)[(*count)++] = of_view[v].edge[i];
        free(of_view[v].edge);
    }
    free(of_view);
    return status;
}

/** Pixels a millimetre at the sample, the mean of all views. */
static double pixels_per_mm(const struct calibration *c)
{
    double sum = 0;
    for (int v = 0; v < c->views; v++) {
        vec3 eye = cal_eye(c->view[v].view_from_world);
        sum += c->camera[c->view[v].camera].focal[0] / vec3_length(vec3_sub(c->sample.center, eye));
    }
    return sum / c->views;
}

enum status cal_solid_check(const struct calibration *c, const struct contour_edge *edge, int count,
                            struct run *run, struct error *err)
{
    struct contour_edge *kept = calloc((size_t)count + 1, sizeof *kept);
    struct touch *touch = calloc((size_t)count + 1, sizeof *touch);
    enum status status =
        kept && touch ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%d edges", count);
    int left = status ? 0 : leave_dusk(kept, edge, count, c);
    for (int i = 0; i < left; i++) {
        const struct contour_point *at = &kept[i].at;
        touch[i] = (struct touch){.arm = vec3_sub(at->point, c->sample.center),
                                  .normal = at->across,
                                  .off = kept[i].off / at->px_per_mm,
                                  .sigma = hypot(kept[i].sigma_px, 0.01) / at->px_per_mm,
                                  .px_per_mm = at->px_per_mm,
                                  .view = kept[i].view};
    }
    if (!status)
        status = cal_shape_warn(&c->sample, touch, left, c->views, run, err);
    free(kept);
    free(touch);
    return status;
}

/** The mesh of *s, `times` as large about its middle. The caller frees it by free_mesh(). */
static enum status resized(struct sample *to, const struct sample *s, double times,
                           struct error *err)
{
    vec3 arm = vec3_sub(s->world_from_file.translation, s->center);
    struct sample made = {.shape = SHAPE_MESH,
                          .file = strdup(s->file),
                          .scale = s->scale * times,
                          .world_from_file = {s->world_from_file.rotation,
                                              vec3_add(s->center, vec3_scale(arm, times))}};
    enum status status =
        made.file ? cal_sample_load(&made, err) : cap_fail(err, STATUS_MEMORY, "%s", s->file);
    if (status)
        free(made.file);
    else
        *to = made;
    return status;
}

static void free_mesh(struct sample *s)
{
    cal_mesh_free(s->mesh);
    free(s->file);
}

/** Let the size of the mesh c->sample follow edges within `search` pixels. */
static enum status fit_size(struct calibration *c, const char *out, double search, bool fine,
                            struct run *run, struct error *err)
{
    struct sample *s = &c->sample, next;
    const double radius = s->radius;
    struct solid_prior prior = {
        .radius = radius, .radius_sigma = SIZE_UNKNOWN * radius, .free_size = true};
    struct contour_edge *edge = NULL;
    int count = 0;
    enum status status = find_edges(&edge, &count, c, out, search, fine, run, err);
    if (!status && fine)
        count = leave_dusk(edge, edge, count, c);
    if (!status)
        status = cal_solid_fit(s, &prior, edge, count, c->views, 1 / pixels_per_mm(c), err);
    const double times = s->radius / radius, sigma = s->sigma_radius, rms = s->outline_rms_px;
    if (!status)
        status = resized(&next, s, times, err);
    if (!status) {
        free_mesh(s);
        *s = next;
        s->sigma_radius = sigma;
        s->outline_rms_px = rms;
    }
    free(edge);
    return status;
}

enum status cal_mesh_size_check(const struct calibration *c, const char *out, struct run *run,
                                struct error *err)
{
    const struct sample *is = &c->sample;
    struct calibration other = *c;
    if (is->shape != SHAPE_MESH || is->outline_rms_px < SUSPECT_PX)
        return STATUS_OK;
    enum status status = resized(&other.sample, is, 1, err);
    const double size = pixels_per_mm(c) * cal_solid_reach(is);
    const double search[] = {fmax(SIZE_UNKNOWN * size, 8), fmax(0.1 * size, 6), 5, 5, 2.5, 2.5};
    if (status)
        return status;
    for (int k = 0; k < 6 && !status; k++)
        status = fit_size(&other, out, search[k], k > 3, run, err);
    const double times = other.sample.scale / is->scale;
    const double sigma = other.sample.sigma_radius / other.sample.radius;
    if (!status && other.sample.outline_rms_px < is->outline_rms_px
        && fabs(times - 1) > fmax(SIZE_SIGMAS * sigma, SIZE_MATTERS))
        cap_warn(run,
                 "the mesh is not of the sample's size: its outline fits %.2f %% %s (+- %.2g %%): "
                 "`scale: %.4g` in capture.yaml's `sample` would make it that",
                 100 * fabs(times - 1), times > 1 ? "larger" : "smaller", 100 * sigma,
                 other.sample.scale);
    free_mesh(&other.sample);
    return status == STATUS_DATA ? STATUS_OK : status;
}

/** Edges within `search` pixels, and a step to fit them. *moved: by how many pixels. The caller
 * owns *edge. */
static enum status pass(double *moved, struct contour_edge **edge, int *count,
                        struct solid_prior *prior, struct calibration *c, const char *out,
                        double search, bool fine, struct run *run, struct error *err)
{
    struct sample *s = &c->sample;
    const double radius = s->radius;
    const double px = pixels_per_mm(c);
    vec3 center = s->center, turned = prior->turned;
    *edge = NULL;
    prior->free_radius = fine || prior->radius_sigma > TRUSTED * prior->radius;
    enum status status = find_edges(edge, count, c, out, search, fine, run, err);
    struct contour_edge *kept = calloc((size_t)*count + 1, sizeof *kept);
    if (!status && !kept)
        status = cap_fail(err, STATUS_MEMORY, "%d edges", *count);
    int left = status ? 0 : fine ? leave_dusk(kept, *edge, *count, c) : *count;
    if (!status)
        status = cal_solid_fit(s, prior, fine ? kept : *edge, left, c->views, 1 / px, err);
    free(kept);
    *moved = px
             * (vec3_length(vec3_sub(s->center, center)) + fabs(s->radius - radius)
                + cal_solid_reach(s) * vec3_length(vec3_sub(prior->turned, turned)));
    return status ? cap_fail_within(err, "the sample's outline") : STATUS_OK;
}

enum status cal_solid_start(bool *sure, struct solid_prior *prior, struct calibration *c,
                            const char *out, struct run *run, struct error *err)
{
    const double size = pixels_per_mm(c) * cal_solid_reach(&c->sample);
    // How far the nominal place may be wrong: a tenth of the sample, then closer.
    const double loose = 2.5 * prior->radius_sigma * pixels_per_mm(c);
    const double search[] = {fmax(fmax(0.1 * size, loose), 8), fmax(0.05 * size, 6), 5};
    enum status status = STATUS_OK;
    double moved = DBL_MAX;
    *sure = false;
    for (int k = 0; k < 3 && moved >= 1.5 && !status; k++) {
        struct contour_edge *edge;
        int count = 0;
        status = pass(&moved, &edge, &count, prior, c, out, search[k], false, run, err);
        *sure = !status && c->sample.outline_rms_px < STRAYING * search[k];
        free(edge);
    }
    return status;
}

enum status cal_solid_place(struct contour_edge **edge, int *count, struct solid_prior *prior,
                            struct calibration *c, const char *out, struct run *run,
                            struct error *err)
{
    enum status status = STATUS_OK;
    double moved = DBL_MAX;
    *edge = NULL;
    *count = 0;
    for (int k = 0; k < 4 && moved >= FINE_ENOUGH && !status; k++) {
        free(*edge);
        status = pass(&moved, edge, count, prior, c, out, 2.5, true, run, err);
    }
    return status;
}
