/* board_draw.c -- a board drawn by cairo: black cells of the tags, thin gray lines for what stands
 * on it, and a ruler that shows whether the printer kept the size. */
#include "board_draw.h"

#include <cairo-pdf.h>

static const double LINE = 0.2, TEXT = 3, POINTS_PER_MM = 72 / 25.4;

/** All black cells of a tag as one path, so that no seams show between neighbours. */
static void draw_tag(cairo_t *cr, const struct tag_place *tag, const struct tag_pattern *pattern)
{
    double cell = tag->size / pattern->side, begin = -0.5 * tag->size - pattern->begin * cell;
    for (int row = 0; row < pattern->width; row++)
        for (int column = 0; column < pattern->width; column++)
            if (pattern->cell[row][column] == CELL_BLACK)
                cairo_rectangle(cr, tag->center.x + begin + column * cell,
                                -tag->center.y + begin + row * cell, cell, cell);
    cairo_set_source_rgb(cr, 0, 0, 0);
    cairo_fill(cr);
}

static void label(cairo_t *cr, double x, double y, const char *text)
{
    cairo_text_extents_t size;
    cairo_text_extents(cr, text, &size);
    cairo_move_to(cr, x - 0.5 * size.width, y);
    cairo_show_text(cr, text);
}

static void draw_places(cairo_t *cr, const struct board_plan *plan)
{
    const double side = plan->patch_side;
    cairo_arc(cr, 0, 0, plan->sample_radius, 0, 2 * CAP_PI);
    cairo_stroke(cr);
    cairo_rectangle(cr, plan->patch[0] - 0.5 * side, -plan->patch[1] - 0.5 * side, side, side);
    cairo_stroke(cr);
    label(cr, 0, 0.5 * TEXT, "sample");
    label(cr, plan->patch[0], -plan->patch[1] + 0.5 * TEXT, "white patch");
}

/** Ticks every millimetre, longer ones every 5 and 10. */
static void draw_ruler(cairo_t *cr, const struct board_plan *plan)
{
    double left = -0.5 * plan->ruler, y = -plan->ruler_y;
    int length = (int)(plan->ruler + 0.5);
    for (int mm = 0; mm <= length; mm++) {
        double tick = mm % 10 == 0 ? 4 : mm % 5 == 0 ? 3 : 2;
        cairo_move_to(cr, left + mm, y);
        cairo_line_to(cr, left + mm, y - tick);
    }
    cairo_move_to(cr, left, y);
    cairo_line_to(cr, -left, y);
    cairo_stroke(cr);
    char text[80];
    snprintf(text, sizeof text, "%d mm from end to end, if printed at 100 %%", length);
    label(cr, 0, y - 5, text);
}

enum status board_draw(cairo_t *cr, const struct board_plan *plan, const struct tag_family *family,
                       struct error *err)
{
    enum status status = STATUS_OK;
    cairo_save(cr);
    cairo_translate(cr, 0.5 * plan->paper[0], 0.5 * plan->paper[1]);
    for (int i = 0; i < plan->tags && !status; i++) {
        struct tag_pattern pattern;
        status = pattern_of(&pattern, family, plan->tag[i].id, err);
        if (!status)
            draw_tag(cr, &plan->tag[i], &pattern);
    }
    cairo_set_line_width(cr, LINE);
    cairo_set_font_size(cr, TEXT);
    cairo_set_source_rgb(cr, 0.5, 0.5, 0.5);
    draw_places(cr, plan);
    cairo_set_source_rgb(cr, 0, 0, 0);
    draw_ruler(cr, plan);
    cairo_restore(cr);
    return status;
}

enum status board_write_pdf(const char *path, const struct board_plan *plan,
                            const struct tag_family *family, struct error *err)
{
    struct atomic_file file;
    enum status status = cap_file_begin(&file, path, false, err);
    if (status)
        return status;
    cairo_surface_t *surface = cairo_pdf_surface_create(file.aside, plan->paper[0] * POINTS_PER_MM,
                                                        plan->paper[1] * POINTS_PER_MM);
    cairo_t *cr = cairo_create(surface);
    cairo_scale(cr, POINTS_PER_MM, POINTS_PER_MM);
    status = board_draw(cr, plan, family, err);
    cairo_show_page(cr);
    cairo_destroy(cr);
    cairo_surface_finish(surface);
    cairo_status_t drawn = cairo_surface_status(surface);
    cairo_surface_destroy(surface);
    if (!status && drawn)
        status = cap_fail(err, STATUS_IO, "%s: %s", path, cairo_status_to_string(drawn));
    if (status) {
        cap_file_abandon(&file);
        return status;
    }
    return cap_file_commit(&file, err);
}
