/* overlay.c -- pictures of what the calibration found, drawn with cairo on the photograph, reduced
 * to at most 800 pixels a side: to see at a glance that nothing went wrong costs little. */
#include "overlay.h"

#include "balls.h"
#include "contour.h"
#include "overlay_photograph.h"
#include "view_map.h"

#include <stdlib.h>

enum { LONGEST = 800 };
// Residuals are drawn this many times longer: 0.02 px make 4 px on the photograph.
static const double magnified = 200;

// A picture under way: photograph pixels are `reduced` times smaller there.
struct canvas {
    cairo_surface_t *surface;
    cairo_t *cr;
    int reduced;
};

// ---- what is drawn on it

// A photograph's pixel on the canvas, whose pixels have their corners at whole numbers.
static void to(const struct canvas *c, const double pixel[2], bool pen_down)
{
    double x = (pixel[0] + 0.5) / c->reduced, y = (pixel[1] + 0.5) / c->reduced;
    if (pen_down)
        cairo_line_to(c->cr, x, y);
    else
        cairo_move_to(c->cr, x, y);
}

static void stroke(const struct canvas *c, double r, double g, double b)
{
    cairo_set_source_rgb(c->cr, r, g, b);
    cairo_stroke(c->cr);
}

static const struct tag_place *place_of(const struct capture *capture, int id)
{
    for (int i = 0; i < capture->tags; i++)
        if (capture->tag[i].id == id)
            return capture->tag + i;
    return NULL;
}

static void draw_tag(const struct canvas *c, const struct camera *camera, const struct view *view,
                     const struct seen_tag *tag, const struct tag_place *place)
{
    for (int k = 0; k < 4; k++)
        to(c, tag->corner[k], k > 0);
    cairo_close_path(c->cr);
    stroke(c, 0.1, 0.9, 0.2);
    for (int k = 0; place && k < 4; k++) {
        vec3 p = cal_to_view(view->view_from_world, cap_tag_corner(place, k));
        double predicted[2], end[2];
        if (!(p.z > 0))
            continue;
        cal_project(camera, p, predicted);
        for (int i = 0; i < 2; i++)
            end[i] = predicted[i] + magnified * (tag->corner[k][i] - predicted[i]);
        to(c, predicted, false);
        to(c, end, true);
    }
    stroke(c, 1, 0.2, 0.1);
}

// A circle in the camera's frame.
static void draw_circle(const struct canvas *c, const struct camera *camera, vec3 center,
                        vec3 normal, double radius)
{
    vec3 n = vec3_normalize(normal), other = fabs(n.x) < 0.7 ? (vec3){1, 0, 0} : (vec3){0, 1, 0};
    vec3 u = vec3_normalize(vec3_cross(n, other)), v = vec3_cross(n, u);
    bool down = false;
    for (int k = 0; k <= 96; k++) {
        double a = 2 * CAP_PI * k / 96, pixel[2];
        vec3 p = vec3_add(center,
                          vec3_add(vec3_scale(u, radius * cos(a)), vec3_scale(v, radius * sin(a))));
        if (p.z > 0)
            cal_project(camera, p, pixel);
        if (p.z > 0)
            to(c, pixel, down);
        down = p.z > 0;
    }
    stroke(c, 0.2, 0.6, 1);
}

/** A mesh shows its outline where the photograph is searched for it. */
static void draw_contour(const struct canvas *c, const struct camera *camera,
                         const struct view *view, const struct sample *s)
{
    struct contour_point *point = NULL;
    struct error why = {0};
    int count = 0;
    if (cal_contour(&point, &count, s, camera, view, &why))
        return;  // a picture without it tells more than none
    for (int i = 0; i < count; i++) {
        to(c, point[i].pixel, false);
        to(c, point[i].pixel, true);
    }
    cairo_set_line_cap(c->cr, CAIRO_LINE_CAP_ROUND);
    cairo_set_line_width(c->cr, 2);
    stroke(c, 0.2, 0.6, 1);
    cairo_set_line_width(c->cr, 1);
    free(point);
}

// A sphere's outline is the circle where rays from the eye touch it; a cylinder shows its rims.
static void draw_sample(const struct canvas *c, const struct camera *camera,
                        const struct view *view, const struct sample *s)
{
    vec3 center = cal_to_view(view->view_from_world, s->center);
    if (s->shape == SHAPE_SPHERE) {
        double share = s->radius * s->radius / vec3_dot(center, center);
        if (share < 1)
            draw_circle(c, camera, vec3_scale(center, 1 - share), center,
                        s->radius * sqrt(1 - share));
    } else if (s->shape == SHAPE_CYLINDER) {
        mat3 r = cal_rotation(view->view_from_world.rotation);
        vec3 axis = vec3_normalize(mat3_mul(&r, s->axis)), half = vec3_scale(axis, s->height / 2);
        draw_circle(c, camera, vec3_add(center, half), axis, s->radius);
        draw_circle(c, camera, vec3_sub(center, half), axis, s->radius);
    } else {
        draw_contour(c, camera, view, s);
    }
}

/** A ring where a highlight was seen. */
static void draw_seen_highlight(const struct canvas *c, const struct camera *camera,
                                const struct view *view, const struct seen_highlight *seen)
{
    const vec3 p = cal_to_view(view->view_from_world, seen->point);
    double pixel[2];
    if (!(p.z > 0))
        return;
    cal_project(camera, p, pixel);
    cairo_new_sub_path(c->cr);
    cairo_arc(c->cr, (pixel[0] + 0.5) / c->reduced, (pixel[1] + 0.5) / c->reduced, 4, 0,
              2 * CAP_PI);
    stroke(c, 1, 0.5, 0);
}

// Where a sphere mirrors the lamp into the camera: the normal halves the angle between them. The
// iteration shrinks errors by about the ratio of the radius to the distances.
static void draw_highlight(const struct canvas *c, const struct camera *camera,
                           const struct view *view, const struct sample *s, const struct lamp *lamp)
{
    vec3 eye = cal_eye(view->view_from_world), at = cal_lamp_position(lamp, view->view_from_world);
    vec3 n = {0, 0, 1}, point = s->center;
    for (int i = 0; i < 50; i++) {
        vec3 wo = vec3_normalize(vec3_sub(eye, point));
        vec3 wi = lamp->at_infinity ? lamp->direction : vec3_normalize(vec3_sub(at, point));
        if (vec3_length(vec3_add(wi, wo)) < 1e-6)
            return;  // the lamp is behind the sample
        n = vec3_normalize(vec3_add(wi, wo));
        point = vec3_add(s->center, vec3_scale(n, s->radius));
    }
    vec3 p = cal_to_view(view->view_from_world, point);
    double pixel[2], arm = 6;
    if (!(p.z > 0) || vec3_dot(n, vec3_sub(eye, point)) <= 0)
        return;
    cal_project(camera, p, pixel);
    double x = (pixel[0] + 0.5) / c->reduced, y = (pixel[1] + 0.5) / c->reduced;
    cairo_move_to(c->cr, x - arm, y);
    cairo_line_to(c->cr, x + arm, y);
    cairo_move_to(c->cr, x, y - arm);
    cairo_line_to(c->cr, x, y + arm);
    stroke(c, 1, 0.9, 0.1);
}

static void draw_caption(const struct canvas *c, const struct view *view)
{
    cairo_select_font_face(c->cr, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(c->cr, 11);
    char text[200];
    snprintf(text, sizeof text, "%.80s   %d tags, %.3f px rms; residuals x %g", view->name,
             view->tags, view->rms_px, magnified);
    for (int pass = 0; pass < 2; pass++) {  // a dark rim first, to be read on any ground
        cairo_move_to(c->cr, 6, 15);
        cairo_text_path(c->cr, text);
        cairo_set_source_rgb(c->cr, pass, pass, pass);
        cairo_set_line_width(c->cr, 3);
        if (pass == 0)
            cairo_stroke(c->cr);
        else
            cairo_fill(c->cr);
    }
}

/** Of the sample, when it is a sphere, and of the balls: where each was seen to mirror the lamp,
 *  and where it should. */
static void draw_highlights(const struct canvas *canvas, const struct calibration *c,
                            const struct view *view, const struct radiance *map)
{
    const struct camera *camera = c->camera + view->camera;
    const struct lamp *lamp = c->lamp + view->light;
    const int v = (int)(view - c->view);
    struct seen_highlight seen;
    if (c->sample.shape == SHAPE_SPHERE) {
        draw_highlight(canvas, camera, view, &c->sample, lamp);
        if (cal_highlight_lamp(&seen, map, c, &c->sample, v))
            draw_seen_highlight(canvas, camera, view, &seen);
    }
    for (int i = 0; i < c->balls; i++) {
        draw_highlight(canvas, camera, view, &c->ball[i], lamp);
        if (cal_ball_highlight(&seen, map, c, i, v))
            draw_seen_highlight(canvas, camera, view, &seen);
    }
}

static void draw_all(const struct canvas *canvas, const struct calibration *c,
                     const struct capture *capture, const struct view *view,
                     const struct radiance *map)
{
    const struct camera *camera = c->camera + view->camera;
    cairo_set_line_width(canvas->cr, 1);
    for (int i = 0; i < view->tags; i++)
        draw_tag(canvas, camera, view, view->tag + i, place_of(capture, view->tag[i].id));
    draw_sample(canvas, camera, view, &c->sample);
    for (int i = 0; i < c->balls; i++)
        draw_sample(canvas, camera, view, &c->ball[i]);
    if (view->light >= 0 && view->light < c->lamps)
        draw_highlights(canvas, c, view, map);
    draw_caption(canvas, view);
}

// ---- files

static enum status save(cairo_surface_t *surface, const char *path, struct error *err)
{
    cairo_surface_flush(surface);
    return cap_png_write(
        (const uint32_t *)(const void *)cairo_image_surface_get_data(surface),
        cairo_image_surface_get_width(surface), cairo_image_surface_get_height(surface),
        cairo_image_surface_get_stride(surface) / (int)sizeof(uint32_t), path, err);
}

static enum status draw_view(const struct calibration *c, const struct capture *capture,
                             const struct view *view, const char *out, const char *folder,
                             struct error *err)
{
    struct radiance map = {0};
    char name[512];
    snprintf(name, sizeof name, "%s.png", view->name);
    char *path = cap_path(folder, name);
    enum status status =
        path ? cal_view_map(&map, out, view, err) : cap_fail(err, STATUS_MEMORY, "%s", view->name);
    if (!status) {
        int longest = map.width > map.height ? map.width : map.height;
        struct canvas canvas = {.reduced = (longest + LONGEST - 1) / LONGEST};
        canvas.surface = cairo_image_surface_create(CAIRO_FORMAT_RGB24, map.width / canvas.reduced,
                                                    map.height / canvas.reduced);
        canvas.cr = cairo_create(canvas.surface);
        if (cairo_status(canvas.cr) == CAIRO_STATUS_SUCCESS
            && cal_overlay_photograph(canvas.surface, &map, canvas.reduced)) {
            draw_all(&canvas, c, capture, view, &map);
            status = save(canvas.surface, path, err);
        } else {
            status = cap_fail(err, STATUS_MEMORY, "%s", path);
        }
        cairo_destroy(canvas.cr);
        cairo_surface_destroy(canvas.surface);
    }
    cap_radiance_free(&map);
    free(path);
    return status;
}

enum status cal_overlay(const struct calibration *c, const struct capture *capture, const char *out,
                        struct run *run, struct error *err)
{
    char *folder = cap_path(out, "overlay");
    if (!folder)
        return cap_fail(err, STATUS_MEMORY, "overlays");
    enum status status = cap_make_folder(folder, err);
    if (!status) {
#pragma omp parallel for schedule(dynamic, 1) num_threads(run->threads)
        for (int i = 0; i < c->views; i++) {
            struct error why = {0};
            enum status drawn = draw_view(c, capture, c->view + i, out, folder, &why);
            if (drawn) {
#pragma omp critical(overlay_status)
                status = cap_fail(err, drawn, "%s", why.text);
            }
            cap_step(run);
        }
    }
    free(folder);
    return status;
}
