/* overlay.c -- pictures of what the calibration found, drawn with cairo on the photograph, reduced
 * to at most 800 pixels a side: to see at a glance that nothing went wrong costs little. */
#include "overlay.h"

#include "view_map.h"

#include <cairo.h>
#include <stdlib.h>
#include <string.h>

enum { LONGEST = 800 };
// Residuals are drawn this many times longer: 0.02 px make 4 px on the photograph.
static const double magnified = 200;

// A picture under way: photograph pixels are `reduced` times smaller there.
struct canvas {
    cairo_surface_t *surface;
    cairo_t *cr;
    int reduced;
};

// ---- the photograph

static int compare_floats(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

// The level that 2 % of the values exceed becomes white.
static float white_level(const struct radiance *map)
{
    enum { ENOUGH = 20000 };
    size_t values = 3 * (size_t)map->width * (size_t)map->height, n = 0;
    const size_t stride = 3 * (values / (3 * ENOUGH)) + 1;  // all channels take part
    float *v = malloc((values / stride + 1) * sizeof *v), white = 0;
    for (size_t i = 0; v && i < values; i += stride) {
        float value[3];
        size_t at = i / 3, width = (size_t)map->width;
        cap_radiance_at(map, (int)(at % width), (int)(at / width), value, NULL);
        if (isfinite(value[i % 3]))
            v[n++] = value[i % 3];
    }
    if (v && n > 0) {
        qsort(v, n, sizeof *v, compare_floats);
        white = v[n - 1 - n / 50];
    }
    free(v);
    return white > 0 ? white : 1;
}

// A gamma of 2.2 is near enough to sRGB for a look.
static uint32_t display_value(float level)
{
    return (uint32_t)(255 * powf(fminf(fmaxf(level, 0), 1), 1 / 2.2f) + 0.5f);
}

// The rows of a strip of blocks of n x n pixels, of which three by three tell enough.
enum { TELLING = 3 };
struct strip {
    float *row[TELLING];  // [width][3]
    int rows, step;
};

// Mean of a block, as a display value.
static uint32_t display_pixel(const struct strip *strip, int x0, int n, float white)
{
    float sum[3] = {0}, count = 0;
    for (int k = 0; k < strip->rows; k++)
        for (int x = x0; x < x0 + n; x += strip->step, count++)
            for (int c = 0; c < 3; c++) {
                float value = strip->row[k][3 * (size_t)x + (size_t)c];
                sum[c] += isfinite(value) ? value : 0;
            }
    uint32_t rgb = 0;
    for (int c = 0; c < 3; c++)
        rgb = rgb << 8 | display_value(sum[c] / (count * white));
    return rgb;
}

static bool paint_photograph(cairo_surface_t *surface, const struct radiance *map, int n)
{
    const size_t line = 3 * (size_t)map->width;
    struct strip strip = {.step = (n + TELLING - 1) / TELLING};
    float *rows = malloc(TELLING * line * sizeof *rows), white = white_level(map);
    if (!rows)
        return false;
    for (int k = 0; k < TELLING; k++)
        strip.row[k] = rows + (size_t)k * line;
    unsigned char *data = cairo_image_surface_get_data(surface);
    int stride = cairo_image_surface_get_stride(surface);
    cairo_surface_flush(surface);
    for (int y = 0; y < map->height / n; y++) {
        strip.rows = 0;
        for (int k = 0; k < n; k += strip.step)
            cap_radiance_row(map, y * n + k, 0, map->width, strip.row[strip.rows++], NULL);
        for (int x = 0; x < map->width / n; x++) {
            uint32_t rgb = display_pixel(&strip, x * n, n, white);
            memcpy(data + (size_t)y * (size_t)stride + 4 * (size_t)x, &rgb, sizeof rgb);
        }
    }
    cairo_surface_mark_dirty(surface);
    free(rows);
    return true;
}

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
    }
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

static void draw_all(const struct canvas *canvas, const struct calibration *c,
                     const struct capture *capture, const struct view *view)
{
    const struct camera *camera = c->camera + view->camera;
    cairo_set_line_width(canvas->cr, 1);
    for (int i = 0; i < view->tags; i++)
        draw_tag(canvas, camera, view, view->tag + i, place_of(capture, view->tag[i].id));
    draw_sample(canvas, camera, view, &c->sample);
    if (c->sample.shape == SHAPE_SPHERE && view->light >= 0 && view->light < c->lamps)
        draw_highlight(canvas, camera, view, &c->sample, c->lamp + view->light);
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
            && paint_photograph(canvas.surface, &map, canvas.reduced)) {
            draw_all(&canvas, c, capture, view);
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
