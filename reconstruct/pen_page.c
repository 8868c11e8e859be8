/* pen_page.c -- plots in the report: SVG elements whose classes the page's style gives colours,
 * so that one drawing serves light and dark, and whose groups it can hide.
 *
 * A curve leaves out the points that lie on the line between their neighbours to a thirtieth of a
 * pixel: it looks the same and is several times shorter.
 */
#include "pen.h"

#define INK_CLASS(name, class, rgb) class,
static const char *const ink_class[INKS] = {INK_LIST(INK_CLASS)};
#undef INK_CLASS

void rec_base64(FILE *to, const unsigned char *data, size_t size)
{
    static const char digit[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < size; i += 3) {
        unsigned n = (unsigned)data[i] << 16;
        n |= i + 1 < size ? (unsigned)data[i + 1] << 8 : 0;
        n |= i + 2 < size ? data[i + 2] : 0;
        putc_unlocked(digit[n >> 18], to);
        putc_unlocked(digit[n >> 12 & 63], to);
        putc_unlocked(i + 1 < size ? digit[n >> 6 & 63] : '=', to);
        putc_unlocked(i + 2 < size ? digit[n & 63] : '=', to);
    }
}

void rec_escaped(FILE *to, const char *text)
{
    for (const char *c = text; *c; c++)
        if (*c == '<')
            fputs("&lt;", to);
        else if (*c == '>')
            fputs("&gt;", to);
        else if (*c == '&')
            fputs("&amp;", to);
        else if (*c == '"')
            fputs("&quot;", to);
        else
            fputc(*c, to);
}

static bool lifted(point2 p)
{
    return isnan(p.x) || isnan(p.y);
}

// Does b lie between a and c, as far as one can see?
static bool between(point2 a, point2 b, point2 c)
{
    double x = c.x - a.x, y = c.y - a.y, length = hypot(x, y);
    double off = fabs(x * (b.y - a.y) - y * (b.x - a.x));
    double along = x * (b.x - a.x) + y * (b.y - a.y);
    return length > 0 && off < length / 30 && along > 0 && along < length * length;
}

static void trace(FILE *to, const point2 *p, int n)
{
    bool down = false;
    point2 last = {0, 0};
    for (int i = 0; i < n; i++) {
        if (lifted(p[i])) {
            down = false;
            continue;
        }
        if (down && i + 1 < n && !lifted(p[i + 1]) && between(last, p[i], p[i + 1]))
            continue;
        fprintf(to, "%c%.4g %.4g", down ? 'L' : 'M', p[i].x, p[i].y);
        last = p[i];
        down = true;
    }
}

static void page_path(struct pen *pen, const point2 *p, int n, bool closed, pen_style s)
{
    FILE *to = pen->page;
    fputs("<path class=\"", to);
    if (s.stroke != INK_NONE)
        fprintf(to, "s-%s", ink_class[s.stroke]);
    if (s.fill != INK_NONE)
        fprintf(to, "%sf-%s", s.stroke != INK_NONE ? " " : "", ink_class[s.fill]);
    static const char *const line[] = {"\"", " dash\"", " dot\""};
    fputs(line[s.line], to);
    if (s.stroke != INK_NONE)
        fprintf(to, " stroke-width=\"%.3g\"", s.width);
    if (s.fill != INK_NONE && s.opacity < 1)
        fprintf(to, " fill-opacity=\"%.2g\"", s.opacity);
    fputs(" d=\"", to);
    trace(to, p, n);
    fputs(closed ? "Z\"/>\n" : "\"/>\n", to);
}

static void page_text(struct pen *pen, point2 at, text_style s, const char *text)
{
    static const char *const anchor[] = {"start", "middle", "end"};
    FILE *to = pen->page;
    fprintf(to, "<text class=\"f-%s\" font-size=\"%.3g\" text-anchor=\"%s\"", ink_class[s.ink],
            s.size, anchor[s.align]);
    if (s.bold)
        fputs(" font-weight=\"600\"", to);
    if (s.upward)
        fprintf(to, " transform=\"translate(%.4g %.4g) rotate(-90)\">", at.x, at.y);
    else
        fprintf(to, " x=\"%.4g\" y=\"%.4g\">", at.x, at.y);
    rec_escaped(to, text);
    fputs("</text>\n", to);
}

static void page_picture(struct pen *pen, const struct picture *picture, point2 at, double width,
                         double height)
{
    fprintf(pen->page,
            "<image class=\"cells\" x=\"%.4g\" y=\"%.4g\" width=\"%.4g\" height=\"%.4g\" "
            "preserveAspectRatio=\"none\" href=\"data:image/png;base64,",
            at.x, at.y, width, height);
    rec_png_base64(pen->page, picture);
    fputs("\"/>\n", pen->page);
}

static void page_begin(struct pen *pen, const char *classes)
{
    fprintf(pen->page, "<g class=\"%s\">\n", classes);
}

static void page_end(struct pen *pen)
{
    fputs("</g>\n", pen->page);
}

struct pen rec_pen_page(FILE *page)
{
    return (struct pen){.path = page_path,
                        .text = page_text,
                        .picture = page_picture,
                        .begin = page_begin,
                        .end = page_end,
                        .page = page};
}
