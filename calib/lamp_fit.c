/* lamp_fit.c -- lamps, powers and vignetting from the light on board and sample.
 *
 * Method.   One least-squares problem over facets (photometry.h; the model: lamp_model.h) with the
 *           lamp's place and irradiances E_c, the view's power k, and for f the patch's albedo/pi
 *           (known), the paper's (unknown), or the sample's lobe (lobe.h: any isotropic
 *           reflectance). k of a lamp's first view is held; at the end powers get mean 1. Cauchy's
 *           loss takes shadows and stains out; it begins ten times wider than it ends, since a
 *           start from the board alone can be half a metre off. Which facets the lamp lights needs
 *           the lamp (lamp_problem.c): all is done again. How far paper, patch and sample really
 *           stray from the model their own residuals tell, and weights follow that. A lamp whose
 *           distance comes out below FAR_SIGMAS sigmas of its inverse is at infinity: its distance
 *           is held there, and it has a direction alone.
 * Accuracy. The sandwich over views (which share errors of pose and model) and over places of the
 *           board (what is uneven there all views share) is used for sigmas, never below the formal
 *           ones.
 */
#include "lamp_problem.h"
#include "sandwich.h"

#include <stdlib.h>
#include <string.h>

static const double TOLERANCE = 1e-5;  // of the cost: lamps are then within a hundredth of a sigma
static const double FAR_SIGMAS = 3;
static const double SETTLED = 0.1;                    // of the logarithm of such a scale
static const double SCALE_MIN = 0.1, SCALE_MAX = 10;  // of a material's sigmas, by its residuals
enum { ROUNDS = 4 };

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/** Make each material's sigmas as large as its residuals are: 1.4826 times their median is one
 *  sigma. *settled: none of them changed much. False: out of memory. */
static bool rescale(struct lamp_state *s, const struct lamp_problem *p, bool *settled)
{
    *settled = true;
    double *left = calloc(3 * (size_t)p->terms + 1, sizeof *left);
    for (int kind = 0; left && kind < LAMP_KINDS; kind++) {
        size_t n = 0;
        for (int t = 0; t < p->terms; t++) {
            const struct observation *o = p->term[t].context;
            const double *block[CERES_TERM_PARAMETERS];
            if (!o->facet || o->kind != kind)
                continue;
            for (int k = 0; k < p->term[t].parameters; k++)
                block[k] = p->parameter[p->term[t].parameter[k]].value;
            if (cal_lamp_evaluate(o, block, left + n, NULL))
                n += 3;
        }
        for (size_t i = 0; i < n; i++)
            left[i] = fabs(left[i]);
        qsort(left, n, sizeof *left, by_value);
        if (n <= 30)  // too few to tell
            continue;
        double was = s->scale[kind];
        if (kind == KIND_SAMPLE)
            s->misfit = was * s->doubt * 1.4826 * left[n / 2] * lamp_floor_sample;
        double doubt = kind == KIND_SAMPLE ? s->doubt : 1;
        s->scale[kind] = fmin(fmax(was * doubt * 1.4826 * left[n / 2], SCALE_MIN), SCALE_MAX);
        *settled = *settled && fabs(log(s->scale[kind] / was)) < SETTLED;
    }
    free(left);
    return left != NULL;
}

static enum status spread_of(struct lamp_spread *spread, const struct lamp_problem *p,
                             struct ceres_problem *problem, int views, struct error *err)
{
    int *cluster = calloc((size_t)p->terms + 1, sizeof *cluster);
    int *place = calloc((size_t)p->terms + 1, sizeof *place), places = 0;
    spread->numbers = 0;
    for (int i = 0; i < p->parameters; i++)
        spread->numbers += p->parameter[i].size;
    size_t n = (size_t)spread->numbers;
    spread->covariance = calloc(n * n, sizeof *spread->covariance);
    enum status status = cluster && place && spread->covariance
                             ? STATUS_OK
                             : cap_fail(err, STATUS_MEMORY, "the covariance of %zu numbers", n);
    for (int t = 0; !status && t < p->terms; t++) {
        const struct observation *o = p->term[t].context;
        cluster[t] = o->facet || o->kind == KIND_HIGHLIGHT ? o->view : -1;
        place[t] = o->facet ? o->facet->place : -1;
        places = place[t] >= places ? place[t] + 1 : places;
    }
    if (!status)
        status =
            cal_sandwich_two_ways(spread->covariance, problem, cluster, views, place, places, err);
    free(place);
    free(cluster);
    return status;
}

/** One solution from the facets that the present lamps light. */
static enum status solve(struct calibration *c, struct lamp_state *s, const struct capture *capture,
                         const struct lamp_evidence *e, struct sample_shift *shift, bool *settled,
                         struct error *err)
{
    struct lamp_problem p;
    struct lamp_spread spread = {0};
    enum status status = lamp_problem_make(&p, s, c, capture, e, err);
    if (status)
        return status;
    struct ceres_problem problem = {.parameter = p.parameter,
                                    .term = p.term,
                                    .parameters = p.parameters,
                                    .terms = p.terms,
                                    .iterations = 60,
                                    .tolerance = TOLERANCE};
    status = ceres_solve(&problem, err);
    if (!status)
        status = spread_of(&spread, &p, &problem, c->views, err);
    if (status)
        goto done;
    for (int l = 0; l < c->lamps; l++)
        s->sigma_inverse[l] = sqrt(lamp_covariance(&spread, 3 * l + 2, 3 * l + 2));
    lamp_keep(c, s, e->sample && e->sample->count > 0, &spread);
    lamp_keep_shift(shift, s, &spread);
    if (!rescale(s, &p, settled))
        status = cap_fail(err, STATUS_MEMORY, "%d residuals", p.terms);
done:
    free(spread.covariance);
    lamp_problem_free(&p);
    return status;
}

/** Hold the lamps at infinity whose distance is not determined. -> how many more there are. */
static int send_away(struct lamp_state *s, int lamps)
{
    int more = 0;
    for (int l = 0; l < lamps; l++)
        if (!s->far[l] && s->place[l][2] < FAR_SIGMAS * s->sigma_inverse[l]) {
            s->far[l] = true;
            s->place[l][2] = 0;
            more++;
        }
    return more;
}

/** The strength of a lamp that has a place is none that has not. */
static enum status check_strengths(const struct lamp_state *s, const struct calibration *c,
                                   struct error *err)
{
    for (int l = 0; l < c->lamps; l++)
        if (s->far[l] && c->lamp[l].known.sigma_all > 0 && !c->lamp[l].known.at_infinity)
            return cap_fail(err, STATUS_DATA,
                            "lamp %s: the photographs do not tell its distance, so the reference "
                            "capture, in which it has one, does not tell how strong it is here",
                            c->lamp[l].name);
    return STATUS_OK;
}

enum status cal_lamp_fit(struct calibration *c, const struct capture *capture,
                         const struct lamp_evidence *evidence, bool may_be_far,
                         struct sample_shift *shift, struct error *err)
{
    struct lamp_state s;
    struct sample_shift moved = {0};
    enum status status = STATUS_OK;
    if (!lamp_state_make(&s, c, SCALE_MAX) || !lamp_state_start(&s, c, capture, evidence))
        status = cap_fail(err, STATUS_MEMORY, "lamps of %d views", c->views);
    bool settled = false;
    s.doubt = evidence->doubt;
    s.beams_free = may_be_far && evidence->sample && evidence->sample->count > 0;
    for (int round = 0; round < ROUNDS && !settled && !status; round++)
        status = solve(c, &s, capture, evidence, &moved, &settled, err);
    int sent = !status && may_be_far ? send_away(&s, c->lamps) : 0;
    if (sent > 0)
        status = check_strengths(&s, c, err);
    if (!status && sent > 0)
        status = solve(c, &s, capture, evidence, &moved, &settled, err);
    moved.misfit = s.misfit;
    if (!status && shift)
        *shift = moved;
    lamp_state_free(&s);
    return status;
}
