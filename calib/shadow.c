/* shadow.c -- lamps by the shadow that a sphere casts on the board.
 *
 * Method.   From a place q on the shadow's edge the lamp's middle is seen right at the sphere's
 *           limb: with c and R the sphere, and the way to the lamp as in lamp_model.h,
 *
 *               angle(way(q), c - q) = asin(R / |c - q|)
 *
 *           Gauss-Newton on the lamp's direction and inverse distance, reweighted by Tukey's
 *           biweight. The lamp's size is what blurs the edges beside lens and photosites: the
 *           radius at which all pieces together leave the least, each by the logarithm of its sum
 *           of squares, for its noise is unknown.
 * Accuracy. Edges are found to hundredths of a millimetre; what paper stands above or below the
 *           tags' plane (SURFACE_MM) limits a direction to a tenth of a degree or so. That, and
 *           what is not known of the sphere's place, is in sigma; in the size's, what is not known
 *           of the blur.
 */
#include "shadow.h"

#include "dense.h"
#include "lamp_model.h"
#include "view_map.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

enum { PIECES = 160, SIZE_PIECES = 60, AROUND = 48, TIES_MIN = 8, ROUNDS = 12, UNKNOWNS = 3 };
static const double COVERED = 0.1;      // of the radius: a wider penumbra is not seen to its ends
static const double SURFACE_MM = 0.15;  // thickness of paper, and how flat a board is
static const double EDGE_SIGMA = 0.02;  // mm: no edge is better than that
static const double BIWEIGHT = 4.685;   // 95 % efficient for normal errors
static const double SIGMA_MAX = 0.1;    // rad: a cue less sure than this tells nothing
static const double BLUR_UNSURE = 0.1;  // of what the lens blurs
static const double LIMB_BENDS = 0.02;  // of a size: what taking the limb for straight costs
static const double SIGNIFICANT = 6;    // sigmas of a size: what blurs an edge is not only the lamp
static const double SCATTER_MAX = 0.5;  // mm, of edges: more is no shadow

/* ---- the lamp's place ------------------------------------------------------------------------ */

/** An edge, in the lamp's frame. */
struct tie {
    vec3 q, across, normal, center;
    double sigma;  // of q along across, mm
    double bent;   // how far that the limb bends may have shifted it
    int view;
};

/** By what angle the lamp at x is seen outside the sphere's limb from q. */
static double miss(const struct lamp_chart *chart, const double x[3], vec3 q, vec3 center,
                   double radius)
{
    double w = cal_chart_inverse_mm(x[2]);
    vec3 way = vec3_add(cal_chart_direction(chart, x), vec3_scale(vec3_sub(chart->origin, q), w));
    vec3 to = vec3_sub(center, q);
    double sine = fmin(radius / vec3_length(to), 1);
    return atan2(vec3_length(vec3_cross(way, to)), vec3_dot(way, to)) - asin(sine);
}

/** Ties of a lamp, one for each piece. */
static void make_ties(struct tie *tie, const struct calibration *c, int l,
                      const struct shadow_piece *piece, int count, vec3 normal)
{
    const struct lamp *lamp = &c->lamp[l];
    for (int i = 0; i < count; i++) {
        const pose at = c->view[piece[i].view].view_from_world;
        vec3 q = vec3_add(piece[i].point, vec3_scale(piece[i].across, piece[i].off));
        double w = piece[i].spread * lamp->radius, bent = w * w / (8 * c->sample.radius);
        tie[i] = (struct tie){.q = cal_lamp_frame(lamp, at, q),
                              .across = cal_lamp_frame_direction(lamp, at, piece[i].across),
                              .normal = cal_lamp_frame_direction(lamp, at, normal),
                              .center = cal_lamp_frame(lamp, at, c->sample.center),
                              .sigma = hypot(hypot(piece[i].sigma, EDGE_SIGMA), bent),
                              .bent = bent,
                              .view = piece[i].view};
    }
}

/** A tie's residual in sigmas, and its derivatives by x. */
static double residual_of(const struct tie *t, const struct lamp_chart *chart, const double x[3],
                          double radius, double by_x[UNKNOWNS])
{
    const double step = 1e-5, mm = 0.05;
    double by_mm = (miss(chart, x, vec3_add(t->q, vec3_scale(t->across, mm)), t->center, radius)
                    - miss(chart, x, vec3_sub(t->q, vec3_scale(t->across, mm)), t->center, radius))
                   / (2 * mm);
    double sigma = fmax(fabs(by_mm), 1e-9) * t->sigma;
    for (int a = 0; a < UNKNOWNS; a++) {
        double high[3] = {x[0], x[1], x[2]}, low[3] = {x[0], x[1], x[2]};
        high[a] += step;
        low[a] -= step;
        by_x[a] =
            (miss(chart, high, t->q, t->center, radius) - miss(chart, low, t->q, t->center, radius))
            / (2 * step * sigma);
    }
    return miss(chart, x, t->q, t->center, radius) / sigma;
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/** A place under way. */
struct place {
    struct lamp_chart chart;
    double x[3], radius, scale;
    bool far;
    double h[UNKNOWNS * UNKNOWNS];  // its normal matrix, factored
};

/** The step that residuals ask for, and the factored normal matrix; work [count]. false: singular.
 */
static bool step_of(struct place *p, const struct tie *tie, int count, double step[UNKNOWNS],
                    double *work)
{
    double unused[UNKNOWNS];
    for (int i = 0; i < count; i++)
        work[i] = fabs(residual_of(&tie[i], &p->chart, p->x, p->radius, unused));
    qsort(work, (size_t)count, sizeof *work, by_value);
    p->scale = fmax(1.4826 * work[count / 2], 0.5);
    memset(p->h, 0, sizeof p->h);
    memset(step, 0, UNKNOWNS * sizeof *step);
    for (int i = 0; i < count; i++) {
        double by[UNKNOWNS], r = residual_of(&tie[i], &p->chart, p->x, p->radius, by);
        double u = r / (BIWEIGHT * p->scale), w = fabs(u) < 1 ? (1 - u * u) * (1 - u * u) : 0;
        for (int a = 0; a < UNKNOWNS; a++) {
            step[a] -= w * by[a] * r;
            for (int b = 0; b < UNKNOWNS; b++)
                p->h[UNKNOWNS * a + b] += w * by[a] * by[b];
        }
    }
    if (p->far) {
        for (int a = 0; a < UNKNOWNS; a++)
            p->h[UNKNOWNS * a + 2] = p->h[UNKNOWNS * 2 + a] = 0;
        p->h[UNKNOWNS * 2 + 2] = 1;
        step[2] = 0;
    }
    if (!dense_cholesky(UNKNOWNS, p->h))
        return false;
    dense_solve(UNKNOWNS, p->h, step);
    return true;
}

/** How much more views pull the place apart than their edges' noise does, as a factor of variances:
 *  what the edges of a view share (its pose, where a shadow falls on print) is no noise of theirs.
 */
static double views_apart(const double covariance[UNKNOWNS * UNKNOWNS], const struct place *p,
                          const struct tie *tie, int count)
{
    double sum[UNKNOWNS] = {0}, most = 1;
    int views = 0;
    for (int i = 0; i < count;) {  // the ties of a view stand together
        double g[UNKNOWNS] = {0};
        const int view = tie[i].view;
        for (; i < count && tie[i].view == view; i++) {
            double by[UNKNOWNS], r = residual_of(&tie[i], &p->chart, p->x, p->radius, by);
            double u = r / (BIWEIGHT * p->scale), w = fabs(u) < 1 ? (1 - u * u) * (1 - u * u) : 0;
            for (int a = 0; a < UNKNOWNS; a++)
                g[a] += (a == 2 && p->far) ? 0 : w * by[a] * r;
        }
        dense_solve(UNKNOWNS, p->h, g);
        for (int a = 0; a < UNKNOWNS; a++)
            sum[a] += g[a] * g[a];
        views++;
    }
    for (int a = 0; a < UNKNOWNS && views > 1; a++)
        most = fmax(most, sum[a] * views / (views - 1) / covariance[UNKNOWNS * a + a]);
    return most;
}

/** Add to the covariance what a change of all ties does to the place. */
static void add_shared(double covariance[UNKNOWNS * UNKNOWNS], const struct place *p,
                       const struct tie *tie, const struct tie *changed, double radius, int count)
{
    double g[UNKNOWNS] = {0};
    for (int i = 0; i < count; i++) {
        double by[UNKNOWNS], unused[UNKNOWNS];
        double r = residual_of(&tie[i], &p->chart, p->x, p->radius, by);
        double u = r / (BIWEIGHT * p->scale), w = fabs(u) < 1 ? (1 - u * u) * (1 - u * u) : 0;
        double moved = residual_of(&changed[i], &p->chart, p->x, radius, unused) - r;
        for (int a = 0; a < UNKNOWNS; a++)
            g[a] += (a == 2 && p->far) ? 0 : w * by[a] * moved;
    }
    dense_solve(UNKNOWNS, p->h, g);
    for (int a = 0; a < UNKNOWNS; a++)
        for (int b = 0; b < UNKNOWNS; b++)
            covariance[UNKNOWNS * a + b] += g[a] * g[b];
}

/** The covariance of x: the edges' own, the board's surface, what the limb's bend does to all of
 *  them, the sphere's place and radius. */
static void covariance_of(double covariance[UNKNOWNS * UNKNOWNS], const struct place *p,
                          const struct tie *tie, struct tie *work, int count,
                          const struct calibration *c, const struct lamp *lamp, pose at)
{
    dense_inverse(UNKNOWNS, p->h, covariance);
    for (int k = 0; k < UNKNOWNS * UNKNOWNS; k++)
        covariance[k] *= p->scale * p->scale;
    const double apart = views_apart(covariance, p, tie, count);
    for (int k = 0; k < UNKNOWNS * UNKNOWNS; k++)
        covariance[k] *= apart;
    memcpy(work, tie, (size_t)count * sizeof *work);
    for (int i = 0; i < count; i++)
        work[i].q = vec3_add(tie[i].q, vec3_scale(tie[i].normal, SURFACE_MM));
    add_shared(covariance, p, tie, work, p->radius, count);
    for (int i = 0; i < count; i++)
        work[i].q = vec3_add(tie[i].q, vec3_scale(tie[i].across, tie[i].bent));
    add_shared(covariance, p, tie, work, p->radius, count);
    for (int a = 0; a < 3; a++) {
        vec3 by = cal_lamp_frame_direction(lamp, at, (vec3){a == 0, a == 1, a == 2});
        memcpy(work, tie, (size_t)count * sizeof *work);
        for (int i = 0; i < count; i++)
            work[i].center = vec3_add(tie[i].center, vec3_scale(by, c->sample.sigma_center[a]));
        add_shared(covariance, p, tie, work, p->radius, count);
    }
    add_shared(covariance, p, tie, tie, p->radius + c->sample.sigma_radius, count);
}

/** Where the lamp's chart begins: the sphere, in the lamp's frame, over the pieces. */
static vec3 middle_of(const struct tie *tie, int count)
{
    vec3 sum = {0, 0, 0};
    for (int i = 0; i < count; i++)
        sum = vec3_add(sum, vec3_scale(tie[i].center, 1.0 / count));
    return sum;
}

static double middle_sigma(const struct tie *tie, int count)
{
    double sum = 0;
    for (int i = 0; i < count; i++)
        sum += tie[i].sigma / count;
    return sum;
}

enum status shadow_cue(struct lamp_cue *cue, const struct calibration *c, int l,
                       const struct shadow_piece *piece, int count, vec3 normal, struct error *err)
{
    const struct lamp *lamp = &c->lamp[l];
    *cue = (struct lamp_cue){.sigma = 0};
    if (count < TIES_MIN)
        return STATUS_OK;
    struct tie *tie = calloc((size_t)count, sizeof *tie),
               *work = calloc((size_t)count, sizeof *work);
    double *left = calloc((size_t)count, sizeof *left);
    enum status status = STATUS_OK;
    if (!tie || !work || !left) {
        status = cap_fail(err, STATUS_MEMORY, "%d edges of a shadow", count);
        goto done;
    }
    make_ties(tie, c, l, piece, count, normal);
    struct place p = {.radius = c->sample.radius, .far = lamp->at_infinity};
    p.chart = cal_lamp_chart(lamp, middle_of(tie, count), p.x);
    double step[UNKNOWNS] = {1}, covariance[UNKNOWNS * UNKNOWNS];
    bool good = true;
    for (int round = 0; round < ROUNDS && good; round++) {
        good = step_of(&p, tie, count, step, left);
        for (int a = 0; a < UNKNOWNS && good; a++)
            p.x[a] += step[a];
        p.x[2] = fmax(p.x[2], 0);
    }
    if (!good || fabs(step[0]) + fabs(step[1]) > 1e-4
        || p.scale * middle_sigma(tie, count) > SCATTER_MAX)
        goto done;
    covariance_of(covariance, &p, tie, work, count, c, lamp,
                  c->view[piece[0].view].view_from_world);
    double sigma = sqrt(0.5 * (covariance[0] + covariance[UNKNOWNS + 1]));
    if (!(sigma < SIGMA_MAX))
        goto done;
    cue->direction = cal_chart_direction(&p.chart, p.x);
    cue->sigma = sigma;
    double sigma_x2 = sqrt(covariance[2 * UNKNOWNS + 2]);
    if (!p.far && sigma_x2 < 0.5 * p.x[2] && fabs(step[2]) < 0.1 * sigma_x2) {
        cue->distance = 1 / cal_chart_inverse_mm(p.x[2]);
        cue->sigma_distance = cue->distance * sigma_x2 / p.x[2];
    }
done:
    free(tie);
    free(work);
    free(left);
    return status;
}

/* ---- the lamp's size ------------------------------------------------------------------------- */

/** Twice the negative logarithm of the likelihood of a radius, by all pieces, but for a constant.
 */
static double misfit(struct shadow_piece *piece, int count, double radius, double sharper,
                     struct run *run)
{
    double total = 0, part[SIZE_PIECES];
#pragma omp parallel for schedule(dynamic) num_threads(run->threads)
    for (int i = 0; i < count; i++)
        part[i] = shadow_edge_fit(&piece[i], radius, sharper);
    for (int i = 0; i < count; i++)
        total += isfinite(part[i]) ? piece[i].sites * log(fmax(part[i], 1e-9)) : 1e3;
    return total;
}

/** The radius where misfit is least, by the golden section on [0, most] about the best of a scan.
 */
static double best_radius(struct shadow_piece *piece, int count, double most, double sharper,
                          struct run *run)
{
    enum { STEPS = 8, CUTS = 9 };
    const double golden = 0.6180339887;
    double low = 0, high = most, least = DBL_MAX;
    for (int k = 0; k <= STEPS; k++) {
        double at = most * k * k / (STEPS * STEPS), m = misfit(piece, count, at, sharper, run);
        if (m < least) {
            least = m;
            low = most * (k > 0 ? (k - 1.0) * (k - 1) : 0) / (STEPS * STEPS);
            high = fmin(most * (k + 1.0) * (k + 1) / (STEPS * STEPS), most);
        }
    }
    double a = high - golden * (high - low), b = low + golden * (high - low);
    double at_a = misfit(piece, count, a, sharper, run),
           at_b = misfit(piece, count, b, sharper, run);
    for (int k = 0; k < CUTS; k++) {
        if (at_a < at_b) {
            high = b;
            b = a;
            at_b = at_a;
            a = high - golden * (high - low);
            at_a = misfit(piece, count, a, sharper, run);
        } else {
            low = a;
            a = b;
            at_a = at_b;
            b = low + golden * (high - low);
            at_b = misfit(piece, count, b, sharper, run);
        }
    }
    return 0.5 * (low + high);
}

double shadow_size(struct shadow_piece *piece, int count, double most, struct run *run,
                   double *sigma)
{
    *sigma = 0;
    if (count < TIES_MIN)
        return 0;
    count = count > SIZE_PIECES ? SIZE_PIECES : count;
    const double radius = best_radius(piece, count, most, 1, run), step = 0.1 * radius;
    const double least = misfit(piece, count, radius, 1, run);
    const double none = misfit(piece, count, 0, 1, run);
    if (radius > 0.95 * most || none - least < SIGNIFICANT * SIGNIFICANT)
        return 0;
    double bend = (misfit(piece, count, radius + step, 1, run)
                   + misfit(piece, count, radius - step, 1, run) - 2 * least)
                  / (step * step);
    double softer = best_radius(piece, count, most, 1 + BLUR_UNSURE, run);
    *sigma =
        bend > 0 ? hypot(sqrt(2 / bend), hypot(softer - radius, LIMB_BENDS * radius)) : INFINITY;
    if (radius > SIGNIFICANT * *sigma)
        return radius;
    *sigma = 0;
    return 0;
}

/* ---- all lamps ------------------------------------------------------------------------------- */

/** The pieces of a lamp's views that hold an edge, fitted for its size. */
static enum status gather(struct shadow_piece *piece, int *count, const struct calibration *c,
                          int l, const struct capture *capture, const struct board_plane *plane,
                          const char *out, struct error *err)
{
    int views = 0, tried = 0, found = 0;
    for (int v = 0; v < c->views; v++)
        views += c->view[v].light == l;
    // Views spread evenly over all, so that few of them give all directions.
    const int stride = 1 + views * AROUND / (8 * PIECES);
    for (int v = 0; v < c->views; v++) {
        struct radiance map = {0};
        if (c->view[v].light != l || tried++ % stride)
            continue;
        enum status status = cal_view_map(&map, out, &c->view[v], err);
        if (status)
            return status;
        int end = shadow_pieces(piece, found, PIECES, AROUND, &map, c, v, capture, plane);
        cap_radiance_free(&map);
        for (int i = found; i < end; i++)
            if (isfinite(shadow_edge_fit(&piece[i], c->lamp[l].radius, 1)))
                piece[found++] = piece[i];
    }
    *count = found;
    return STATUS_OK;
}

/** A radius that blurs to a quarter of what is looked at. */
static double largest_size(const struct shadow_piece *piece, int count, double radius)
{
    double spread = 0;
    for (int i = 0; i < count; i++)
        spread += piece[i].spread / count;
    return spread > 0 ? 0.12 * radius / spread : 0;
}

static enum status one_lamp(struct calibration *c, int l, struct shadow_piece *piece,
                            const struct capture *capture, const struct board_plane *plane,
                            const char *out, struct run *run, struct error *err)
{
    struct lamp *lamp = &c->lamp[l];
    int count = 0;
    enum status status = gather(piece, &count, c, l, capture, plane, out, err);
    if (!status && lamp->radius == 0 && !lamp->at_infinity) {
        double most = largest_size(piece, count, c->sample.radius);
        lamp->radius = shadow_size(piece, count, most, run, &lamp->sigma_radius);
    }
    int kept = 0;
    for (int i = 0; i < count; i++)
        if (piece[i].spread * lamp->radius < COVERED * c->sample.radius
            && isfinite(shadow_edge_fit(&piece[i], lamp->radius, 1)))
            piece[kept++] = piece[i];
    count = kept;
    return status ? status
                  : shadow_cue(&lamp->cue[CUE_SHADOW], c, l, piece, count, plane->normal, err);
}

enum status cal_shadow_cues(struct calibration *c, const struct capture *capture, const char *out,
                            struct run *run, struct error *err)
{
    struct board_plane plane;
    if (c->sample.shape != SHAPE_SPHERE || !shadow_board(&plane, capture))
        return STATUS_OK;
    struct shadow_piece *piece = calloc(PIECES, sizeof *piece);
    enum status status = piece ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "the edges of shadows");
    for (int l = 0; l < c->lamps && !status; l++)
        status = one_lamp(c, l, piece, capture, &plane, out, run, err);
    free(piece);
    return status;
}
