/* seek.c -- the sample looked for where nobody said that it is.
 *
 * Method.   What the sample's outline touches, seen from each view's eye, is found once (contour.c)
 *           and then carried along, stiff: to a place elsewhere it is off by the change of the
 *           viewing direction squared, a fiftieth of the sample's size at worst, and it is found
 *           again where the search has come to. A place is as good as the part of the outlines at
 *           which photographs show an edge that runs their way (slopes.c). Tags and shadows show
 *           such edges too, but not all around an outline, in all views, at one place.
 *
 *           All places of a lattice, a sixth of the sample apart, are looked at in a few views; the
 *           best of them in all views; from the best of these the lattice is refined.
 */
#include "seek.h"

#include "contour.h"
#include "slopes.h"
#include "view_map.h"

#include <stdlib.h>
#include <string.h>

enum {
    RIM = 36,           // places on an outline
    VIEWS_MAX = 12,     // more tell no more
    FIRST = 4,          // views that choose the places worth a look in all
    SIDE = 41,          // places of the lattice, half of it, each way
    WORTH = 3000,       // places looked at in all views
    RADIUS_BLOCKS = 16  // of the sample, in blocks of the reduced photographs
};
static const double STEP = 1.0 / 6;    // of the sample's reach: edges are felt from that far
static const double FINEST = 1.0 / 8;  // of such a step
static const double TURN_STEP = 0.08;  // rad: as far at the sample's end as a step is
static const double APART = 0.5;       // reaches between places that are two
static const double OUTSIDE = 0.15;    // what an edge outside of the image counts: as by chance

/** Where the sample's outline touches it: from its centre, and outwards. */
struct rim {
    vec3 arm, across;
};
struct seek_view {
    const struct view *view;
    const struct camera *camera;
    mat3 rotation;
    struct slopes slopes;
};
struct seek {
    struct seek_view view[VIEWS_MAX];
    int views;
};
/** The outlines of all views. */
struct rims {
    struct rim rim[VIEWS_MAX][RIM];
    int count[VIEWS_MAX];
};
/* ---- outlines -------------------------------------------------------------------------------- */

/** A camera without a lens at a view's eye that looks at the sample. */
static bool looking_at(struct camera *camera, struct view *view, const struct seek_view *from,
                       const struct sample *sample)
{
    enum { HALF = 120 };  // pixels
    vec3 eye = cal_eye(from->view->view_from_world), to = vec3_sub(sample->center, eye);
    const double distance = vec3_length(to), reach = cal_solid_reach(sample);
    if (distance < 1.5 * reach)
        return false;
    vec3 z = vec3_scale(to, 1 / distance);
    vec3 x = vec3_normalize(vec3_cross(fabs(z.y) < 0.8 ? (vec3){0, 1, 0} : (vec3){1, 0, 0}, z));
    vec3 y = vec3_cross(z, x);
    mat3 r = {{{x.x, x.y, x.z}, {y.x, y.y, y.z}, {z.x, z.y, z.z}}};
    vec3 moved = mat3_mul(&r, eye);
    const double focal = HALF * (distance - reach) / reach;
    *camera = (struct camera){.width = 3 * HALF,
                              .height = 3 * HALF,
                              .focal = {focal, focal},
                              .center = {1.5 * HALF, 1.5 * HALF}};
    *view = (struct view){.name = from->view->name,
                          .view_from_world = {cal_rotation_vector(&r), vec3_scale(moved, -1)}};
    return true;
}

static enum status find_rims(struct rims *rims, const struct seek *s, const struct sample *sample,
                             struct error *err)
{
    enum status status = STATUS_OK;
    memset(rims, 0, sizeof *rims);
    for (int v = 0; v < s->views && !status; v++) {
        struct camera camera;
        struct view view;
        struct contour_point *point = NULL;
        int count = 0;
        if (looking_at(&camera, &view, &s->view[v], sample))
            status = cal_contour(&point, &count, sample, &camera, &view, err);
        const int wanted = count < RIM ? count : RIM;
        for (int k = 0; k < wanted; k++) {
            const struct contour_point *p = &point[(long)k * count / wanted];
            rims->rim[v][k] = (struct rim){vec3_sub(p->point, sample->center), p->across};
        }
        rims->count[v] = wanted;
        free(point);
    }
    return status;
}

/* ---- how good a place is --------------------------------------------------------------------- */

/** The part of one view's outline that is an edge. turn: NULL for none. */
static double view_score(const struct seek_view *v, const struct rim *rim, int count,
                         const mat3 *turn, vec3 center)
{
    vec3 at = cal_to_view(v->view->view_from_world, center);
    double sum = 0, pixel[2];
    if (count == 0 || at.z <= 0)
        return 0;
    for (int k = 0; k < count; k++) {
        vec3 arm = turn ? mat3_mul(turn, rim[k].arm) : rim[k].arm;
        vec3 across = turn ? mat3_mul(turn, rim[k].across) : rim[k].across;
        vec3 p = vec3_add(at, mat3_mul(&v->rotation, arm)), n = mat3_mul(&v->rotation, across);
        if (p.z <= 0)
            return 0;
        cal_project(v->camera, p, pixel);
        // The plane through eye and outline has n as its normal: its image's is (n.x, n.y), but for
        // what the lens bends it.
        const double length = hypot(n.x, n.y), normal[2] = {n.x / length, n.y / length};
        double edge = cal_slopes_edge(&v->slopes, pixel, normal);
        sum += edge < 0 ? OUTSIDE : edge;
    }
    return sum / count;
}

static double place_score(const struct seek *s, const struct rims *rims, int stride,
                          const vec3 *turn, vec3 center)
{
    mat3 r;
    double sum = 0;
    int views = 0;
    if (turn)
        r = cal_rotation(*turn);
    for (int v = 0; v < s->views; v += stride, views++)
        sum += view_score(&s->view[v], rims->rim[v], rims->count[v], turn ? &r : NULL, center);
    return sum / views;
}

/* ---- the search ------------------------------------------------------------------------------ */

static int better_first(const void *a, const void *b)
{
    const struct place *x = a, *y = b;
    if (x->score != y->score)
        return x->score < y->score ? 1 : -1;
    return (x->index > y->index) - (x->index < y->index);
}

/** Where to look. */
struct region {
    vec3 center;
    double step, lowest;  // of the lattice; of the sample's height
    int side;             // steps each way
};

static vec3 lattice_shift(int index, const struct region *region)
{
    const int side = region->side, n = 2 * side + 1;
    const double step = region->step;
    return (vec3){(index % n - side) * step, (index / n % n - side) * step,
                  (index / n / n - side) * step};
}

static double region_score(const struct seek *s, const struct rims *rims,
                           const struct region *region, int stride, vec3 shift)
{
    vec3 at = vec3_add(region->center, shift);
    return at.z < region->lowest ? 0 : place_score(s, rims, stride, NULL, at);
}

/** The best places of the lattice, in all views: the first *count of place[WORTH]. */
static enum status look_everywhere(struct place *place, int *count, const struct seek *s,
                                   const struct rims *rims, const struct region *region,
                                   struct run *run, struct error *err)
{
    const int n = 2 * region->side + 1, all = n * n * n;
    const int stride = s->views > FIRST ? s->views / FIRST : 1;
    struct place *each = calloc((size_t)all, sizeof *each);
    if (!each)
        return cap_fail(err, STATUS_MEMORY, "%d places of the sample", all);
#pragma omp parallel for schedule(static) num_threads(run->threads)
    for (int i = 0; i < all; i++) {
        each[i] = (struct place){.shift = lattice_shift(i, region), .index = i};
        each[i].score = region_score(s, rims, region, stride, each[i].shift);
    }
    qsort(each, (size_t)all, sizeof *each, better_first);
    *count = all < WORTH ? all : WORTH;
#pragma omp parallel for schedule(static) num_threads(run->threads)
    for (int i = 0; i < *count; i++) {
        place[i] = each[i];
        place[i].score = region_score(s, rims, region, 1, place[i].shift);
    }
    qsort(place, (size_t)*count, sizeof *place, better_first);
    free(each);
    return STATUS_OK;
}

/** Of places, best first, those that are not beside a better one. -> how many. */
static int tell_apart(struct place *place, int count, double apart, int wanted)
{
    int kept = 0;
    for (int i = 0; i < count && kept < wanted; i++) {
        bool beside = false;
        for (int k = 0; k < kept; k++)
            beside = beside || vec3_length(vec3_sub(place[i].shift, place[k].shift)) < apart;
        if (!beside)
            place[kept++] = place[i];
    }
    return kept;
}

static struct place moved(const struct place *p, int axis, double by, double turn)
{
    struct place q = *p;
    double *part[6] = {&q.shift.x, &q.shift.y, &q.shift.z, &q.turn.x, &q.turn.y, &q.turn.z};
    *part[axis] += axis < 3 ? by : turn;
    return q;
}

/** Climb from a place, by ever smaller steps, along each of `axes` axes (3, or 6 with turns). */
static void climb(struct place *p, const struct seek *s, const struct rims *rims,
                  const struct region *region, int axes)
{
    const double finest = FINEST * region->step;
    double step = 0.5 * region->step, turn = TURN_STEP;
    for (int rounds = 0; step >= finest && rounds < 100; rounds++) {
        struct place best = *p;
        for (int k = 0; k < 2 * axes; k++) {
            int sign = k % 2 ? 1 : -1;
            struct place q = moved(p, k / 2, sign * step, sign * turn);
            vec3 at = vec3_add(region->center, q.shift);
            q.score =
                at.z < region->lowest ? 0 : place_score(s, rims, 1, axes > 3 ? &q.turn : NULL, at);
            if (q.score > best.score)
                best = q;
        }
        if (best.score > p->score) {
            *p = best;
        } else {
            step /= 2;
            turn /= 2;
        }
    }
}

enum status cal_seek_find(struct place *found, int *count, const struct seek *s,
                          const struct sample *sample, double extent, double lowest,
                          struct run *run, struct error *err)
{
    const double reach = cal_solid_reach(sample), step = STEP * reach;
    const int axes = sample->shape == SHAPE_SPHERE ? 3 : 6;
    const struct region region = {sample->center, step, lowest,
                                  (int)fmin(ceil(extent / step), SIDE)};
    struct place *place = calloc(WORTH, sizeof *place);
    struct rims *rims = calloc(1, sizeof *rims);
    int worth = 0;
    enum status status =
        place && rims ? find_rims(rims, s, sample, err) : cap_fail(err, STATUS_MEMORY, "places");
    if (!status)
        status = look_everywhere(place, &worth, s, rims, &region, run, err);
    int starts = tell_apart(place, worth, APART * reach, PLACES);
#pragma omp parallel for schedule(dynamic) num_threads(run->threads)
    for (int k = 0; k < starts; k++)
        climb(&place[k], s, rims, &region, axes);
    if (!status) {
        qsort(place, (size_t)starts, sizeof *place, better_first);
        *count = tell_apart(place, starts, APART * reach, PLACES);
        for (int k = 0; k < *count; k++)
            found[k] = place[k];
    }
    free(place);
    free(rims);
    return status;
}

enum status cal_seek_score(double *score, const struct seek *s, const struct sample *sample,
                           struct error *err)
{
    struct rims *rims = calloc(1, sizeof *rims);
    enum status status =
        rims ? find_rims(rims, s, sample, err) : cap_fail(err, STATUS_MEMORY, "outlines");
    if (!status)
        *score = place_score(s, rims, 1, NULL, sample->center);
    free(rims);
    return status;
}

/* ---- photographs ----------------------------------------------------------------------------- */

/** Photosites of a block, so that the sample is RADIUS_BLOCKS large. */
static int block_of(const struct seek_view *v, const struct sample *sample)
{
    vec3 to = vec3_sub(sample->center, cal_eye(v->view->view_from_world));
    double px = v->camera->focal[0] * cal_solid_reach(sample) / vec3_length(to);
    return (int)fmax(px / RADIUS_BLOCKS, 1);
}

enum status cal_seek_begin(struct seek **seek, const struct calibration *c,
                           const struct sample *nominal, const char *out, struct run *run,
                           struct error *err)
{
    struct seek *s = calloc(1, sizeof *s);
    enum status status = s ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "the sample's place");
    const int views = status ? 0 : c->views < VIEWS_MAX ? c->views : VIEWS_MAX;
#pragma omp parallel for schedule(dynamic) num_threads(run->threads)
    for (int k = 0; k < views; k++) {
        struct seek_view *v = &s->view[k];
        struct radiance map = {0};
        struct error own = {0};
        v->view = &c->view[(long)k * c->views / views];
        v->camera = &c->camera[v->view->camera];
        v->rotation = cal_rotation(v->view->view_from_world.rotation);
        enum status bad = cal_view_map(&map, out, v->view, &own);
        if (!bad)
            bad = cal_slopes_make(&v->slopes, &map, block_of(v, nominal), &own);
        cap_radiance_free(&map);
        if (bad) {
#pragma omp critical(seek_error)
            status = cap_fail(err, bad, "%s", own.text);
        }
    }
    if (status) {
        cal_seek_end(s);
        return status;
    }
    s->views = views;
    *seek = s;
    return STATUS_OK;
}

void cal_seek_end(struct seek *s)
{
    for (int k = 0; s && k < VIEWS_MAX; k++)
        cal_slopes_free(&s->view[k].slopes);
    free(s);
}
