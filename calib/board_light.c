/* board_light.c -- the lit board as a lamp, and the light that goes between it and the sample.
 *
 * Method.   The board's planes are cut into cells (board_survey.c). A photograph shows the
 *           radiance of each, lit by the lamp, shaded by the sample, with all light that bounces;
 *           of the views of a lamp the median is kept (what stands before a cell in one view
 *           stands elsewhere in another). A cell that no view of a lamp shows gets its albedo
 *           under other lamps. The board is matte: each cell of area A and radiance B adds at a
 *           point p of the sample
 *
 *               L(wo) = sum f(w, wo) B A (n.w) (m.-w) / d^2,      w towards the cell, m its normal
 *
 * Accuracy. One bounce off the board, with every bounce before it (it is in the photographs).
 *           Cells are a fiftieth of the board: fine for lobes wider than a few degrees.
 */
#include "board_light.h"
#include "sample_light.h"

#include <stdlib.h>
#include <string.h>

enum { NIGHT_FACETS = 30 };
static const double NIGHT = 0.15;       // sine of the lamp's height below a night facet's horizon
static const double SNR_NIGHT = 5;      // of the light that is due there, for its ratio to count
static const double MODEL = 0.05;       // what the lobe and the cells leave, relative
static const double FAINT = 0.02;       // a night side darker than this part of what is due is dark
static const double CELL_ANGLE = 0.12;  // rad, of a cell some 40 mm away
static const double MIRRORED = 0.14;    // and where a mirror shows it
static const double UNTOLD = 0.15;      // sigma of the strength where no night side is seen

/* ---- what the photographs show
 * -------------------------------------------------------------------- */

static int by_value(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/** One view's row: radiance for power 1, vignetting taken out; NAN where the sample hides a cell.
 */
static void clean(float *row, const struct board_survey *s, const struct calibration *c, int v)
{
    const struct view *view = &c->view[v];
    const struct camera *camera = &c->camera[view->camera];
    const float *seen = s->seen + 3 * (size_t)v * (size_t)s->cells;
    vec3 eye = cal_eye(view->view_from_world);
    for (int i = 0; i < s->cells; i++, row += 3, seen += 3) {
        const struct glow *cell = &s->cell[i];
        double pixel[2];
        if (isnan(seen[0]) || cal_in_the_way(c, eye, cell->point, 2 + cell->side)) {
            row[0] = NAN;
            continue;
        }
        cal_project(camera, cal_to_view(view->view_from_world, cell->point), pixel);
        double scale = 1 / (view->power * cal_vignetting(camera, pixel));
        for (int k = 0; k < 3; k++)
            row[k] = seen[k] * (float)scale;
    }
}

/** Median over the views of a lamp of one channel of a cell; NAN: none shows it. */
static double median_seen(const float *all, int cells, const struct calibration *c, int lamp,
                          int cell, int channel, float *work)
{
    int n = 0;
    for (int v = 0; v < c->views; v++) {
        const float *seen = all + 3 * ((size_t)v * (size_t)cells + (size_t)cell);
        if (c->view[v].light == lamp && !isnan(seen[0]))
            work[n++] = seen[channel];
    }
    if (n == 0)
        return NAN;
    qsort(work, (size_t)n, sizeof *work, by_value);
    return 0.5 * ((double)work[(n - 1) / 2] + work[n / 2]);
}

/** cos/r^2 of a fixed lamp at a cell; 0 where the sample or the board's own back shades it. */
static double lamp_on_cell(const struct calibration *c, int lamp, const struct glow *cell)
{
    const struct lamp *l = &c->lamp[lamp];
    const pose world = {{0, 0, 0}, {0, 0, 0}};
    double falloff;
    double cosine = vec3_dot(cal_lamp_way(l, world, cell->point, &falloff), cell->normal);
    if (l->on_camera || cosine <= 0
        || cal_in_the_way(c, cell->point, cal_lamp_position(l, world), 0))
        return 0;
    return cosine * falloff;
}

/** Cells that no view of a lamp shows: their albedo under other lamps times this lamp's light. */
static void fill_unseen(struct surroundings *s, const struct calibration *c)
{
    for (int l = 0; l < c->lamps; l++)
        for (int i = 0; i < s->count; i++) {
            struct glow *cell = &s->glow[(size_t)l * (size_t)s->count + (size_t)i];
            if (!isnan(cell->radiance[0]))
                continue;
            memset(cell->radiance, 0, sizeof cell->radiance);
            double here = lamp_on_cell(c, l, cell);
            for (int m = 0; m < c->lamps && here > 0; m++) {
                const struct glow *other = &s->glow[(size_t)m * (size_t)s->count + (size_t)i];
                double there = lamp_on_cell(c, m, other);
                if (m == l || there <= 0 || isnan(other->radiance[0]))
                    continue;
                for (int k = 0; k < 3; k++)
                    cell->radiance[k] = other->radiance[k] * here * c->lamp[l].intensity[k]
                                        / (there * c->lamp[m].intensity[k]);
                break;
            }
        }
}

/** seen: [views][cells][3], cleaned. */
static enum status summarise(struct surroundings *to, const struct board_survey *s,
                             const float *seen, const struct calibration *c, struct error *err)
{
    float *work = calloc((size_t)c->views, sizeof *work);
    to->glow = calloc((size_t)c->lamps * (size_t)s->cells, sizeof *to->glow);
    to->count = s->cells;
    if (!work || !to->glow) {
        free(work);
        return cap_fail(err, STATUS_MEMORY, "%d cells under %d lamps", s->cells, c->lamps);
    }
    for (int l = 0; l < c->lamps; l++)
        for (int i = 0; i < s->cells; i++) {
            struct glow *cell = &to->glow[(size_t)l * (size_t)s->cells + (size_t)i];
            *cell = s->cell[i];
            for (int k = 0; k < 3; k++) {
                double median = median_seen(seen, s->cells, c, l, i, k, work);
                cell->radiance[k] = isnan(median) ? NAN : fmax(median, 0);
            }
        }
    fill_unseen(to, c);
    free(work);
    return STATUS_OK;
}

enum status cal_board_light(struct calibration *c, const struct board_survey *survey,
                            struct run *run, struct error *err)
{
    struct surroundings found = {0};
    const size_t row = 3 * (size_t)survey->cells;
    float *seen = malloc((row * (size_t)c->views + 1) * sizeof *seen);
    enum status status =
        seen ? STATUS_OK
             : cap_fail(err, STATUS_MEMORY, "%d cells in %d views", survey->cells, c->views);
#pragma omp parallel for schedule(dynamic) num_threads(run->threads) if (!status)
    for (int v = 0; v < c->views; v++)
        if (!status)
            clean(seen + row * (size_t)v, survey, c, v);
    if (!status)
        status = summarise(&found, survey, seen, c, err);
    if (!status) {
        free(c->surroundings.glow);
        c->surroundings.glow = found.glow;
        c->surroundings.count = found.count;
    } else {
        free(found.glow);
    }
    free(seen);
    return status;
}

/* ---- is it there? ---------------------------------------------------------------------------- */

static int by_double(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/** Does the lamp stand well below the facet's horizon, and the camera well above? */
static bool at_night(const struct facet *f, const struct calibration *c, vec3 *wo)
{
    const struct view *view = &c->view[f->view];
    double unused;
    vec3 to_lamp = cal_lamp_way(&c->lamp[view->light], view->view_from_world, f->point, &unused);
    *wo = vec3_normalize(vec3_sub(cal_eye(view->view_from_world), f->point));
    return vec3_dot(to_lamp, f->normal) < -NIGHT && vec3_dot(*wo, f->normal) > 2 * NIGHT;
}

/** Seen over due radiance of a night facet; NAN where too little is due to tell. */
static double night_ratio(const struct facet *f, const struct calibration *c)
{
    double light[3], seen = 0, due = 0, noise = 0;
    vec3 wo;
    if (!at_night(f, c, &wo))
        return NAN;
    cal_bounce(c, f->view, f->point, f->normal, wo, light);
    for (int k = 0; k < 3; k++) {
        seen += f->mean[k];
        due += light[k];
        noise += f->noise[k] * f->noise[k];
    }
    return due > SNR_NIGHT * sqrt(noise) ? seen / due : NAN;
}

enum status cal_board_light_strength(struct calibration *c, const struct facets *sample,
                                     struct run *run, struct error *err)
{
    struct surroundings *s = &c->surroundings;
    double *ratio = calloc((size_t)sample->count + 1, sizeof *ratio);
    if (!ratio)
        return cap_fail(err, STATUS_MEMORY, "%d facets", sample->count);
    s->strength = 1;
#pragma omp parallel for schedule(dynamic, 64) num_threads(run->threads)
    for (int i = 0; i < sample->count; i++)
        ratio[i] = night_ratio(&sample->facet[i], c);
    int n = 0;
    for (int i = 0; i < sample->count; i++)
        if (!isnan(ratio[i]))
            ratio[n++] = ratio[i];
    s->sigma_strength = UNTOLD;
    s->told = n >= NIGHT_FACETS;
    if (s->told) {
        qsort(ratio, (size_t)n, sizeof *ratio, by_double);
        s->strength = ratio[n / 2] > FAINT ? ratio[n / 2] : 0;
        // Half the quartiles' distance; and the errors of one view are one error.
        double scatter = 0.74 * (ratio[3 * n / 4] - ratio[n / 4]);
        s->sigma_strength = hypot(scatter / sqrt(c->views), MODEL * s->strength);
        if (s->peak_unknown && s->strength > 0) {  // what it mirrors of the board is not known
            s->strength = 1;
            s->sigma_strength = MIRRORED;
        }
    }
    free(ratio);
    return STATUS_OK;
}

/* ---- light between board and sample ---------------------------------------------------------- */

/** What a mirror in the sample's place shows of the board, blurred by what a cell fills of it. */
static void add_mirrored(const struct surroundings *s, const struct glow *glow, vec3 point,
                         vec3 normal, vec3 wo, double power, double sum[3])
{
    double cos_o = vec3_dot(wo, normal);
    vec3 mirror = vec3_sub(vec3_scale(normal, 2 * cos_o), wo);
    const double sharp = 1 / (CELL_ANGLE * CELL_ANGLE);
    for (int i = 0; i < s->count; i++) {
        vec3 to = vec3_sub(glow[i].point, point);
        double r2 = vec3_dot(to, to), r = sqrt(r2), down = -vec3_dot(to, glow[i].normal);
        double off = 1 - vec3_dot(to, mirror) / r;
        if (down <= 0 || off * sharp > 12 || vec3_dot(to, normal) <= 0)
            continue;
        double seen = sharp / (2 * CAP_PI) * exp(-off * sharp) * down * glow[i].side * glow[i].side
                      / (r2 * r) * power;
        for (int k = 0; k < 3; k++)
            sum[k] += glow[i].radiance[k] * seen;
    }
}

void cal_bounce_kinds(const struct calibration *c, int view, vec3 point, vec3 normal, vec3 wo,
                      double radiance[ECHOES][3])
{
    memset(radiance, 0, sizeof(double[ECHOES][3]));
    const struct surroundings *s = &c->surroundings;
    if (s->count == 0 || !s->has_lobe || s->strength == 0)
        return;
    const struct glow *glow = s->glow + (size_t)c->view[view].light * (size_t)s->count;
    double cos_o = vec3_dot(wo, normal), power = c->view[view].power * s->strength;
    const bool narrow = 2 * s->lobe.gloss_width < CELL_ANGLE;
    for (int i = 0; i < s->count; i++) {
        vec3 to = vec3_sub(glow[i].point, point);
        double up = vec3_dot(to, normal), down = -vec3_dot(to, glow[i].normal);
        if (up <= 0 || down <= 0)
            continue;
        double r2 = vec3_dot(to, to), f[3];
        double form = up * down * glow[i].side * glow[i].side / (r2 * r2) * power;
        for (int k = 0; k < 3; k++)
            radiance[ECHO_MATTE][k] += (double)s->lobe.matte[k] * glow[i].radiance[k] * form;
        if (narrow)
            continue;
        vec3 wi = vec3_scale(to, 1 / sqrt(r2)), h = vec3_normalize(vec3_add(wi, wo));
        cal_lobe_lookup(&s->lobe, up / sqrt(r2), cos_o, vec3_dot(h, normal), vec3_dot(wi, h), f);
        for (int k = 0; k < 3; k++)
            radiance[ECHO_GLOSS][k] +=
                (f[k] - (double)s->lobe.matte[k]) * glow[i].radiance[k] * form;
    }
    if (!narrow && !s->peak_unknown)
        return;
    double shown[3] = {0}, albedo[3], rise = cal_rise(cos_o);
    add_mirrored(s, glow, point, normal, wo, power, shown);
    cal_lobe_gloss_albedo(&s->lobe, cos_o, albedo);
    for (int k = 0; k < 3; k++) {
        radiance[ECHO_GLOSS][k] += narrow ? albedo[k] * shown[k] : 0;
        radiance[ECHO_MIRROR + k][k] = s->peak_unknown ? (1 - rise) * shown[k] : 0;
        radiance[ECHO_RIM][k] = s->peak_unknown ? rise * shown[k] : 0;
    }
}

void cal_bounce(const struct calibration *c, int view, vec3 point, vec3 normal, vec3 wo,
                double radiance[3])
{
    double kinds[ECHOES][3];
    cal_bounce_kinds(c, view, point, normal, wo, kinds);
    for (int k = 0; k < 3; k++)
        radiance[k] = kinds[ECHO_MATTE][k] + kinds[ECHO_GLOSS][k];
}
