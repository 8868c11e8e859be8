/* sightings.c -- the tags of a board in all photographs: each shot by one thread, at most one map
 * a thread in memory, and the result in order of the shots whatever thread came first. */
#include "sightings.h"

#include "corners.h"
#include "detect.h"
#include "view_map.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

// Deviation of detected corners, px (detect.h); the scale of noise is found by the bundle.
static const double detected_sigma = 0.15;

// ---- results of threads, joined in order

// The sightings of one shot, [tags].
struct row {
    struct sighting *sighting;
    int count;
    enum status status;
    struct error error;
};

static struct row *rows_make(int rows, int tags, struct error *err)
{
    struct row *row = calloc((size_t)rows + 1, sizeof *row);
    for (int i = 0; row && i < rows; i++) {
        row[i].sighting = calloc((size_t)tags + 1, sizeof *row[i].sighting);
        if (!row[i].sighting)
            row[i].status = cap_fail(&row[i].error, STATUS_MEMORY, "%d tags", tags);
    }
    if (!row)
        cap_fail(err, STATUS_MEMORY, "%d shots", rows);
    return row;
}

// Join the rows into *list and free them; the first failure, in order of shots, is the result.
static enum status rows_join(struct sightings *list, struct row *row, int rows, struct error *err)
{
    enum status status = STATUS_OK;
    size_t total = 0, n = 0;
    for (int i = 0; i < rows; i++) {
        total += (size_t)row[i].count;
        if (!status && row[i].status)
            status = cap_fail(err, row[i].status, "%s", row[i].error.text);
    }
    struct sighting *all = calloc(total + 1, sizeof *all);
    if (!status && !all)
        status = cap_fail(err, STATUS_MEMORY, "%zu tags", total);
    for (int i = 0; i < rows; i++) {
        for (int k = 0; !status && k < row[i].count; k++)
            all[n++] = row[i].sighting[k];
        free(row[i].sighting);
    }
    free(row);
    if (status) {
        free(all);
        return status;
    }
    free(list->sighting);
    *list = (struct sightings){all, (int)n};
    return STATUS_OK;
}

// ---- detection

// A sighting by id: which place that is, is known when all shots are.
static struct sighting detected(int view, const struct detection *d)
{
    struct sighting s = {.view = view, .place = d->id};
    memcpy(s.corner, d->corner, sizeof s.corner);
    for (int i = 0; i < 8; i++)
        s.covariance[i][i] = detected_sigma * detected_sigma;
    return s;
}

static void detect_shot(struct row *row, struct detector *detector, int shot,
                        const struct capture *board, const char *out, struct run *run)
{
    struct radiance map = {0};
    const struct view view = {.name = board->shot[shot].name};
    struct detection *found = NULL;
    int count = 0;
    row->status = cal_view_map(&map, out, &view, &row->error);
    if (!row->status)
        row->status = detector_find(detector, board, &map, &found, &count, &row->error);
    struct sighting *room = realloc(row->sighting, (size_t)(count + 1) * sizeof *room);
    if (room)
        row->sighting = room;
    else if (!row->status)
        row->status = cap_fail(&row->error, STATUS_MEMORY, "%d tags", count);
    for (int k = 0; !row->status && k < count; k++) {
        if (found[k].twice)
            cap_warn(run, "%s: two tags with id %d are in the picture: neither is used there",
                     view.name, found[k].id);
        else
            row->sighting[row->count++] = detected(shot, found + k);
    }
    cap_radiance_free(&map);
    free(found);
}

// The place of an id, or -1.
static int place_of(const struct capture *board, int id)
{
    for (int i = 0; i < board->tags; i++)
        if (board->tag[i].id == id)
            return i;
    return -1;
}

// Add tags that the board does not name, the lowest id first. One shot's word alone is not taken:
// chance makes tags of shadows and print.
static enum status add_tags(struct capture *board, const struct sightings *list, struct error *err)
{
    int id = -1;
    for (;;) {
        int next = INT_MAX, shots = 0;
        for (int i = 0; i < list->count; i++)
            if (list->sighting[i].place > id && list->sighting[i].place < next)
                next = list->sighting[i].place;
        if (next == INT_MAX)
            return STATUS_OK;
        id = next;
        for (int i = 0; i < list->count; i++)
            shots += list->sighting[i].place == id;
        if (shots < 2 || place_of(board, id) >= 0)
            continue;
        struct tag_place *grown =
            realloc(board->tag, (size_t)(board->tags + 1) * sizeof *board->tag);
        if (!grown)
            return cap_fail(err, STATUS_MEMORY, "%d tags", board->tags);
        board->tag = grown;
        board->tag[board->tags++] = (struct tag_place){.id = id,
                                                       .size = board->tag_size,
                                                       .x_axis = {1, 0, 0},
                                                       .y_axis = {0, 1, 0},
                                                       .unplaced = true};
    }
}

// From ids to places; tags that have none are dropped.
static void name_places(struct sightings *list, const struct capture *board)
{
    int kept = 0;
    for (int i = 0; i < list->count; i++) {
        struct sighting s = list->sighting[i];
        s.place = place_of(board, s.place);
        if (s.place >= 0)
            list->sighting[kept++] = s;
    }
    list->count = kept;
}

enum status sightings_detect(struct sightings *list, struct capture *board, const char *out,
                             const bool *usable, struct run *run, struct error *err)
{
    struct row *row = rows_make(board->shots, 0, err);
    if (!row)
        return STATUS_MEMORY;
    cap_stage(run, "finding tags", board->shots);
#pragma omp parallel num_threads(run->threads)
    {
        struct detector detector = {0};
        struct error error = {0};
        enum status status = detector_begin(&detector, board->family, &error);
#pragma omp for schedule(dynamic, 1)
        for (int i = 0; i < board->shots; i++) {
            if (status && !row[i].status)
                row[i].status = cap_fail(&row[i].error, status, "%s", error.text);
            if (!row[i].status && (!usable || usable[i]))
                detect_shot(row + i, &detector, i, board, out, run);
            cap_step(run);
        }
        detector_end(&detector);
    }
    enum status status = rows_join(list, row, board->shots, err);
    if (!status && board->tag_size > 0)
        status = add_tags(board, list, err);
    if (!status)
        name_places(list, board);
    return status;
}

// ---- refinement

// Where the calibration expects a tag; false: behind the camera.
static bool expected(double corner[4][2], const struct calibration *c, int view,
                     const struct tag_place *tag)
{
    const struct view *v = c->view + view;
    if (!bundle_placed(tag))
        return false;
    for (int k = 0; k < 4; k++) {
        vec3 p = cal_to_view(v->view_from_world, cap_tag_corner(tag, k));
        if (!(p.z > 0))
            return false;
        cal_project(c->camera + v->camera, p, corner[k]);
    }
    return true;
}

static const struct sighting *find(const struct sightings *list, int view, int place)
{
    for (int i = 0; i < list->count; i++)
        if (list->sighting[i].view == view && list->sighting[i].place == place)
            return list->sighting + i;
    return NULL;
}

// Everything that the refinement of any view reads.
struct refinement {
    const struct sightings *detected;
    const struct calibration *calibration;
    const struct capture *capture;
    const struct tag_pattern *pattern;  // [capture->tags]
    const char *out;
    int enough;
};

static bool refine_tag(struct sighting *s, const struct refinement *r, int view, int place,
                       const struct radiance *map)
{
    const struct camera *camera = r->calibration->camera + r->calibration->view[view].camera;
    const struct sighting *seen = find(r->detected, view, place);
    double start[4][2];
    struct tag_fit fit;
    if (!expected(start, r->calibration, view, r->capture->tag + place))
        return false;
    bool good = corners_fit(&fit, r->pattern + place, camera, map, start);
    if (!good && seen) {  // a tag that is not where the board's other tags say
        memcpy(start, seen->corner, sizeof start);
        good = corners_fit(&fit, r->pattern + place, camera, map, start);
    }
    if (!good)
        return false;
    *s = (struct sighting){.view = view,
                           .place = place,
                           .blur = fit.blur,
                           .covered = 1 - fit.inliers,
                           .refined = true};
    memcpy(s->corner, fit.corner, sizeof s->corner);
    memcpy(s->covariance, fit.covariance, sizeof s->covariance);
    memcpy(s->by_lens, fit.by_lens, sizeof s->by_lens);
    lens_to_array(s->lens, camera);
    return true;
}

static void refine_view(struct row *row, const struct refinement *r, int view)
{
    struct radiance map = {0};
    int tags = r->capture->tags;
    row->status = cal_view_map(&map, r->out, r->calibration->view + view, &row->error);
    for (int place = 0; !row->status && place < tags; place++)
        if (refine_tag(row->sighting + row->count, r, view, place, &map))
            row->count++;
    if (row->count < r->enough) {
        row->count = 0;
        for (int place = 0; place < tags; place++) {
            const struct sighting *seen = find(r->detected, view, place);
            if (seen)
                row->sighting[row->count++] = *seen;
        }
    }
    cap_radiance_free(&map);
}

static enum status all_patterns(struct tag_pattern *pattern, const struct capture *capture,
                                struct error *err)
{
    struct tag_family family = {0};
    enum status status = pattern_open(&family, capture->family, err);
    for (int i = 0; !status && i < capture->tags; i++)
        status = pattern_of(pattern + i, &family, capture->tag[i].id, err);
    pattern_close(&family);
    return status;
}

enum status sightings_refine(struct sightings *list, int enough,
                             const struct calibration *calibration, const struct capture *capture,
                             const char *out, struct run *run, struct error *err)
{
    int views = calibration->views;
    struct tag_pattern *pattern = calloc((size_t)capture->tags + 1, sizeof *pattern);
    if (!pattern)
        return cap_fail(err, STATUS_MEMORY, "%d tags", capture->tags);
    struct row *row = NULL;
    enum status status = all_patterns(pattern, capture, err);
    if (!status && !(row = rows_make(views, capture->tags, err)))
        status = STATUS_MEMORY;
    if (!status) {
        const struct refinement r = {list, calibration, capture, pattern, out, enough};
        cap_stage(run, "fitting tags", views);
#pragma omp parallel for schedule(dynamic, 1) num_threads(run->threads)
        for (int i = 0; i < views; i++) {
            if (!row[i].status)
                refine_view(row + i, &r, i);
            cap_step(run);
        }
        status = rows_join(list, row, views, err);
    }
    free(pattern);
    return status;
}
