/* cues.c -- what each kind of evidence alone says of the lamps.
 *
 * Method.   Board and sample: the fit of lamp_fit.c, from the joint answer, with the other's facets
 *           left out. Highlights: each gives a line from the sample; where it is as far from the
 *           sample as the joint answer's lamp, seen from there, is a direction. (Highlights hardly
 *           tell a distance.) Directions are averaged by their sigmas, strays left out once.
 */
#include "cues.h"

#include <stdlib.h>
#include <string.h>

static const double STRAY = 5;         // sigmas
static const double DISAGREE = 4;      // sigmas: two numbers pass them once in 3000
static const double SIGMA_MAX = 0.3;   // rad: a cue less sure than this tells nothing
static const double MIRRORS = 0.3;     // reflectance face on: of metals
static const double HARMLESS = 0.001;  // rad: 0.06 degrees cost half a per cent at 80

const char *cal_cue_name(enum cue cue)
{
    static const char *const names[CUES] = {"joint",     "board",  "sample",
                                            "highlight", "shadow", "ball"};
    return names[cue];
}

/** A copy whose lamps, views and cameras a fit may overwrite; names and tags are the original's. */
static bool copy_of(struct calibration *copy, const struct calibration *c)
{
    *copy = *c;
    copy->lamp = malloc((size_t)c->lamps * sizeof *c->lamp);
    copy->view = malloc((size_t)c->views * sizeof *c->view);
    copy->camera = malloc((size_t)c->cameras * sizeof *c->camera);
    if (!copy->lamp || !copy->view || !copy->camera)
        return false;
    memcpy(copy->lamp, c->lamp, (size_t)c->lamps * sizeof *c->lamp);
    memcpy(copy->view, c->view, (size_t)c->views * sizeof *c->view);
    memcpy(copy->camera, c->camera, (size_t)c->cameras * sizeof *c->camera);
    return true;
}

/** The cue of a fit with these facets; where it fails, the facets tell nothing. */
static enum status shading(struct calibration *c, const struct capture *capture, enum cue cue,
                           const struct facets *board, const struct facets *sample,
                           struct error *err)
{
    struct calibration copy;
    const struct lamp_evidence evidence = {.board = board, .sample = sample, .doubt = 1};
    enum status status = STATUS_OK;
    if (!copy_of(&copy, c))
        status = cap_fail(err, STATUS_MEMORY, "%d views", c->views);
    else if (!cal_lamp_fit(&copy, capture, &evidence, false, NULL, NULL))
        for (int l = 0; l < c->lamps; l++) {
            struct lamp_cue *found = &copy.lamp[l].cue[CUE_JOINT];
            if (found->sigma_distance > 0.5 * found->distance)
                found->distance = found->sigma_distance = 0;
            if (found->sigma < SIGMA_MAX)
                c->lamp[l].cue[cue] = *found;
        }
    free(copy.lamp);
    free(copy.view);
    free(copy.camera);
    return status;
}

/** Direction from `origin` to where a line from p along wi is `distance` from it (0: infinite). */
static vec3 seen_from(vec3 origin, vec3 p, vec3 wi, double distance)
{
    if (distance <= 0)
        return wi;
    vec3 off = vec3_sub(p, origin);
    double b = vec3_dot(off, wi), under = b * b - vec3_dot(off, off) + distance * distance;
    return vec3_normalize(vec3_add(off, vec3_scale(wi, -b + sqrt(fmax(under, 0)))));
}

/** The weighted mean of n directions; sigma by theirs or by their scatter, what is larger. */
static struct lamp_cue mean_of(const vec3 *direction, const double *sigma, int n)
{
    vec3 sum = {0, 0, 0};
    double weights = 0, scatter = 0;
    for (int i = 0; i < n; i++) {
        double w = 1 / (sigma[i] * sigma[i]);
        sum = vec3_add(sum, vec3_scale(direction[i], w));
        weights += w;
    }
    struct lamp_cue cue = {.direction = vec3_normalize(sum)};
    for (int i = 0; i < n; i++) {
        double off = vec3_length(vec3_sub(direction[i], cue.direction));
        scatter += 0.5 * off * off / (sigma[i] * sigma[i]);
    }
    cue.sigma = sqrt(fmax(1, n > 1 ? scatter / (n - 1) : 1) / weights);
    return cue;
}

/** The cue of a lamp by highlights on `spheres` of them: [spheres][views]. */
static enum status mirrored(struct lamp_cue *cue, const struct calibration *c, int l,
                            const struct seen_highlight *highlight, int spheres, struct error *err)
{
    const struct lamp *lamp = &c->lamp[l];
    const size_t all_of_them = (size_t)(spheres * c->views) + 1;
    vec3 *direction = calloc(all_of_them, sizeof *direction);
    double *sigma = calloc(all_of_them, sizeof *sigma);
    int n = 0, kept = 0;
    if (!direction || !sigma) {
        free(direction);
        free(sigma);
        return cap_fail(err, STATUS_MEMORY, "%d views", c->views);
    }
    for (int i = 0; i < spheres * c->views; i++) {
        const struct view *view = &c->view[i % c->views];
        const pose at = view->view_from_world;
        if (view->light != l || highlight[i].sigma <= 0)
            continue;
        vec3 p = cal_lamp_frame(lamp, at, highlight[i].point);
        vec3 wi = cal_lamp_frame_direction(lamp, at, highlight[i].wi);
        vec3 origin = cal_lamp_frame(lamp, at, c->sample.center);
        direction[n] = seen_from(origin, p, wi, lamp->cue[CUE_JOINT].distance);
        sigma[n++] = highlight[i].sigma;
    }
    struct lamp_cue all = n ? mean_of(direction, sigma, n) : (struct lamp_cue){.sigma = 0};
    for (int i = 0; i < n; i++)
        if (vec3_length(vec3_sub(direction[i], all.direction))
            < STRAY * hypot(sigma[i], all.sigma)) {
            direction[kept] = direction[i];
            sigma[kept++] = sigma[i];
        }
    *cue = kept ? mean_of(direction, sigma, kept) : all;
    free(direction);
    free(sigma);
    return STATUS_OK;
}

enum status cal_highlight_cue(struct calibration *c, int l, const struct seen_highlight *highlight,
                              struct error *err)
{
    return mirrored(&c->lamp[l].cue[CUE_HIGHLIGHT], c, l, highlight, 1, err);
}

void cal_cues_compare(const struct lamp *lamp, struct run *run)
{
    const struct lamp_cue *joint = &lamp->cue[CUE_JOINT];
    for (int k = CUE_BOARD; k < CUES; k++) {
        const struct lamp_cue *cue = &lamp->cue[k];
        double off = vec3_length(vec3_sub(cue->direction, joint->direction));
        double due = hypot(cue->sigma, joint->sigma);
        if (cue->sigma > 0 && off > DISAGREE * due && off > HARMLESS)
            cap_warn(
                run,
                "lamp %s: its direction by %s alone is %.2f degrees off (%.1f sigma): look for "
                "%s",
                lamp->name, cal_cue_name((enum cue)k), off * 180 / CAP_PI, off / due,
                k == CUE_BOARD    ? "other light on the board, or paper that is not even"
                : k == CUE_SHADOW ? "a board that is not flat, or a second lamp"
                : k == CUE_SAMPLE ? "a sample that is not of one material, or not a sphere"
                : k == CUE_BALL   ? "a ball that is not round, or a second lamp"
                                  : "a sample that is not a sphere, or a second lamp");
    }
}

/** What a sample shows of its surroundings, if it mirrors much, hides what the lamp does to it. */
static bool mirrors(const struct surroundings *s)
{
    return s->strength > 0 && s->peak_unknown
           && fmax(fmax(s->mirror[0], s->mirror[1]), s->mirror[2]) > MIRRORS;
}

enum status cal_cues(struct calibration *c, const struct capture *capture,
                     const struct facets *board, const struct facets *sample,
                     const struct seen_highlight *highlight, struct run *run, struct error *err)
{
    enum status status = STATUS_OK;
#pragma omp parallel for schedule(static, 1) num_threads(run->threads)
    for (int cue = CUE_BOARD; cue <= CUE_SAMPLE; cue++) {  // each writes its own entry of a lamp
        struct error own = {0};
        enum status s = STATUS_OK;
        if (cue == CUE_BOARD)
            s = shading(c, capture, CUE_BOARD, board, NULL, &own);
        else if (sample->count && !mirrors(&c->surroundings))
            s = shading(c, capture, CUE_SAMPLE, NULL, sample, &own);
        if (s) {
#pragma omp critical(cues_error)
            status = cap_fail(err, s, "%s", own.text);
        }
    }
    for (int l = 0; l < c->lamps && !status; l++)
        status = cal_highlight_cue(c, l, highlight, err);
    for (int l = 0; l < c->lamps && !status; l++)
        status = mirrored(&c->lamp[l].cue[CUE_BALL], c, l, highlight + c->views, c->balls, err);
    return status;
}
