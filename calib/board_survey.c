/* board_survey.c -- the board's cells in all photographs.
 *
 * Method.   The board's planes are cut into cells; a cell's radiance is the mean of photosites at
 *           points all over it. Where the board is and where the cameras stand does not depend on
 *           lamps: photographs are looked at once, however often the lamps are fitted after that.
 */
#include "board_light.h"
#include "view_map.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

enum { CELLS_ACROSS = 50, POINTS_MAX = 6 };
static const double MARGIN = 0.12;      // of the tags' extent: the board goes on beyond them
static const double FLAT = 0.1;         // cosine: a view flatter than this measures no cell
static const double SAME_PLANE_MM = 1;  // tags this near a plane are on it

/** A rectangle of board. */
struct plane {
    vec3 origin, x, y, normal;
    double low[2], high[2];  // along x and y
};

/* ---- planes and cells ---------------------------------------------------------------------------
 */

static void include_tag(struct plane *p, const struct tag_place *tag)
{
    for (int k = 0; k < 4; k++) {
        vec3 d = vec3_sub(cap_tag_corner(tag, k), p->origin);
        double at[2] = {vec3_dot(d, p->x), vec3_dot(d, p->y)};
        for (int a = 0; a < 2; a++) {
            p->low[a] = fmin(p->low[a], at[a]);
            p->high[a] = fmax(p->high[a], at[a]);
        }
    }
}

static bool on_plane(const struct plane *p, const struct tag_place *tag)
{
    vec3 normal = vec3_cross(tag->x_axis, tag->y_axis);
    return vec3_dot(normal, p->normal) > 0.999
           && fabs(vec3_dot(vec3_sub(tag->center, p->origin), p->normal)) < SAME_PLANE_MM;
}

/** The planes that the tags lie on: [capture->tags] of room; their number. */
static int find_planes(struct plane *plane, const struct capture *capture)
{
    int planes = 0;
    for (int i = 0; i < capture->tags; i++) {
        const struct tag_place *tag = &capture->tag[i];
        int p = 0;
        while (p < planes && !on_plane(&plane[p], tag))
            p++;
        if (p == planes)
            plane[planes++] = (struct plane){.origin = tag->center,
                                             .x = tag->x_axis,
                                             .y = tag->y_axis,
                                             .normal = vec3_cross(tag->x_axis, tag->y_axis),
                                             .low = {DBL_MAX, DBL_MAX},
                                             .high = {-DBL_MAX, -DBL_MAX}};
        include_tag(&plane[p], tag);
    }
    return planes;
}

static enum status cut_cells(struct board_survey *survey, const struct plane *plane, int planes,
                             struct error *err)
{
    for (int p = 0; p < planes; p++) {
        double size[2], margin = 0;
        int n[2];
        for (int a = 0; a < 2; a++)
            margin = fmax(margin, MARGIN * (plane[p].high[a] - plane[p].low[a]));
        for (int a = 0; a < 2; a++)
            size[a] = plane[p].high[a] - plane[p].low[a] + 2 * margin;
        double side = fmax(size[0], size[1]) / CELLS_ACROSS;
        for (int a = 0; a < 2; a++)
            n[a] = (int)ceil(size[a] / side);
        size_t cells = (size_t)survey->cells + (size_t)n[0] * (size_t)n[1];
        struct glow *grown = realloc(survey->cell, cells * sizeof *grown);
        if (!grown)
            return cap_fail(err, STATUS_MEMORY, "%zu cells of the board", cells);
        survey->cell = grown;
        for (int j = 0; j < n[1]; j++)
            for (int i = 0; i < n[0]; i++) {
                double x = plane[p].low[0] - margin + (i + 0.5) * side;
                double y = plane[p].low[1] - margin + (j + 0.5) * side;
                vec3 at = vec3_add(plane[p].origin,
                                   vec3_add(vec3_scale(plane[p].x, x), vec3_scale(plane[p].y, y)));
                survey->cell[survey->cells++] = (struct glow){
                    .point = at, .normal = plane[p].normal, .x = plane[p].x, .side = side};
            }
    }
    return STATUS_OK;
}

/* ---- what the photographs show
 * -------------------------------------------------------------------- */

/** Mean radiance of a cell in a map; false: outside or too flat. */
static bool look_at_cell(float mean[3], const struct glow *cell, const struct radiance *map,
                         const struct calibration *c, const struct view *view, vec3 eye)
{
    const struct camera *camera = &c->camera[view->camera];
    vec3 to_eye = vec3_sub(eye, cell->point);
    double distance = vec3_length(to_eye);
    if (vec3_dot(to_eye, cell->normal) < FLAT * distance)
        return false;
    vec3 y = vec3_cross(cell->normal, cell->x);
    int points = (int)(cell->side * camera->focal[0] / distance) + 1;
    points = points > POINTS_MAX ? POINTS_MAX : points;
    double sum[3] = {0};
    for (int k = 0; k < points * points; k++) {
        double a = ((k % points + 0.5) / points - 0.5) * cell->side;
        int row = k / points;
        double b = ((row + 0.5) / points - 0.5) * cell->side, pixel[2];
        vec3 p = vec3_add(cell->point, vec3_add(vec3_scale(cell->x, a), vec3_scale(y, b)));
        cal_project(camera, cal_to_view(view->view_from_world, p), pixel);
        if (!(pixel[0] > -0.5 && pixel[1] > -0.5 && pixel[0] < map->width - 0.5
              && pixel[1] < map->height - 0.5))
            return false;
        float value[3];
        cap_radiance_at(map, (int)(pixel[0] + 0.5), (int)(pixel[1] + 0.5), value, NULL);
        for (int k3 = 0; k3 < 3; k3++)
            sum[k3] += value[k3];
    }
    for (int k = 0; k < 3; k++)
        mean[k] = (float)(sum[k] / (points * points));
    return true;
}

/** One view's row of the survey. */
static enum status look(struct board_survey *s, const struct calibration *c, int v, const char *out,
                        struct error *err)
{
    const struct view *view = &c->view[v];
    struct radiance map = {0};
    enum status status = cal_view_map(&map, out, view, err);
    float *row = s->seen + 3 * (size_t)v * (size_t)s->cells;
    vec3 eye = cal_eye(view->view_from_world);
    for (int i = 0; !status && i < s->cells; i++)
        if (!look_at_cell(row + 3 * (size_t)i, &s->cell[i], &map, c, view, eye))
            row[3 * (size_t)i] = NAN;
    cap_radiance_free(&map);
    return status;
}

enum status cal_board_survey(struct board_survey *survey, const struct calibration *c,
                             const struct capture *capture, const char *out, struct run *run,
                             struct error *err)
{
    struct board_survey made = {0};
    struct plane *plane = calloc((size_t)capture->tags + 1, sizeof *plane);
    enum status status = plane ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "planes");
    if (!status)
        status = cut_cells(&made, plane, find_planes(plane, capture), err);
    if (!status) {
        made.seen = calloc(3 * (size_t)made.cells * (size_t)c->views, sizeof *made.seen);
        if (!made.seen)
            status = cap_fail(err, STATUS_MEMORY, "%d cells in %d views", made.cells, c->views);
    }
#pragma omp parallel for schedule(dynamic) num_threads(run->threads) if (!status)
    for (int v = 0; v < c->views; v++) {
        struct error own = {0};
        enum status s = status ? status : look(&made, c, v, out, &own);
        if (s && own.status) {
#pragma omp critical(board_light_error)
            status = cap_fail(err, s, "%s", own.text);
        }
    }
    free(plane);
    if (!status) {
        *survey = made;
        made = (struct board_survey){0};
    }
    cal_board_survey_free(&made);
    return status;
}

void cal_board_survey_free(struct board_survey *survey)
{
    free(survey->cell);
    free(survey->seen);
    *survey = (struct board_survey){0};
}
