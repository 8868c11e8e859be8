/* geometry.c -- cameras, poses and the board: detect tags, start, adjust, fit the tags' patterns
 * through the lens that was found, adjust again. */
#include "intrinsics.h"
#include "layout.h"
#include "pattern.h"
#include "start.h"
#include "tag_trouble.h"
#include "views.h"
#include "zoom.h"

#include <stdlib.h>
#include <string.h>

// A calibration under way. board is the capture with tags of its own: found ones are added.
struct geometry {
    struct calibration made;
    struct capture board;
    struct tag_place *given;  // [board.tags] before any adjustment
    double (*sigma_place)[6];
    struct lens_prior *prior;  // [made.cameras]
    double shared_px;          // see bundle.h
    struct sightings list;
    double place_sigma;
    const char *out;
    struct run *run;
};

static enum status check_board(const struct capture *capture, struct error *err)
{
    if (!capture->family || (capture->tags == 0 && !(capture->tag_size > 0)))
        return cap_fail(err, STATUS_DATA,
                        "%s: capture.yaml names no board: without tags there are no poses (add "
                        "`board`, or use --calibration FILE)",
                        capture->folder);
    struct tag_family family = {0};
    struct tag_pattern pattern;
    enum status status = pattern_open(&family, capture->family, err);
    for (int i = 0; !status && i < capture->tags; i++)
        status = pattern_of(&pattern, &family, capture->tag[i].id, err);
    pattern_close(&family);
    if (status)
        cap_fail_within(err, "%s/capture.yaml: board", capture->folder);
    return status;
}

static struct bundle bundle_of(struct geometry *g)
{
    return (struct bundle){.calibration = &g->made,
                           .capture = &g->board,
                           .sighting = g->list.sighting,
                           .sightings = g->list.count,
                           .given = g->given,
                           .place_sigma = g->place_sigma,
                           .sigma_place = g->sigma_place,
                           .prior = g->prior,
                           .shared_px = g->shared_px};
}

static enum status adjust(struct geometry *g, enum bundle_stage stage, struct error *err)
{
    struct bundle bundle = bundle_of(g);
    return bundle_adjust(&bundle, stage, err);
}

// ---- the beginning

static bool has_unplaced(const struct geometry *g)
{
    for (int i = 0; i < g->board.tags; i++)
        if (g->board.tag[i].unplaced)
            return true;
    return false;
}

// Sightings of tags without a place are of no use.
static void drop_unplaced(struct geometry *g)
{
    int kept = 0;
    for (int i = 0; i < g->board.tags; i++)
        if (!bundle_placed(g->board.tag + i))
            cap_warn(g->run, "tag %d: no photograph shows it together with the others: not used",
                     g->board.tag[i].id);
    for (int i = 0; i < g->list.count; i++)
        if (bundle_placed(g->board.tag + g->list.sighting[i].place))
            g->list.sighting[kept++] = g->list.sighting[i];
    g->list.count = kept;
}

// Places of tags that nobody measured, and views that are tied to them.
static enum status lay_out(struct geometry *g, struct error *err)
{
    struct bundle bundle = bundle_of(g);
    bool *posed = calloc((size_t)g->made.views + 1, sizeof *posed);
    if (!posed)
        return cap_fail(err, STATUS_MEMORY, "%d views", g->made.views);
    enum status status = layout_start(&bundle, posed, err);
    for (int v = 0; !status && v < g->made.views; v++)
        if (!posed[v])
            cap_warn(g->run, "%s: shares no tag with the other photographs: left out",
                     g->made.view[v].name);
    if (!status) {
        drop_unplaced(g);
        views_drop(&g->made, &g->list, posed);
        memcpy(g->given, g->board.tag, (size_t)g->board.tags * sizeof *g->given);
        if (g->made.views < VIEWS_MIN)
            status = cap_fail(err, STATUS_DATA,
                              "%s: only %d photographs share tags with each other, at least %d are "
                              "needed",
                              g->board.folder, g->made.views, VIEWS_MIN);
    }
    free(posed);
    return status;
}

static enum status first_calibration(struct geometry *g, struct error *err)
{
    struct bundle bundle = bundle_of(g);
    enum status status = has_unplaced(g) ? lay_out(g, err) : start_cameras(&bundle, err);
    if (!status)
        status = adjust(g, BUNDLE_FOCAL, err);
    bundle = bundle_of(g);
    if (!status)
        status = start_poses_again(&bundle, err);
    return status ? status : adjust(g, BUNDLE_LENS, err);
}

// ---- tags that are not what capture.yaml says

// A tag rejected in most of its views is not what capture.yaml says: name it, and drop it. (One or
// two views may have it partly covered; and one that is in its place is no trouble.)
static bool drop_misplaced(struct geometry *g)
{
    struct sightings *list = &g->list;
    bool dropped = false;
    for (int place = 0; place < g->board.tags; place++) {
        int seen = 0, rejected = 0, kept = 0;
        for (int i = 0; i < list->count; i++)
            if (list->sighting[i].place == place) {
                seen++;
                rejected += list->sighting[i].rejected;
            }
        if (rejected < 2 || 2 * rejected <= seen)
            continue;
        char trouble[200];
        struct bundle bundle = bundle_of(g);
        if (tag_in_place(&bundle, place))
            continue;
        tag_trouble(&bundle, place, trouble, sizeof trouble);
        cap_warn(g->run, "tag %d %s (in %d of %d photographs): not used", g->board.tag[place].id,
                 trouble, rejected, seen);
        dropped = true;
        for (int i = 0; i < list->count; i++)
            if (list->sighting[i].place != place)
                list->sighting[kept++] = list->sighting[i];
        list->count = kept;
    }
    return dropped;
}

// Root mean square distance of places from where they were given.
static double moved_mm(const struct geometry *g)
{
    double sum = 0;
    int n = 0;
    for (int i = 0; i < g->board.tags; i++) {
        if (g->given[i].unplaced || !(g->sigma_place[i][3] > 0))
            continue;
        vec3 off = vec3_sub(g->board.tag[i].center, g->given[i].center);
        sum += vec3_dot(off, off) / 3;
        n++;
    }
    return n ? sqrt(sum / n) : 0;
}

// A ruler's board: where other places of the tags explain most of the noise in all views, they are
// adjusted, first loosely, then as far as they turn out to be off.
static enum status adjust_places(struct geometry *g, struct error *err)
{
    static const double most = 0.5, loose_mm = 2, least_px = 0.1;
    struct bundle bundle = bundle_of(g);
    double share = 0, worst = 0;
    enum status status = bundle_places_share(&bundle, &share, err);
    for (int i = 0; i < g->made.cameras; i++)
        worst = fmax(worst, g->made.camera[i].rms_px);
    if (status || g->place_sigma > 0 || share < most || worst < least_px || g->made.views < 5
        || has_unplaced(g))
        return status;
    g->place_sigma = loose_mm;
    status = adjust(g, BUNDLE_CHOOSE, err);
    double off = status ? 0 : moved_mm(g);
    if (!status) {
        g->place_sigma = fmax(off, 1e-3);
        status = adjust(g, BUNDLE_CHOOSE, err);
    }
    if (!status)
        cap_warn(g->run,
                 "the tags stand %.2g mm from where capture.yaml has them (rms an axis): their "
                 "places were adjusted (`board: place_sigma` says how well they are known)",
                 off);
    return status;
}

static enum status refine(struct geometry *g, struct error *err)
{
    return sightings_refine(&g->list, views_tags_enough(&g->board), &g->made, &g->board, g->out,
                            g->run, err);
}

// Zooms and other focus distances make cameras of their own, and then all is adjusted again.
static enum status split_cameras(struct geometry *g, struct error *err)
{
    struct bundle bundle = bundle_of(g);
    int before = g->made.cameras;
    enum status status = zoom_split(&bundle, g->run, err);
    if (status || g->made.cameras == before)
        return status;
    struct lens_prior *grown = realloc(g->prior, (size_t)g->made.cameras * sizeof *grown);
    if (!grown)
        return cap_fail(err, STATUS_MEMORY, "%d cameras", g->made.cameras);
    g->prior = grown;
    for (int i = before; i < g->made.cameras; i++)
        g->prior[i] = intrinsics_unknown();
    for (int i = 0; i < g->list.count; i++)
        g->list.sighting[i].rejected = false;
    status = adjust(g, BUNDLE_FOCAL, err);
    if (!status)
        status = adjust(g, BUNDLE_LENS, err);
    if (!status)
        status = refine(g, err);
    return status ? status : adjust(g, BUNDLE_CHOOSE, err);
}

// A constant slant leaves the centre open, and with it the focal length: what errors that all tags
// share would decide there, what cameras are like decides better.
static bool center_open(const struct camera *camera)
{
    static const double part = 0.001;  // of the image: photographs fix a centre much better
    return fmax(camera->sigma_center[0], camera->sigma_center[1])
           > part * fmax(camera->width, camera->height);
}

static enum status assume_usual(struct geometry *g, struct error *err)
{
    static const double shared_px = 0.01;  // print, paper and edges: no corner is known better
    bool any = false;
    for (int i = 0; i < g->made.cameras; i++) {
        struct camera *camera = g->made.camera + i;
        if (!center_open(camera))
            continue;
        intrinsics_assume_usual(g->prior + i, camera);
        any = true;
    }
    g->shared_px = any ? shared_px : 0;
    return any ? adjust(g, BUNDLE_CHOOSE, err) : STATUS_OK;
}

static enum status final_calibration(struct geometry *g, struct error *err)
{
    enum status status = adjust(g, BUNDLE_CHOOSE, err);
    if (!status)
        status = split_cameras(g, err);
    if (!status)
        status = adjust_places(g, err);
    if (!status && drop_misplaced(g))
        status = adjust(g, BUNDLE_CHOOSE, err);
    if (!status)
        status = assume_usual(g, err);
    for (int i = 0; !status && i < g->made.cameras; i++) {
        const struct camera *camera = g->made.camera + i;
        double relative = camera->sigma_focal[0] / camera->focal[0];
        if (center_open(camera) && relative < 0.02)
            cap_warn(
                g->run,
                "camera %s: the middle of its image is uncertain by %.1f px, and its focal "
                "length by %.1f %%, since all photographs see the board at the same slant: add "
                "some from other heights or with the camera turned by 90 degrees, or give its "
                "`intrinsics`",
                camera->name, fmax(camera->sigma_center[0], camera->sigma_center[1]),
                100 * relative);
        else if (relative > 0.005)
            cap_warn(g->run,
                     "camera %s: the focal length is uncertain by %.1f %%: take photographs that "
                     "see the board at a slant, from several sides",
                     camera->name, 100 * relative);
    }
    return status;
}

// ---- the result

static enum status take_tags(struct geometry *g, struct error *err)
{
    for (int v = 0; v < g->made.views; v++) {
        struct view *view = g->made.view + v;
        view->tag = calloc((size_t)sightings_of(&g->list, v) + 1, sizeof *view->tag);
        if (!view->tag)
            return cap_fail(err, STATUS_MEMORY, "%s: tags", view->name);
        for (int i = 0; i < g->list.count; i++) {
            const struct sighting *s = g->list.sighting + i;
            if (s->view != v || s->rejected)
                continue;
            struct seen_tag *tag = view->tag + view->tags++;
            tag->id = g->board.tag[s->place].id;
            bundle_corner(g->made.camera + view->camera, s, tag->corner);
        }
    }
    return STATUS_OK;
}

static int by_size(const void *a, const void *b)
{
    const double *x = a, *y = b;
    return (*x > *y) - (*x < *y);
}

// What the lens adds to the photosite's own square, whose variance is 1/12: the median over tags.
static enum status take_blur(struct geometry *g, struct error *err)
{
    const struct sightings *list = &g->list;
    double *blur = malloc(((size_t)list->count + 1) * sizeof *blur);
    if (!blur)
        return cap_fail(err, STATUS_MEMORY, "no memory for tags");
    for (int v = 0; v < g->made.views; v++) {
        int n = 0;
        for (int i = 0; i < list->count; i++)
            if (list->sighting[i].view == v && list->sighting[i].refined
                && !list->sighting[i].rejected)
                blur[n++] = list->sighting[i].blur;
        qsort(blur, (size_t)n, sizeof *blur, by_size);
        g->made.view[v].blur_px = n ? sqrt(fmax(0, blur[n / 2] - 1.0 / 12)) : 0;
    }
    free(blur);
    return STATUS_OK;
}

// The board: the tags that were used.
static enum status take_board(struct geometry *g, struct error *err)
{
    const struct bundle bundle = bundle_of(g);
    g->made.family = strdup(g->board.family);
    g->made.tag = calloc((size_t)g->board.tags + 1, sizeof *g->made.tag);
    if (!g->made.family || !g->made.tag)
        return cap_fail(err, STATUS_MEMORY, "%d tags", g->board.tags);
    for (int i = 0; i < g->board.tags; i++) {
        struct board_tag tag = {.place = g->board.tag[i]};
        double squares = 0, r[4][2];
        for (int k = 0; k < g->list.count; k++) {
            const struct sighting *s = g->list.sighting + k;
            if (s->place != i || s->rejected || !bundle_residual(&bundle, s, r))
                continue;
            for (int n = 0; n < 8; n++)
                squares += r[n / 2][n % 2] * r[n / 2][n % 2];
            tag.views++;
        }
        if (tag.views == 0)
            continue;
        tag.rms_px = sqrt(squares / (4 * tag.views));
        memcpy(tag.sigma_turn, g->sigma_place[i], sizeof tag.sigma_turn);
        memcpy(tag.sigma_center, g->sigma_place[i] + 3, sizeof tag.sigma_center);
        g->made.tag[g->made.tags++] = tag;
    }
    return STATUS_OK;
}

// ---- the whole

// Everything that has a place for each tag or camera, when these are known.
static enum status geometry_room(struct geometry *g, const int *kind, struct error *err)
{
    size_t tags = (size_t)g->board.tags + 1;
    g->given = calloc(tags, sizeof *g->given);
    g->sigma_place = calloc(tags, sizeof *g->sigma_place);
    g->prior = calloc((size_t)g->made.cameras + 1, sizeof *g->prior);
    if (!g->given || !g->sigma_place || !g->prior)
        return cap_fail(err, STATUS_MEMORY, "%zu tags", tags);
    memcpy(g->given, g->board.tag, (size_t)g->board.tags * sizeof *g->given);
    enum status status = STATUS_OK;
    for (int i = 0; i < g->made.cameras && !status; i++)
        status = intrinsics_prior(g->prior + i, g->made.camera + i, &g->board, kind[i], g->out,
                                  g->run, err);
    return status;
}

static enum status find_views(struct geometry *g, const bool *usable, struct error *err)
{
    bool *chosen = calloc((size_t)g->board.shots + 1, sizeof *chosen);
    int *kind = calloc((size_t)g->board.cameras + 1, sizeof *kind);
    enum status status = chosen && kind
                             ? sightings_detect(&g->list, &g->board, g->out, usable, g->run, err)
                             : cap_fail(err, STATUS_MEMORY, "%d shots", g->board.shots);
    if (!status) {
        views_choose(chosen, &g->list, &g->board, usable, g->run);
        status = views_enough(chosen, &g->list, &g->board, err);
    }
    if (!status)
        status = views_make(&g->made, &g->list, kind, chosen, &g->board, err);
    if (!status)
        status = geometry_room(g, kind, err);
    free(kind);
    free(chosen);
    return status;
}

static enum status begin(struct geometry *g, const struct capture *capture, struct error *err)
{
    enum status status = check_board(capture, err);
    if (status)
        return status;
    g->board = *capture;  // shares all but the tags
    g->board.tag = calloc((size_t)capture->tags + 1, sizeof *g->board.tag);
    if (!g->board.tag)
        return cap_fail(err, STATUS_MEMORY, "%d tags", capture->tags);
    if (capture->tags > 0)
        memcpy(g->board.tag, capture->tag, (size_t)capture->tags * sizeof *capture->tag);
    for (int i = 0; i < capture->tags; i++)
        if (capture->tag[i].unplaced)
            g->board.tag[i].center.x = NAN;
    g->place_sigma = capture->place_sigma;
    return STATUS_OK;
}

enum status cal_geometry(struct calibration *c, const struct capture *capture, const char *out,
                         const bool *usable, struct run *run, struct error *err)
{
    struct geometry g = {.out = out, .run = run};
    enum status status = begin(&g, capture, err);
    if (!status)
        status = find_views(&g, usable, err);
    if (!status)
        status = first_calibration(&g, err);
    if (!status)
        status = refine(&g, err);
    if (!status)
        status = final_calibration(&g, err);
    if (!status)
        status = take_tags(&g, err);
    if (!status)
        status = take_blur(&g, err);
    if (!status)
        status = take_board(&g, err);
    if (!status) {
        *c = g.made;
        g.made = (struct calibration){0};
    }
    cal_calibration_free(&g.made);
    free(g.board.tag);
    free(g.given);
    free(g.sigma_place);
    free(g.prior);
    free(g.list.sighting);
    return status;
}
