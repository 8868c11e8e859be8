/* pen_paper.c -- plots on paper: PNG, SVG and PDF by cairo. */
#include "pen.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#define INK_RGB(name, class, rgb) rgb,
static const uint32_t ink_rgb[INKS] = {INK_LIST(INK_RGB)};
#undef INK_RGB

uint32_t rec_ink_rgb(enum ink ink)
{
    return ink_rgb[ink];
}

struct picture rec_picture_make(int width, int height)
{
    struct picture p = {width, height, NULL};
    p.argb = calloc((size_t)width * (size_t)height + 1, sizeof *p.argb);
    return p;
}

void rec_picture_free(struct picture *picture)
{
    free(picture->argb);
    *picture = (struct picture){0};
}

static void dip(cairo_t *cr, enum ink ink, double opacity)
{
    uint32_t c = ink_rgb[ink];
    cairo_set_source_rgba(cr, (c >> 16) / 255.0, (c >> 8 & 255) / 255.0, (c & 255) / 255.0,
                          opacity);
}

static void trace(cairo_t *cr, const point2 *p, int n)
{
    bool down = false;
    for (int i = 0; i < n; i++) {
        if (isnan(p[i].x) || isnan(p[i].y))
            down = false;
        else if (down)
            cairo_line_to(cr, p[i].x, p[i].y);
        else
            cairo_move_to(cr, p[i].x, p[i].y), down = true;
    }
}

static void paper_path(struct pen *pen, const point2 *p, int n, bool closed, pen_style s)
{
    static const double dash[] = {4, 3}, dot[] = {1.5, 3};
    cairo_t *cr = pen->cr;
    cairo_new_path(cr);
    trace(cr, p, n);
    if (closed)
        cairo_close_path(cr);
    if (s.fill != INK_NONE) {
        dip(cr, s.fill, s.opacity);
        cairo_fill_preserve(cr);
    }
    if (s.stroke != INK_NONE) {
        dip(cr, s.stroke, 1);
        cairo_set_line_width(cr, s.width);
        cairo_set_line_join(cr, CAIRO_LINE_JOIN_ROUND);
        cairo_set_dash(cr, s.line == LINE_DOTTED ? dot : dash, s.line == LINE_SOLID ? 0 : 2, 0);
        cairo_stroke(cr);
    }
    cairo_new_path(cr);
}

static void paper_text(struct pen *pen, point2 at, text_style s, const char *text)
{
    cairo_t *cr = pen->cr;
    cairo_text_extents_t size;
    cairo_save(cr);
    cairo_select_font_face(cr, "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                           s.bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(cr, s.size);
    cairo_text_extents(cr, text, &size);
    cairo_translate(cr, at.x, at.y);
    if (s.upward)
        cairo_rotate(cr, -CAP_PI / 2);
    double share = s.align == ALIGN_LEFT ? 0 : s.align == ALIGN_MIDDLE ? 0.5 : 1;
    cairo_move_to(cr, -share * size.x_advance, 0);
    dip(cr, s.ink, 1);
    cairo_show_text(cr, text);
    cairo_restore(cr);
    cairo_new_path(cr);
}

// Cairo's own layout: premultiplied.
static cairo_surface_t *surface_of(const struct picture *picture)
{
    cairo_surface_t *s =
        cairo_image_surface_create(CAIRO_FORMAT_ARGB32, picture->width, picture->height);
    unsigned char *data = cairo_image_surface_get_data(s);
    if (!data || !picture->argb)
        return s;
    cairo_surface_flush(s);
    for (int y = 0; y < picture->height; y++)
        for (int x = 0; x < picture->width; x++) {
            uint32_t c = picture->argb[(size_t)y * (size_t)picture->width + (size_t)x];
            uint32_t a = c >> 24, out = a << 24;
            for (int shift = 0; shift <= 16; shift += 8)
                out |= ((c >> shift & 255) * a + 127) / 255 << shift;
            memcpy(data + (ptrdiff_t)y * cairo_image_surface_get_stride(s) + 4 * (ptrdiff_t)x, &out,
                   sizeof out);
        }
    cairo_surface_mark_dirty(s);
    return s;
}

static void paper_picture(struct pen *pen, const struct picture *picture, point2 at, double width,
                          double height)
{
    cairo_surface_t *s = surface_of(picture);
    cairo_save(pen->cr);
    cairo_translate(pen->cr, at.x, at.y);
    cairo_scale(pen->cr, width / picture->width, height / picture->height);
    cairo_set_source_surface(pen->cr, s, 0, 0);
    // A picture with a pixel or more for each of the paper's is a photograph, else it is cells.
    bool cells = width >= 1.2 * picture->width;
    cairo_pattern_set_filter(cairo_get_source(pen->cr),
                             cells ? CAIRO_FILTER_NEAREST : CAIRO_FILTER_GOOD);
    cairo_rectangle(pen->cr, 0, 0, picture->width, picture->height);
    cairo_fill(pen->cr);
    cairo_restore(pen->cr);
    cairo_surface_destroy(s);
}

static void paper_begin(struct pen *pen, const char *classes)
{
    (void)classes;
    cairo_save(pen->cr);
}

static void paper_end(struct pen *pen)
{
    cairo_restore(pen->cr);
}

struct pen rec_pen_paper(cairo_t *cr)
{
    return (struct pen){.path = paper_path,
                        .text = paper_text,
                        .picture = paper_picture,
                        .begin = paper_begin,
                        .end = paper_end,
                        .cr = cr};
}

// ---- strokes that any medium draws

void rec_line(struct pen *pen, point2 a, point2 b, enum ink ink, double width)
{
    pen->path(pen, (point2[]){a, b}, 2, false, (pen_style){.stroke = ink, .width = width});
}

void rec_box(struct pen *pen, point2 at, double width, double height, enum ink fill,
             enum ink stroke)
{
    point2 corner[] = {
        at, {at.x + width, at.y}, {at.x + width, at.y + height}, {at.x, at.y + height}};
    pen->path(pen, corner, 4, true, (pen_style){stroke, fill, 0.75, 1, LINE_SOLID});
}

void rec_circle(struct pen *pen, point2 center, double radius, pen_style style)
{
    enum { SIDES = 72 };
    point2 p[SIDES];
    for (int i = 0; i < SIDES; i++)
        p[i] = (point2){center.x + radius * cos(2 * CAP_PI * i / SIDES),
                        center.y + radius * sin(2 * CAP_PI * i / SIDES)};
    pen->path(pen, p, SIDES, true, style);
}

void rec_write(struct pen *pen, point2 at, enum align align, double size, enum ink ink,
               const char *format, ...)
{
    char text[256];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    pen->text(pen, at, (text_style){.align = align, .size = size, .ink = ink}, text);
}

// ---- PNG

struct bytes {
    unsigned char *data;
    size_t size, room;
};

static cairo_status_t keep(void *closure, const unsigned char *data, unsigned length)
{
    struct bytes *b = closure;
    if (b->size + length > b->room) {
        size_t room = 2 * (b->size + length);
        unsigned char *grown = realloc(b->data, room);
        if (!grown)
            return CAIRO_STATUS_NO_MEMORY;
        b->data = grown;
        b->room = room;
    }
    memcpy(b->data + b->size, data, length);
    b->size += length;
    return CAIRO_STATUS_SUCCESS;
}

bool rec_png_base64(FILE *to, const struct picture *picture)
{
    struct bytes bytes = {0};
    cairo_surface_t *s = surface_of(picture);
    cairo_status_t made = cairo_surface_write_to_png_stream(s, keep, &bytes);
    cairo_surface_destroy(s);
    if (made == CAIRO_STATUS_SUCCESS)
        rec_base64(to, bytes.data, bytes.size);
    free(bytes.data);
    return made == CAIRO_STATUS_SUCCESS && !ferror(to);
}
