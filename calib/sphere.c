/* sphere.c -- a sphere placed by its outline in all photographs.
 *
 * Method.   A ray r (unit, from eye e) on the outline of a sphere touches it:
 *
 *               angle(r, c - e) = asin(R / |c - e|)
 *
 *           The residual is the difference of the two angles in pixels. Gauss-Newton on c and R,
 *           reweighted by Tukey's biweight: what is no outline (terminator, stand, cast shadow)
 *           falls outside it.
 * Accuracy. The covariance is the sandwich over views, H^-1 (sum_v g_v g_v^T) H^-1: the edges of
 *           one view share the errors of its pose, so views are what is independent. The model's
 *           own bias, which all views share, is added, and what a mirror-like sphere over a lit
 *           board shows at its rim.
 */
#include "sphere.h"
#include "dense.h"
#include "view_scatter.h"
#include "dusk.h"
#include "limb.h"
#include "shape_check.h"
#include "view_map.h"

#include <assert.h>
#include <float.h>
#include <stdlib.h>
#include <string.h>

enum { UNKNOWNS = 4, EDGES_MIN = 12, ROUNDS = 30 };  // UNKNOWNS: x, y, z, R
static const double BIWEIGHT = 4.685;  // Tukey's constant: 95 % efficient for normal errors
static const double MODEL_PX = 0.012;  // bias of the limb model: ../shared/facts.md has 0.009 mm
static const double ARCS = 8;          // of an outline: on each, what is mirrored is alike
static const double TRUSTED = 0.01;    // a radius known to this, relative, needs no fit at first
static const double MISTAKEN = 0.04;   // how wrong, relative, it may be where no outline fits it

/** An edge as the fit sees it. */
struct tangent {
    vec3 eye, ray;  // in the world
    double px;      // pixels a radian: the focal length
    double sigma_px;
    int view;
};

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/** Residual in pixels, positive outside, and its derivatives by x, y, z, R. */
static double tangent_residual(const struct tangent *t, vec3 center, double radius,
                               double derivative[UNKNOWNS])
{
    vec3 to = vec3_sub(center, t->eye);
    double distance = vec3_length(to), sine = fmin(radius / distance, 0.999);
    vec3 a = vec3_scale(to, 1 / distance);
    double along = vec3_dot(t->ray, a);
    vec3 across = vec3_sub(t->ray, vec3_scale(a, along));
    double off = vec3_length(across), cosine = sqrt(1 - sine * sine);
    // d angle / dc = -across/|across| / distance,  d asin(R/D) / dc = -(R/D^2) a / cosine
    vec3 g = vec3_add(vec3_scale(across, -1 / (off * distance)),
                      vec3_scale(a, sine / (distance * cosine)));
    derivative[0] = t->px * g.x;
    derivative[1] = t->px * g.y;
    derivative[2] = t->px * g.z;
    derivative[3] = -t->px / (distance * cosine);
    return t->px * (atan2(off, along) - asin(sine));
}

/** Invert the symmetric positive a in place; false: it is singular. */
static bool invert(double a[UNKNOWNS][UNKNOWNS])
{
    double l[UNKNOWNS * UNKNOWNS];
    memcpy(l, a, sizeof l);
    if (!dense_cholesky(UNKNOWNS, l))
        return false;
    dense_inverse(UNKNOWNS, l, &a[0][0]);
    return true;
}

/** 1.4826 x median |residual / sigma|: the robust scale of the edges' errors. */
static double robust_scale(const struct tangent *t, int count, vec3 center, double radius,
                           double *work)
{
    double unused[UNKNOWNS];
    for (int i = 0; i < count; i++)
        work[i] = fabs(tangent_residual(&t[i], center, radius, unused)) / t[i].sigma_px;
    qsort(work, (size_t)count, sizeof *work, by_value);
    return 1.4826 * work[count / 2];
}

static double biweight(double z)
{
    double u = 1 - z * z / (BIWEIGHT * BIWEIGHT);
    return u > 0 ? u * u : 0;
}

/** Normal equations at the current place: h and g over all edges, and g of each view apart. */
static void accumulate(double h[UNKNOWNS][UNKNOWNS], double (*view_g)[UNKNOWNS], int views,
                       const struct tangent *t, int count, vec3 center, double radius, double scale)
{
    memset(h, 0, sizeof(double[UNKNOWNS][UNKNOWNS]));
    memset(view_g, 0, (size_t)views * sizeof *view_g);
    for (int i = 0; i < count; i++) {
        double d[UNKNOWNS], r = tangent_residual(&t[i], center, radius, d);
        double w = biweight(r / (t[i].sigma_px * scale)) / (t[i].sigma_px * t[i].sigma_px);
        for (int a = 0; a < UNKNOWNS; a++) {
            for (int b = 0; b < UNKNOWNS; b++)
                h[a][b] += w * d[a] * d[b];
            view_g[t[i].view][a] += w * d[a] * r;
        }
    }
}

/** Add the prior on the radius. */
static void add_prior(double h[UNKNOWNS][UNKNOWNS], double g[UNKNOWNS], double radius,
                      double nominal, double sigma)
{
    if (sigma > 0) {
        h[3][3] += 1 / (sigma * sigma);
        g[3] += (radius - nominal) / (sigma * sigma);
    } else {
        for (int a = 0; a < UNKNOWNS; a++)
            h[3][a] = h[a][3] = 0;
        h[3][3] = 1;
        g[3] = 0;
    }
}

/** What all views share does not show in their scatter, in millimetres: the limb model's own bias,
 *  and where edges scatter by `scale` times what their noise allows, what the sample mirrors there.
 *  That is alike for all edges on one of ARCS parts of the outline, seen from anywhere. */
static void add_model_error(double sigma[UNKNOWNS], const struct tangent *t, int count, vec3 center,
                            double scale)
{
    double mm_per_px = 0, noise = 0;
    for (int i = 0; i < count; i++) {
        mm_per_px += vec3_length(vec3_sub(center, t[i].eye)) / t[i].px / count;
        noise += t[i].sigma_px / count;
    }
    double strays = noise * sqrt(fmax(scale * scale - 1, 0) / ARCS);
    for (int a = 0; a < UNKNOWNS; a++)
        sigma[a] = hypot(sigma[a], hypot(MODEL_PX, strays) * mm_per_px);
}

static int make_tangents(struct tangent *t, const struct calibration *c, const struct edge *edge,
                         int count)
{
    for (int i = 0; i < count; i++) {
        const struct view *view = &c->view[edge[i].view];
        const struct camera *camera = &c->camera[view->camera];
        mat3 r = cal_rotation(view->view_from_world.rotation);
        t[i] = (struct tangent){
            .eye = cal_eye(view->view_from_world),
            .ray = mat3_mul_t(&r, cal_ray(camera, edge[i].pixel)),
            .px = 0.5 * (camera->focal[0] + camera->focal[1]),
            .sigma_px = hypot(edge[i].sigma_px, 0.01),  // no edge is better than that
            .view = edge[i].view,
        };
    }
    return count;
}

static void measure_outline(struct sample *s, const struct tangent *t, int count, double scale)
{
    double sum = 0, unused[UNKNOWNS];
    s->outline_edges = 0;
    for (int i = 0; i < count; i++) {
        double r = tangent_residual(&t[i], s->center, s->radius, unused);
        if (biweight(r / (t[i].sigma_px * scale)) > 0) {
            sum += r * r;
            s->outline_edges++;
        }
    }
    s->outline_rms_px = s->outline_edges ? sqrt(sum / s->outline_edges) : 0;
}

enum status cal_sphere_fit(struct sample *sample, const struct calibration *calibration,
                           const struct edge *edge, int count, struct error *err)
{
    if (count < EDGES_MIN)
        return cap_fail(err, STATUS_DATA, "only %d edges of the sample's outline were found",
                        count);
    enum status status = STATUS_OK;
    struct sample s = *sample;
    struct tangent *t = calloc((size_t)count, sizeof *t);
    double *work = calloc((size_t)count, sizeof *work);
    double(*view_g)[UNKNOWNS] = calloc((size_t)calibration->views, sizeof *view_g);
    double h[UNKNOWNS][UNKNOWNS], scale = 1, moved = DBL_MAX;
    if (!t || !work || !view_g) {
        status = cap_fail(err, STATUS_MEMORY, "%d edges", count);
        goto done;
    }
    make_tangents(t, calibration, edge, count);
    for (int round = 0; round < ROUNDS && moved > 1e-9; round++) {
        double g[UNKNOWNS] = {0}, step[UNKNOWNS] = {0};
        scale = fmax(robust_scale(t, count, s.center, s.radius, work), 0.5);
        accumulate(h, view_g, calibration->views, t, count, s.center, s.radius, scale);
        for (int v = 0; v < calibration->views; v++)
            for (int a = 0; a < UNKNOWNS; a++)
                g[a] += view_g[v][a];
        add_prior(h, g, s.radius, sample->radius, sample->sigma_radius);
        if (!invert(h)) {
            status = cap_fail(err, STATUS_DATA, "the outlines do not determine the sample's place");
            goto done;
        }
        for (int a = 0; a < UNKNOWNS; a++)
            for (int b = 0; b < UNKNOWNS; b++)
                step[a] -= h[a][b] * g[b];
        s.center = vec3_add(s.center, (vec3){step[0], step[1], step[2]});
        s.radius += step[3];
        moved = fabs(step[0]) + fabs(step[1]) + fabs(step[2]) + fabs(step[3]);
    }
    double sigma[UNKNOWNS];
    cal_view_scatter(sigma, &h[0][0], &view_g[0][0], UNKNOWNS, calibration->views);
    add_model_error(sigma, t, count, s.center, scale);
    memcpy(s.sigma_center, sigma, sizeof s.sigma_center);
    s.sigma_radius = sample->sigma_radius > 0 ? sigma[3] : 0;
    measure_outline(&s, t, count, scale);
    *sample = s;
done:
    free(t);
    free(work);
    free(view_g);
    return status;
}

/** Copy the edges that are the sphere's, not where light ends. -> how many. */
static int leave_dusk(struct edge *kept, const struct edge *edge, int count,
                      const struct calibration *c)
{
    int n = 0;
    for (int i = 0; i < count; i++) {
        const struct view *view = &c->view[edge[i].view];
        const struct camera *camera = &c->camera[view->camera];
        mat3 r = cal_rotation(view->view_from_world.rotation);
        vec3 eye = cal_eye(view->view_from_world),
             ray = mat3_mul_t(&r, cal_ray(camera, edge[i].pixel));
        double way = vec3_dot(vec3_sub(c->sample.center, eye), ray);
        vec3 touch = vec3_add(eye, vec3_scale(ray, way));
        vec3 normal = vec3_normalize(vec3_sub(touch, c->sample.center));
        if (!cal_dusk_at_limb(c, edge[i].view, touch, normal,
                              camera->focal[0] * c->sample.radius / way))
            kept[n++] = edge[i];
    }
    return n;
}

/** All edges of all views about sample->center; each view's edges stand together, in order. */
static enum status find_edges(struct edge **edges, int *count, const struct calibration *c,
                              const char *out, double search, bool fine, struct run *run,
                              struct error *err)
{
    struct edge **of_view = calloc((size_t)c->views, sizeof *of_view);
    int *found = calloc((size_t)c->views, sizeof *found);
    enum status status = STATUS_OK;
    if (!of_view || !found)
        status = cap_fail(err, STATUS_MEMORY, "%d views", c->views);
#pragma omp parallel for schedule(dynamic) num_threads(run->threads) if (!status)
    for (int v = 0; v < c->views; v++) {
        if (status)
            continue;
        struct error own = {0};
        struct radiance map = {0};
        enum status s = cal_view_map(&map, out, &c->view[v], &own);
        if (!s)
            s = cal_outline_edges(&of_view[v], &found[v], &map, &c->camera[c->view[v].camera],
                                  &c->view[v], v, c->sample.center, c->sample.radius, search, fine,
                                  &own);
        cap_radiance_free(&map);
        if (s) {
#pragma omp critical(sphere_error)
            if (!status)
                status = cap_fail(err, s, "%s", own.text);
        }
    }
    int total = 0;
    for (int v = 0; found && v < c->views; v++)
        total += found[v];
    *count = 0;
    *edges = status ? NULL : calloc((size_t)total + 1, sizeof **edges);
    if (!status && !*edges)
        status = cap_fail(err, STATUS_MEMORY, "%d edges", total);
    for (int v = 0; of_view && v < c->views; v++) {
        if (!status && found[v])
            memcpy(*edges + *count, of_view[v], (size_t)found[v] * sizeof **edges);
        *count += status ? 0 : found[v];
        free(of_view[v]);
    }
    free(of_view);
    free(found);
    return status;
}

/** Pixels a millimetre at the sample. */
static double pixels_per_mm(const struct calibration *c)
{
    const struct view *view = &c->view[0];
    vec3 eye = cal_eye(view->view_from_world);
    return c->camera[view->camera].focal[0] / vec3_length(vec3_sub(c->sample.center, eye));
}

/** The sphere that fits the edges, which are its own (fine) or nearly so. radius_sigma: of the
 *  nominal radius; 0 holds it. */
static enum status fit_edges(struct calibration *c, const struct sample_place *nominal,
                             const struct edge *edge, int count, bool fine, double radius_sigma,
                             struct error *err)
{
    struct sample *s = &c->sample;
    struct edge *kept = malloc(((size_t)count + 1) * sizeof *kept);
    if (!kept)
        return cap_fail(err, STATUS_MEMORY, "%d edges", count);
    int left = fine ? leave_dusk(kept, edge, count, c) : count;
    s->radius = nominal->radius;
    s->sigma_radius = radius_sigma;
    enum status status = cal_sphere_fit(s, c, fine ? kept : edge, left, err);
    free(kept);
    return status ? cap_fail_within(err, "the sphere's outline") : STATUS_OK;
}

/** Edges within `search` pixels, and the sphere that fits them. *moved: by how many pixels. The
 *  caller owns *edges. */
static enum status pass(double *moved, struct edge **edges, int *count, struct calibration *c,
                        const struct sample_place *nominal, const char *out, double search,
                        bool fine, double radius_sigma, struct run *run, struct error *err)
{
    struct sample *s = &c->sample;
    const struct sample before = *s;
    *edges = NULL;
    enum status status = find_edges(edges, count, c, out, search, fine, run, err);
    if (!status)
        status = fit_edges(c, nominal, *edges, *count, fine, radius_sigma, err);
    *moved = pixels_per_mm(c)
             * (vec3_length(vec3_sub(s->center, before.center)) + fabs(s->radius - before.radius));
    return status;
}

/** A coarse pass. *stray: what its edges scatter by, a part of the search. */
static enum status coarse_pass(double *stray, double *moved, struct calibration *c,
                               const struct sample_place *nominal, const char *out, double search,
                               double radius_sigma, struct run *run, struct error *err)
{
    struct edge *edges;
    int count;
    enum status status =
        pass(moved, &edges, &count, c, nominal, out, search, false, radius_sigma, run, err);
    *stray = status ? INFINITY : c->sample.outline_rms_px / search;
    free(edges);
    return status;
}

enum status cal_sphere_start(bool *sure, struct calibration *c, const struct capture *capture,
                             const char *out, struct run *run, struct error *err)
{
    const struct sample_place *nominal = &capture->sample;
    assert(c->sample.shape == SHAPE_SPHERE);
    // How far the nominal place may be wrong: a seventh of the radius, or what that may be wrong.
    const double px = pixels_per_mm(c), radius = nominal->radius, given = nominal->radius_sigma;
    const double search[] = {fmax(px * fmax(0.15 * radius, 2.5 * given), 8), 5, 5};
    const double sigma = given > TRUSTED * radius ? given : 0;
    double moved = DBL_MAX, stray = INFINITY;
    enum status status = STATUS_OK;
    for (int k = 0; k < 3 && moved >= 1.5 && !status; k++)
        status = coarse_pass(&stray, &moved, c, nominal, out, search[k], sigma, run, err);
    if (!status && stray >= STRAYING) {  // with another radius, perhaps
        const struct sample before = c->sample;
        const double least = 0.5 * stray;  // a little better is what freedom does to anything
        status = coarse_pass(&stray, &moved, c, nominal, out, fmax(px * 2 * MISTAKEN * radius, 5),
                             fmax(given, MISTAKEN * radius), run, err);
        if (!status && stray >= least) {
            c->sample = before;
            stray = INFINITY;
        }
    }
    *sure = !status && stray < STRAYING;
    return status;
}

enum status cal_sphere_check(const struct calibration *c, const struct edge *edge, int count,
                             struct run *run, struct error *err)
{
    const struct sample *s = &c->sample;
    struct edge *kept = calloc((size_t)count + 1, sizeof *kept);
    struct tangent *t = calloc((size_t)count + 1, sizeof *t);
    struct touch *touch = calloc((size_t)count + 1, sizeof *touch);
    enum status status =
        kept && t && touch ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%d edges", count);
    int left = status ? 0 : leave_dusk(kept, edge, count, c);
    if (!status)
        make_tangents(t, c, kept, left);
    for (int i = 0; i < left; i++) {
        double way = vec3_dot(vec3_sub(s->center, t[i].eye), t[i].ray);
        vec3 near = vec3_add(t[i].eye, vec3_scale(t[i].ray, way));
        vec3 arm = vec3_sub(near, s->center);
        touch[i] = (struct touch){.arm = arm,
                                  .normal = vec3_normalize(arm),
                                  .off = vec3_length(arm) - s->radius,
                                  .sigma = t[i].sigma_px * way / t[i].px,
                                  .px_per_mm = t[i].px / way,
                                  .view = t[i].view};
    }
    if (!status)
        status = cal_shape_warn(s, touch, left, c->views, run, err);
    free(kept);
    free(t);
    free(touch);
    return status;
}

enum status cal_sphere_place(struct edge **edges, int *count, struct calibration *c,
                             const struct capture *capture, const char *out, struct run *run,
                             struct error *err)
{
    double moved = DBL_MAX;
    enum status status = STATUS_OK;
    *edges = NULL;
    *count = 0;
    // A pass that hardly moves the sphere needs no other after it.
    for (int k = 0; k < 3 && moved >= 0.25 && !status; k++) {
        free(*edges);
        status = pass(&moved, edges, count, c, &capture->sample, out, 2.5, true,
                      capture->sample.radius_sigma, run, err);
    }
    return status;
}

enum status cal_sphere_settle(bool *moved, struct calibration *c, const struct sample *placed,
                              const struct capture *capture, const struct edge *edges, int count,
                              struct error *err)
{
    struct calibration again = *c;
    again.sample = *placed;
    enum status status =
        fit_edges(&again, &capture->sample, edges, count, true, capture->sample.radius_sigma, err);
    const vec3 by = vec3_sub(again.sample.center, placed->center);
    const double step[3] = {by.x, by.y, by.z};
    *moved = false;
    for (int a = 0; a < 3 && !status; a++)
        *moved = *moved || fabs(step[a]) > placed->sigma_center[a];
    if (*moved)
        c->sample = again.sample;
    return status;
}
