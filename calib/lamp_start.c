/* lamp_start.c -- a first place for a lamp, from nothing but the light on the board.
 *
 * Method.   For a lamp at P, radiance over cos/r^2 is one number for each view and material. The
 *           scatter of its logarithm about the medians of views and materials, cut off at CUT
 *           (facets in shadow), is compared over a grid of directions and distances. From the best
 *           place at each height it goes on downhill.
 */
#include "lamp.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

enum { AZIMUTHS = 24, HEIGHTS = 8, DISTANCES = 6, ROUNDS = 2, FACETS_MAX = 1200, HALVINGS = 5 };
static const double CUT = 0.15;
static const double FARTHEST = 4, NEAREST = 0.35;  // in distances from the board to the cameras

vec3 cal_lamp_frame(const struct lamp *lamp, pose view_from_world, vec3 point)
{
    return lamp->on_camera ? cal_to_view(view_from_world, point) : point;
}

vec3 cal_lamp_frame_direction(const struct lamp *lamp, pose view_from_world, vec3 direction)
{
    mat3 r = cal_rotation(view_from_world.rotation);
    return lamp->on_camera ? mat3_mul(&r, direction) : direction;
}

/** A facet in the lamp's frame. */
struct lit {
    vec3 point, normal;
    double log_value;
    int view, material;
};

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/** Take from `left` the median of each group (views, or materials). */
static void remove_medians(double *left, const struct lit *lit, int count, bool of_views,
                           int groups, double *work)
{
    for (int g = 0; g < groups; g++) {
        int n = 0;
        for (int i = 0; i < count; i++)
            if ((of_views ? lit[i].view : lit[i].material) == g && left[i] < DBL_MAX)
                work[n++] = left[i];
        if (n == 0)
            continue;
        qsort(work, (size_t)n, sizeof *work, by_value);
        for (int i = 0; i < count; i++)
            if ((of_views ? lit[i].view : lit[i].material) == g && left[i] < DBL_MAX)
                left[i] -= work[n / 2];
    }
}

/** The cut-off scatter for a lamp at p. work has room for 2 x count. */
static double scatter(const struct lit *lit, int count, int views, int materials, vec3 p,
                      double *work)
{
    double *left = work + count, sum = 0;
    for (int i = 0; i < count; i++) {
        vec3 to = vec3_sub(p, lit[i].point);
        double r2 = vec3_dot(to, to), cosine = vec3_dot(to, lit[i].normal);
        left[i] = cosine > 0 ? lit[i].log_value - log(cosine / (r2 * sqrt(r2))) : DBL_MAX;
    }
    for (int round = 0; round < ROUNDS; round++) {
        remove_medians(left, lit, count, true, views, work);
        remove_medians(left, lit, count, false, materials, work);
    }
    for (int i = 0; i < count; i++)
        sum += left[i] == DBL_MAX ? 4 * CUT * CUT : fmin(left[i] * left[i], CUT * CUT);
    return sum;
}

/** The facets of the lamp's views, in its frame, thinned to FACETS_MAX. */
static int gather(struct lit *lit, const struct calibration *c, int l, const struct facets *board)
{
    int mine = 0, count = 0, seen = 0;
    for (int i = 0; i < board->count; i++)
        mine += c->view[board->facet[i].view].light == l;
    int step = 1 + mine / FACETS_MAX;
    for (int i = 0; i < board->count; i++) {
        const struct facet *f = &board->facet[i];
        const struct view *view = &c->view[f->view];
        if (view->light != l || seen++ % step)
            continue;
        lit[count++] = (struct lit){
            cal_lamp_frame(&c->lamp[l], view->view_from_world, f->point),
            cal_lamp_frame_direction(&c->lamp[l], view->view_from_world, f->normal),
            (f->log_value[0] + f->log_value[1] + f->log_value[2]) / 3, f->view, f->material};
    }
    return count;
}

/** Middle of the facets, and the mean distance of the lamp's cameras from it. */
static vec3 middle_of(const struct lit *lit, int count, const struct calibration *c, int l,
                      double *distance)
{
    vec3 middle = {0, 0, 0};
    for (int i = 0; i < count; i++)
        middle = vec3_add(middle, vec3_scale(lit[i].point, 1.0 / count));
    double sum = 0;
    int n = 0;
    for (int v = 0; v < c->views; v++)
        if (c->view[v].light == l) {
            vec3 eye = cal_eye(c->view[v].view_from_world);
            sum += vec3_length(
                vec3_sub(cal_lamp_frame(&c->lamp[l], c->view[v].view_from_world, eye), middle));
            n++;
        }
    *distance = n ? sum / n : 1000;
    return middle;
}

/** A place by its direction from the middle and its distance. */
struct polar {
    double azimuth, height, log_distance;  // rad; sine of the elevation; of distances of cameras
};

struct search {
    const struct lit *lit;
    int count, views, materials;
    double *work;
    vec3 middle;
    double distance;  // of the cameras
    bool down;        // the board faces +z of the world; seen from a camera it faces -z
};

static vec3 place_of(const struct search *s, const struct polar *at)
{
    double flat = sqrt(1 - at->height * at->height), r = s->distance * exp(at->log_distance);
    vec3 way = {flat * cos(at->azimuth), flat * sin(at->azimuth),
                s->down ? -at->height : at->height};
    return vec3_add(s->middle, vec3_scale(way, r));
}

static double scatter_at(const struct search *s, const struct polar *at)
{
    return scatter(s->lit, s->count, s->views, s->materials, place_of(s, at), s->work);
}

/** The best of the grid at one height; its scatter. */
static double best_at_height(const struct search *s, struct polar *best, int h)
{
    double least = DBL_MAX;
    for (int d = 0; d < DISTANCES; d++)
        for (int a = 0; a < AZIMUTHS; a++) {
            struct polar at = {2 * CAP_PI * a / AZIMUTHS, (h + 0.5) / HEIGHTS,
                               log(NEAREST) + d * log(FARTHEST / NEAREST) / (DISTANCES - 1)};
            double now = scatter_at(s, &at);
            if (now < least) {
                least = now;
                *best = at;
            }
        }
    return least;
}

static bool within(const struct polar *at)
{
    return at->height > 0.01 && at->height < 1 && at->log_distance > log(NEAREST)
           && at->log_distance < log(FARTHEST);
}

/** One step to either side along each coordinate, taken where it is better; the scatter there. */
static double explore(const struct search *s, struct polar *at, double least,
                      const struct polar *step)
{
    for (int k = 0; k < 6; k++) {
        struct polar next = *at;
        double sign = k % 2 ? -1 : 1;
        next.azimuth += k / 2 == 0 ? sign * step->azimuth : 0;
        next.height += k / 2 == 1 ? sign * step->height : 0;
        next.log_distance += k / 2 == 2 ? sign * step->log_distance : 0;
        double now = within(&next) ? scatter_at(s, &next) : DBL_MAX;
        if (now < least) {
            least = now;
            *at = next;
        }
    }
    return least;
}

/** Downhill from there, steps first half the grid's, and once more the way that a round of steps
 *  went (Hooke and Jeeves, "Direct Search", 1961): valleys lie aslant between direction and
 *  distance. */
static double refine(const struct search *s, struct polar *at, double least)
{
    struct polar step = {CAP_PI / AZIMUTHS, 0.5 / HEIGHTS,
                         0.5 * log(FARTHEST / NEAREST) / (DISTANCES - 1)};
    for (int halved = 0; halved < HALVINGS;) {
        struct polar before = *at;
        double now = explore(s, at, least, &step);
        bool better = now < least;
        least = now;
        while (better) {
            struct polar on = {2 * at->azimuth - before.azimuth, 2 * at->height - before.height,
                               2 * at->log_distance - before.log_distance};
            now = within(&on) ? explore(s, &on, scatter_at(s, &on), &step) : DBL_MAX;
            if (!(now < least))
                break;
            before = *at;
            *at = on;
            least = now;
        }
        if (!better) {
            step = (struct polar){step.azimuth / 2, step.height / 2, step.log_distance / 2};
            halved++;
        }
    }
    return least;
}

enum status cal_lamp_start(struct calibration *c, int l, const struct facets *board,
                           struct error *err)
{
    struct lit *lit = calloc((size_t)FACETS_MAX + 1, sizeof *lit);
    double *work = calloc(2 * (size_t)FACETS_MAX + 2, sizeof *work);
    enum status status = STATUS_OK;
    if (!lit || !work) {
        status = cap_fail(err, STATUS_MEMORY, "lamp %s", c->lamp[l].name);
        goto done;
    }
    int count = gather(lit, c, l, board), materials = 0;
    for (int i = 0; i < count; i++)
        materials = lit[i].material >= materials ? lit[i].material + 1 : materials;
    if (count < 8) {
        status = cap_fail(err, STATUS_DATA,
                          "lamp %s: its photographs show too little lit paper to tell where it is",
                          c->lamp[l].name);
        goto done;
    }
    struct search search = {.lit = lit, .count = count, .views = c->views, .work = work};
    search.materials = materials;
    search.middle = middle_of(lit, count, c, l, &search.distance);
    search.down = c->lamp[l].on_camera;
    double best = DBL_MAX;
    for (int h = 0; h < HEIGHTS; h++) {
        struct polar at = {0};
        double s = refine(&search, &at, best_at_height(&search, &at, h));
        if (s < best) {
            best = s;
            c->lamp[l].position = place_of(&search, &at);
        }
    }
done:
    free(lit);
    free(work);
    return status;
}
