/* plan.c -- which further shots would measure most of what is not measured yet.
 *
 * Method.   Cameras are tried all around the sample, at the distance of the shots that are there,
 *           under each lamp; with move_lamp, lamps all around too. A candidate must see tags enough
 *           for its pose, keep the lamp out of the picture and itself out of the lamp's way. What
 *           it would measure is traced (coverage.c) on some rows of the picture. The best is taken,
 *           then the best with it, ...: such a greedy choice reaches at least 1 - 1/e of what the
 *           best choice would (Nemhauser, Wolsey and Fisher 1978). What is promised of the chosen
 *           ones is traced on whole pictures.
 */
#include "plan.h"

#include "place.h"

#include <stdlib.h>
#include <string.h>

static const double DEG = CAP_PI / 180;

/** Where cameras and lamps are tried: rings of elevation, each with as many steps of azimuth. */
struct rings {
    double lowest_deg, highest_deg;
    int rings, steps;
};

/** Shots that might be made: views of a calibration that has the moved lamps too. Cameras, sample
 *  and names are borrowed from the rig. */
struct candidates {
    struct calibration calibration;
    vec3 *eye;               // [views]
    struct seen_bins *seen;  // [views]
    int lamps;               // of the rig; those behind are moved ones
    vec3 target;
    double distance;
};

static void free_candidates(struct candidates *c)
{
    for (int k = 0; c->seen && k < c->calibration.views; k++)
        rec_seen_free(&c->seen[k]);
    free(c->calibration.lamp);
    free(c->calibration.view);
    free(c->eye);
    free(c->seen);
}

/* ---- where cameras stood so far -------------------------------------------------------------- */

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// The median distance of the eyes, and the mean place that they look at: where the axis passes the
// sample.
static enum status habits(struct candidates *to, const struct calibration *c, struct error *err)
{
    double *distance = malloc(((size_t)c->views + 1) * sizeof *distance);
    if (!distance)
        return cap_fail(err, STATUS_MEMORY, "no memory for %d shots", c->views);
    vec3 sum = {0, 0, 0};
    for (int v = 0; v < c->views; v++) {
        mat3 r = cal_rotation(c->view[v].view_from_world.rotation);
        vec3 eye = cal_eye(c->view[v].view_from_world), axis = mat3_mul_t(&r, (vec3){0, 0, 1});
        vec3 way = vec3_sub(c->sample.center, eye);
        distance[v] = vec3_length(way);
        sum = vec3_add(sum, vec3_add(eye, vec3_scale(axis, vec3_dot(way, axis))));
    }
    qsort(distance, (size_t)c->views, sizeof *distance, compare_doubles);
    to->distance = distance[c->views / 2];
    to->target = vec3_scale(sum, 1.0 / c->views);
    free(distance);
    return STATUS_OK;
}

/* ---- what a candidate must be -----------------------------------------------------------------
 */

static bool in_picture(const struct camera *camera, pose view_from_world, vec3 point)
{
    vec3 p = cal_to_view(view_from_world, point);
    double at[2];
    if (p.z <= 0)
        return false;
    cal_project(camera, p, at);
    return at[0] > 0 && at[1] > 0 && at[0] < camera->width - 1 && at[1] < camera->height - 1;
}

// A tag that helps: whole in the picture, not too slanted (78 degrees), not behind the sample.
static bool tag_seen(const struct rig_tag *tag, const struct calibration *c, pose at, vec3 eye)
{
    const double slanted = 0.2;
    vec3 x = vec3_sub(tag->corner[1], tag->corner[0]), y = vec3_sub(tag->corner[3], tag->corner[0]);
    vec3 normal = vec3_normalize(vec3_cross(x, y));
    vec3 middle = vec3_scale(vec3_add(tag->corner[0], tag->corner[2]), 0.5);
    vec3 way = vec3_normalize(vec3_sub(eye, middle)),
         to_sample = vec3_sub(c->sample.center, middle);
    double along = vec3_dot(to_sample, way);
    double beside = vec3_length(vec3_sub(to_sample, vec3_scale(way, along)));
    bool hidden = along > 0 && beside < c->sample.radius + vec3_length(x);
    bool seen = vec3_dot(normal, way) > slanted && !hidden;
    for (int k = 0; k < 4 && seen; k++)
        seen = in_picture(&c->camera[0], at, tag->corner[k]);
    return seen;
}

// Four tags fix a pose well where they are spread; of a large board a quarter is asked for.
static bool pose_is_found(const struct rig *rig, pose at, vec3 eye)
{
    int seen = 0, wanted = rig->tags / 4 > 4 ? rig->tags / 4 : 4;
    for (int t = 0; t < rig->tags; t++)
        seen += tag_seen(&rig->tag[t], &rig->calibration, at, eye);
    return rig->tags == 0 || seen >= wanted;
}

// A camera is as wide as 8 degrees at its distance (80 mm at 600): nearer to the lamp's direction
// it shades the sample, or the lamp shines into it.
static bool free_of_lamp(const struct calibration *c, const struct lamp *lamp, pose at, vec3 eye)
{
    if (lamp->on_camera)
        return true;
    vec3 place = cal_lamp_position(lamp, at);
    vec3 a = vec3_normalize(vec3_sub(place, c->sample.center));
    vec3 b = vec3_normalize(vec3_sub(eye, c->sample.center));
    return vec3_dot(a, b) < cos(8 * DEG) && !in_picture(&c->camera[0], at, place);
}

/* ---- candidates -------------------------------------------------------------------------------
 */

static vec3 ring_place(const struct rings *r, int ring, int step, vec3 center, double distance)
{
    double way = r->rings > 1 ? (double)ring / (r->rings - 1) : 0;
    double elevation = r->lowest_deg + way * (r->highest_deg - r->lowest_deg);
    return sam_around(center, 2 * CAP_PI * step / r->steps, elevation * DEG, distance);
}

static void try_cameras(struct candidates *to, const struct rig *rig, const struct rings *rings,
                        int light)
{
    const struct calibration *c = &rig->calibration;
    for (int ring = 0; ring < rings->rings; ring++)
        for (int step = 0; step < rings->steps; step++) {
            vec3 eye = ring_place(rings, ring, step, to->target, to->distance);
            pose at = sam_look_at(eye, to->target, 0);
            if (!pose_is_found(rig, at, eye)
                || !free_of_lamp(c, &to->calibration.lamp[light], at, eye))
                continue;
            to->eye[to->calibration.views] = eye;
            to->calibration.view[to->calibration.views++] =
                (struct view){.light = light, .view_from_world = at, .power = 1};
        }
}

// The first lamp that is not on the camera, put in other places at the distance it has.
static void move_lamps(struct candidates *to, const struct calibration *c,
                       const struct rings *rings)
{
    int which = 0;
    while (which < c->lamps && c->lamp[which].on_camera)
        which++;
    if (which == c->lamps)
        return;
    const struct lamp *lamp = &c->lamp[which];
    double distance =
        lamp->at_infinity ? 1 : vec3_length(vec3_sub(lamp->position, c->sample.center));
    for (int ring = 0; ring < rings->rings; ring++)
        for (int step = 0; step < rings->steps; step++) {
            struct lamp moved = *lamp;
            vec3 from = lamp->at_infinity ? (vec3){0, 0, 0} : c->sample.center;
            vec3 place = ring_place(rings, ring, step, from, distance);
            if (lamp->at_infinity)
                moved.direction = place;
            else
                moved.position = place;
            to->calibration.lamp[to->calibration.lamps++] = moved;
        }
}

static enum status make_candidates(struct candidates *to, const struct rig *rig, bool move_lamp,
                                   struct error *err)
{
    static const struct rings cameras = {8, 80, 10, 36}, few = {15, 75, 5, 18};
    static const struct rings lamps = {15, 75, 5, 8};
    const struct calibration *c = &rig->calibration;
    enum status status = habits(to, c, err);
    if (status)
        return status;
    int moved = move_lamp ? lamps.rings * lamps.steps : 0;
    int most = c->lamps * cameras.rings * cameras.steps + moved * few.rings * few.steps;
    to->calibration = *c;
    to->calibration.views = 0;
    to->calibration.view = calloc((size_t)most + 1, sizeof *to->calibration.view);
    to->calibration.lamp = calloc((size_t)(c->lamps + moved) + 1, sizeof *c->lamp);
    to->eye = calloc((size_t)most + 1, sizeof *to->eye);
    to->seen = calloc((size_t)most + 1, sizeof *to->seen);
    if (!to->calibration.view || !to->calibration.lamp || !to->eye || !to->seen)
        return cap_fail(err, STATUS_MEMORY, "no memory for %d places of a camera", most);
    memcpy(to->calibration.lamp, c->lamp, (size_t)c->lamps * sizeof *c->lamp);
    to->lamps = c->lamps;
    if (move_lamp)
        move_lamps(to, c, &lamps);
    for (int light = 0; light < to->calibration.lamps; light++)
        try_cameras(to, rig, light < to->lamps ? &cameras : &few, light);
    if (to->calibration.views == 0)
        return cap_fail(err, STATUS_DATA,
                        "no camera place shows tags enough at %.0f mm: a plan needs a board",
                        to->distance);
    return STATUS_OK;
}

/* ---- the choice -------------------------------------------------------------------------------
 */

static int fresh_bins(const struct seen_bins *list, const uint8_t *seen)
{
    int fresh = 0;
    for (int i = 0; i < list->count; i++)
        fresh += !seen[list->bin[i]];
    return fresh;
}

static void mark(uint8_t *seen, const struct seen_bins *list)
{
    for (int i = 0; i < list->count; i++)
        seen[list->bin[i]] = 1;
}

// A bin beside a measured one is filled well (fill.c): what is worth a shot are blocks of bins, of
// 3 degrees of theta_d, 3 bins of theta_h and 6 degrees of phi_d, in which nothing is measured.
enum { CELLS = 30 * 30 * 30 };

static int cell_of(int bin)
{
    int phi_d = bin % MERL_PHI_D, theta_d = bin / MERL_PHI_D % MERL_THETA_D;
    int theta_h = bin / MERL_PHI_D / MERL_THETA_D;
    return theta_h / 3 * 900 + theta_d / 3 * 30 + phi_d / 6;
}

static int fresh_cells(const struct seen_bins *list, const uint8_t *cell, uint8_t *scratch)
{
    int fresh = 0;
    memcpy(scratch, cell, CELLS);
    for (int i = 0; i < list->count; i++) {
        int at = cell_of(list->bin[i]);
        fresh += !scratch[at];
        scratch[at] = 1;
    }
    return fresh;
}

static int choose(int *chosen, int wanted, const struct candidates *c, const uint8_t *seen)
{
    uint8_t *cell = calloc(2, CELLS);
    int count = 0;
    if (!cell)
        return -1;
    for (int b = 0; b < MERL_BINS; b++)
        cell[cell_of(b)] |= seen[b];
    while (count < wanted) {
        int best = -1, most = 0;
        for (int k = 0; k < c->calibration.views; k++) {
            int fresh = fresh_cells(&c->seen[k], cell, cell + CELLS);
            if (fresh > most) {
                most = fresh;
                best = k;
            }
        }
        if (best < 0)
            break;
        for (int i = 0; i < c->seen[best].count; i++)
            cell[cell_of(c->seen[best].bin[i])] = 1;
        chosen[count++] = best;
    }
    free(cell);
    return count;
}

static void angles(vec3 place, vec3 center, double *azimuth, double *elevation)
{
    vec3 way = vec3_sub(place, center);
    *azimuth = atan2(way.y, way.x);
    *elevation = atan2(way.z, hypot(way.x, way.y));
}

static struct proposal describe(const struct candidates *c, int k)
{
    const struct view *view = &c->calibration.view[k];
    const struct lamp *lamp = &c->calibration.lamp[view->light];
    const vec3 none = {0, 0, 0}, center = c->calibration.sample.center;
    struct proposal p = {.eye = c->eye[k],
                         .target = c->target,
                         .distance = c->distance,
                         .moved = view->light >= c->lamps,
                         .lamp_position = lamp->at_infinity
                                              ? lamp->direction
                                              : cal_lamp_position(lamp, view->view_from_world)};
    snprintf(p.lamp, sizeof p.lamp, "%s", lamp->name);
    angles(p.eye, center, &p.azimuth, &p.elevation);
    angles(p.lamp_position, lamp->at_infinity ? none : center, &p.lamp_azimuth, &p.lamp_elevation);
    return p;
}

// Whole pictures of the chosen ones, in their order.
static enum status promise(struct proposal *proposal, const int *chosen, int count, uint8_t *seen,
                           const struct candidates *c, struct run *run, struct error *err)
{
    struct calibration whole = c->calibration;
    struct view *view = calloc((size_t)count + 1, sizeof *view);
    struct seen_bins *list = calloc((size_t)count + 1, sizeof *list);
    enum status status = view && list ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "no memory");
    for (int i = 0; i < count && !status; i++)
        view[i] = c->calibration.view[chosen[i]];
    whole.view = view;
    whole.views = count;
    if (!status) {
        cap_stage(run, "promise", count);
        status = rec_coverage(list, &whole, 1, run, err);
    }
    for (int i = 0; i < count && !status; i++) {
        proposal[i] = describe(c, chosen[i]);
        proposal[i].fresh = fresh_bins(&list[i], seen);
        mark(seen, &list[i]);
        proposal[i].coverage = rec_coverage_of(seen);
        rec_seen_free(&list[i]);
    }
    free(list);
    free(view);
    return status;
}

// Rows to pass over, so that about a hundred cross the sample.
static int row_step(const struct candidates *c)
{
    const struct calibration *k = &c->calibration;
    double rows = 2 * k->camera[0].focal[1] * k->sample.radius / c->distance;
    return rows > 200 ? (int)(rows / 100) : 1;
}

enum status sam_plan(struct proposal *proposal, int *found, uint8_t *seen, const struct rig *rig,
                     struct plan_request request, struct run *run, struct error *err)
{
    struct candidates c = {0};
    int *chosen = calloc((size_t)request.shots + 1, sizeof *chosen), count = 0;
    enum status status = chosen ? make_candidates(&c, rig, request.move_lamp, err)
                                : cap_fail(err, STATUS_MEMORY, "no memory");
    if (!status) {
        cap_stage(run, "plan", c.calibration.views);
        status = rec_coverage(c.seen, &c.calibration, row_step(&c), run, err);
    }
    if (!status && (count = choose(chosen, request.shots, &c, seen)) < 0)
        status = cap_fail(err, STATUS_MEMORY, "no memory");
    if (!status)
        status = promise(proposal, chosen, count, seen, &c, run, err);
    if (!status)
        *found = count;
    free_candidates(&c);
    free(chosen);
    return status;
}
