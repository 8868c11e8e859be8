/* glare.c -- the veiling glare of the lenses of a capture: from maps to what each view is freed of.
 */
#include "glare_ink.h"
#include "view_map.h"

#include <stdlib.h>
#include <string.h>

/** What all views show. */
struct looks {
    struct inks *inks;          // [views]
    struct glare_field *field;  // [views]
};

static enum status look(const struct looks *to, const struct calibration *c, int v,
                        const struct capture *capture, const char *out, struct error *err)
{
    struct radiance map = {0};
    struct tag_family family = {0};
    enum status status = cal_view_map(&map, out, &c->view[v], err);
    if (!status)
        status = cap_glare_field(&to->field[v], &map, err);
    if (!status)
        status = pattern_open(&family, capture->family, err);
    if (!status)
        status = cal_glare_look(&to->inks[v], &map, c, v, &family, err);
    pattern_close(&family);
    cap_radiance_free(&map);
    return status;
}

static enum status look_at_all(const struct looks *to, const struct calibration *c,
                               const struct capture *capture, const char *out, struct run *run,
                               struct error *err)
{
    enum status status = STATUS_OK;
#pragma omp parallel for schedule(dynamic) num_threads(run->threads)
    for (int v = 0; v < c->views; v++) {
        struct error own = {0};
        enum status s = look(to, c, v, capture, out, &own);
        if (s) {
#pragma omp critical(glare_error)
            status = cap_fail(err, s, "%s", own.text);
        }
        cap_step(run);
    }
    return status;
}

/** The ink of one camera's views, in the order of the views. */
static enum status gather(struct inks *all, const struct looks *looks, const struct calibration *c,
                          int camera, struct error *err)
{
    for (int v = 0; v < c->views; v++)
        if (c->view[v].camera == camera)
            all->room += looks->inks[v].count;
    all->ink = calloc((size_t)all->room + 1, sizeof *all->ink);
    if (!all->ink)
        return cap_fail(err, STATUS_MEMORY, "the ink of %d tags", all->room);
    for (int v = 0; v < c->views; v++) {
        const struct inks *one = &looks->inks[v];
        if (c->view[v].camera != camera || one->count == 0)
            continue;
        memcpy(all->ink + all->count, one->ink, (size_t)one->count * sizeof *one->ink);
        all->count += one->count;
    }
    return STATUS_OK;
}

static enum status measure(struct calibration *c, const struct looks *looks, int camera,
                           struct error *err)
{
    struct inks all = {0};
    struct glare_estimate estimate;
    enum status status = gather(&all, looks, c, camera, err);
    if (!status)
        status = cal_glare_fit(&estimate, &all, looks->field, c->views, err);
    for (int v = 0; v < c->views && !status; v++) {
        if (c->view[v].camera != camera)
            continue;
        memcpy(c->view[v].glare, estimate.share, sizeof estimate.share);
        c->view[v].sigma_glare =
            estimate.share[0] + estimate.share[1] + estimate.share[2] > 0 ? estimate.sigma : 0;
    }
    free(all.ink);
    return status;
}

enum status cal_glare(struct calibration *c, const struct capture *capture, const char *out,
                      struct run *run, struct error *err)
{
    struct looks looks = {.inks = calloc((size_t)c->views + 1, sizeof *looks.inks),
                          .field = calloc((size_t)c->views + 1, sizeof *looks.field)};
    enum status status = looks.inks && looks.field
                             ? STATUS_OK
                             : cap_fail(err, STATUS_MEMORY, "the glare of %d views", c->views);
    cap_stage(run, "glare", c->views);
    if (!status)
        status = look_at_all(&looks, c, capture, out, run, err);
    for (int k = 0; k < c->cameras && !status; k++)
        status = measure(c, &looks, k, err);
    for (int v = 0; v < c->views; v++) {
        if (looks.inks)
            free(looks.inks[v].ink);
        if (looks.field)
            free(looks.field[v].value);
    }
    free(looks.inks);
    free(looks.field);
    return status;
}

void cal_glare_of(const struct calibration *c, double *share, double *sigma)
{
    *share = *sigma = 0;
    for (int v = 0; v < c->views; v++) {
        double sum = 0;
        for (int k = 0; k < GLARE_TERMS; k++)
            sum += c->view[v].glare[k];
        if (sum > *share) {
            *share = sum;
            *sigma = c->view[v].sigma_glare;
        }
    }
}
