/* sample_start.c -- the sample to a pixel of its outline.
 *
 * The outline is looked for near the place that capture.yaml has. Where what is found there looks
 * like no outline, or nothing is found, the sample is sought nearby, then over the whole board
 * (seek.c), and its outline looked for again from there.
 */
#include "sample_start.h"

#include "limb.h"
#include "seek.h"
#include "sphere.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

static const double PLACED_BY_EYE = 0.15;  // reaches: no more than that is no news
static const double NEARBY = 2;            // reaches of the sample: more than any slip of a ruler
static const double ENOUGH = 0.1;  // of an outline: one that is lit from a side shows half of it
static const double OUTLINE_MOST = 240;  // edges that are looked for in a view, whatever its size
static const double FLAT = 0.01;         // of half the board: from tags that lie in a plane
static const double LYING = 0.1;         // reaches that a sample's middle is above what it lies on
static const double PROMISING = 0.8;     // of the best place's score: worth a closer look
static const double UNSURE = 0.6;        // of a score where no place shows an outline for sure

static enum status nominal_mesh(struct sample *sample, const struct sample_place *nominal,
                                struct error *err)
{
    struct sample s = {.shape = SHAPE_MESH,
                       .file = realpath(nominal->file, NULL),
                       .scale = nominal->scale,
                       .world_from_file = {nominal->rotation, nominal->translation}};
    if (!s.file)
        return cap_fail(err, STATUS_IO, "%s: %s", nominal->file, strerror(errno));
    enum status status = cal_sample_load(&s, err);
    if (status)
        free(s.file);
    else
        *sample = s;
    return status;
}

static enum status nominal_sample(struct sample *sample, const struct sample_place *nominal,
                                  struct error *err)
{
    if (nominal->shape == SHAPE_MESH)
        return nominal_mesh(sample, nominal, err);
    *sample = (struct sample){.shape = nominal->shape,
                              .center = nominal->center,
                              .radius = nominal->radius,
                              .height = nominal->height};
    if (nominal->shape == SHAPE_CYLINDER)
        sample->axis = vec3_normalize(nominal->axis);
    return STATUS_OK;
}

/** What every attempt needs. */
struct attempt {
    struct calibration *c;
    struct solid_prior *prior;
    const struct capture *capture;
    const char *out;
    struct run *run;
};

bool cal_edges_enough(const struct calibration *c)
{
    double expected = 0;
    for (int v = 0; v < c->views; v++) {
        vec3 at = cal_to_view(c->view[v].view_from_world, c->sample.center);
        double px = c->camera[c->view[v].camera].focal[0] * cal_solid_reach(&c->sample);
        expected += fmin(2 * CAP_PI * px / vec3_length(at) / EDGE_PX, OUTLINE_MOST);
    }
    return c->sample.outline_edges > ENOUGH * expected;
}

/** From where the sample stands. */
static enum status look_near(bool *sure, const struct attempt *a, struct error *err)
{
    const struct sample *s = &a->c->sample;
    enum status status;
    if (s->shape == SHAPE_SPHERE) {
        status = cal_sphere_start(sure, a->c, a->capture, a->out, a->run, err);
    } else {
        const double sigma = a->capture->sample.radius_sigma;
        *a->prior = (struct solid_prior){.radius = s->radius, .radius_sigma = sigma};
        status = cal_solid_start(sure, a->prior, a->c, a->out, a->run, err);
    }
    *sure = *sure && !status && cal_edges_enough(a->c);
    return status;
}

/** Half of the board, the longer way, and how low a sample above it may be: no limit where the
 * board has tags at several heights. */
static double half_board(const struct calibration *c, double *lowest)
{
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    double most = 0;
    for (int i = 0; i < 4 * c->tags; i++) {
        vec3 p = cap_tag_corner(&c->tag[i / 4].place, i % 4);
        const double at[3] = {p.x, p.y, p.z};
        for (int k = 0; k < 3; k++) {
            low[k] = fmin(low[k], at[k]);
            high[k] = fmax(high[k], at[k]);
            most = fmax(most, 0.5 * (high[k] - low[k]));
        }
    }
    *lowest = high[2] - low[2] < FLAT * most ? high[2] : -INFINITY;
    return most;
}

/** A place where the sample may be: as it stands there, and what seek.c makes of it. */
struct stand {
    struct sample sample;
    struct solid_prior prior;
    double score;
    bool sure;
};

/** The sample moved from its nominal place, and its outline looked for there. Not found: STATUS_OK,
 *  and a score of 0. */
static enum status stand_at(struct stand *stand, const struct attempt *a, const struct seek *seek,
                            const struct sample *nominal, const struct place *place,
                            struct error *err)
{
    struct sample *s = &a->c->sample;
    double score = 0;
    bool sure = false;
    enum status status = cal_solid_return(s, nominal, err);
    if (!status)
        status = cal_solid_move(s, place->turn, place->shift, err);
    if (!status)
        status = look_near(&sure, a, err);
    if (!status)
        status = cal_seek_score(&score, seek, s, err);
    *stand = (struct stand){*s, *a->prior, score, sure};
    return status == STATUS_DATA ? STATUS_OK : status;
}

/** Is a place to be taken for another that was found before it? Where neither shows an outline for
 *  sure, a little better is no reason. */
static bool better(const struct stand *a, const struct stand *before)
{
    if (a->sure != before->sure)
        return a->sure;
    return (a->sure ? 1 : UNSURE) * a->score > fmax(before->score, 0);
}

/** Seek the sample around its nominal place. *stand: the best that is known, before and after. */
static enum status seek_within(struct stand *stand, const struct attempt *a,
                               const struct seek *seek, const struct sample *nominal, double extent,
                               double lowest, struct error *err)
{
    struct place place[PLACES];
    int places = 0;
    enum status status = cal_solid_return(&a->c->sample, nominal, err);
    if (!status)
        status = cal_seek_find(place, &places, seek, nominal, extent,
                               lowest + LYING * cal_solid_reach(nominal), a->run, err);
    for (int k = 0; k < places && !status && place[k].score > PROMISING * place[0].score; k++) {
        struct stand other;
        status = stand_at(&other, a, seek, nominal, &place[k], err);
        if (!status && better(&other, stand))
            *stand = other;
    }
    return status;
}

static void tell(const struct attempt *a, const struct sample *nominal)
{
    const double off = vec3_length(vec3_sub(a->c->sample.center, nominal->center));
    if (off > PLACED_BY_EYE * cal_solid_reach(nominal))
        cap_warn(a->run,
                 "the sample is not where capture.yaml has it: the photographs show it %.3g mm "
                 "from there",
                 off);
}

/** *stand: what was found from the nominal place. */
static enum status look_far(struct stand *stand, const struct attempt *a,
                            const struct sample *nominal, struct error *err)
{
    struct sample *s = &a->c->sample;
    struct seek *seek = NULL;
    double lowest, near = NEARBY * cal_solid_reach(nominal), far = half_board(a->c, &lowest);
    const double extent[] = {near, far};
    const bool was_found = stand->score >= 0;
    enum status status = cal_seek_begin(&seek, a->c, nominal, a->out, a->run, err);
    if (!status && was_found)
        status = cal_seek_score(&stand->score, seek, s, err);
    for (int k = 0; k < (far > near ? 2 : 1) && !status && !stand->sure; k++)
        status = seek_within(stand, a, seek, nominal, extent[k], lowest, err);
    cal_seek_end(seek);
    if (!status)
        status = cal_solid_return(s, &stand->sample, err);
    *a->prior = stand->prior;
    return status;
}

enum status cal_sample_start(struct calibration *c, struct solid_prior *prior,
                             const struct capture *capture, const char *out, struct run *run,
                             struct error *err)
{
    const struct attempt a = {c, prior, capture, out, run};
    struct error own = {0};
    struct stand stand = {.sure = false};
    enum status status = nominal_sample(&c->sample, &capture->sample, err);
    if (status)
        return status;
    const struct sample nominal = c->sample;
    enum status found = look_near(&stand.sure, &a, &own);
    if (found && found != STATUS_DATA)
        return cap_fail(err, found, "%s", own.text);
    if (stand.sure)
        return STATUS_OK;
    stand.sample = c->sample;
    stand.prior = *prior;
    stand.score = found ? -1 : 0;
    status = look_far(&stand, &a, &nominal, err);
    if (!status && stand.score < 0)
        return cap_fail(err, found, "%s", own.text);
    if (!status)
        tell(&a, &nominal);
    return status;
}
