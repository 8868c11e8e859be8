/* pen.h -- what plots are drawn with: the same strokes on paper (PNG, SVG, PDF, by cairo) and in
 * the report (SVG elements with classes, which the page's style colours for light and dark).
 *
 * Lengths are points on paper and CSS pixels in the page; x right, y down, from the top left.
 */
#ifndef GONIOCAM_PEN_H
#define GONIOCAM_PEN_H

#include "program.h"

#include <cairo.h>

/** What a stroke stands for, rather than its colour: name, class in the page, colour on paper. */
#define INK_LIST(X)                                                                                \
    X(NONE, "none", 0xffffff)                                                                      \
    X(TEXT, "ink", 0x1b1f24)                                                                       \
    X(FAINT, "faint", 0x59636e)                                                                    \
    X(GRID, "grid", 0xd5dae0)                                                                      \
    X(RED, "red", 0xc4302b)                                                                        \
    X(GREEN, "green", 0x1f7a35)                                                                    \
    X(BLUE, "blue", 0x2759c4)                                                                      \
    X(FIT0, "fit0", 0x111418)                                                                      \
    X(FIT1, "fit1", 0xb35900)                                                                      \
    X(FIT2, "fit2", 0x7a3ea8)                                                                      \
    X(FIT3, "fit3", 0x00757f)                                                                      \
    X(FIT4, "fit4", 0x9a3b6b)                                                                      \
    X(MEASURED, "measured", 0x0f7fa8)                                                              \
    X(MIRRORED, "mirrored", 0xe09f1f)                                                              \
    X(SPARSE, "sparse", 0xa6d4e6)                                                                  \
    X(FILLED, "filled", 0x8b949e)                                                                  \
    X(LAMP, "lamp", 0x8a6200)

#define INK_ENUM(name, class, rgb) INK_##name,
enum ink { INK_LIST(INK_ENUM) INKS };
#undef INK_ENUM
/** 0xRRGGBB on paper. */
uint32_t rec_ink_rgb(enum ink ink);

typedef struct {
    double x, y;
} point2;

typedef struct {
    enum ink stroke, fill;
    double width;    // of the stroke
    double opacity;  // of the fill
    enum { LINE_SOLID, LINE_DASHED, LINE_DOTTED } line;
} pen_style;

enum align { ALIGN_LEFT, ALIGN_MIDDLE, ALIGN_RIGHT };
typedef struct {
    enum align align;
    double size;  // of the letters
    enum ink ink;
    bool upward;  // reads from bottom to top
    bool bold;
} text_style;

/** A picture of width x height pixels, rows from the top, 0xAARRGGBB and not premultiplied. Owns
 *  argb; {0} is empty; rec_picture_free(). */
struct picture {
    int width, height;
    uint32_t *argb;  // [height][width]
};
/** Transparent. argb is NULL where there is no memory. */
struct picture rec_picture_make(int width, int height);
void rec_picture_free(struct picture *picture);
static inline uint32_t rec_argb(uint32_t rgb)
{
    return 0xff000000u | rgb;
}

/** A pen on some medium. A point with x NAN lifts it. */
struct pen {
    void (*path)(struct pen *pen, const point2 *p, int n, bool closed, pen_style style);
    void (*text)(struct pen *pen, point2 at, text_style style, const char *text);
    /** Fill a rectangle with a picture; its pixels stay sharp squares. */
    void (*picture)(struct pen *pen, const struct picture *picture, point2 at, double width,
                    double height);
    /** A group that the page can hide or show by its classes; on paper, nothing. */
    void (*begin)(struct pen *pen, const char *classes);
    void (*end)(struct pen *pen);

    cairo_t *cr;  // on paper
    FILE *page;   // in the page
};

/** A pen on paper; cr is borrowed. */
struct pen rec_pen_paper(cairo_t *cr);
/** A pen in a page. */
struct pen rec_pen_page(FILE *page);

void rec_line(struct pen *pen, point2 a, point2 b, enum ink ink, double width);
void rec_box(struct pen *pen, point2 at, double width, double height, enum ink fill,
             enum ink stroke);
void rec_circle(struct pen *pen, point2 center, double radius, pen_style style);
void rec_write(struct pen *pen, point2 at, enum align align, double size, enum ink ink,
               const char *format, ...) __attribute__((format(printf, 6, 7)));

/** A picture as the text of a PNG file in base 64, for a page. false: the stream failed or no
 *  memory. */
bool rec_png_base64(FILE *to, const struct picture *picture);
/** Any bytes in base 64. */
void rec_base64(FILE *to, const unsigned char *data, size_t size);
/** Text with <, >, & and quotes as entities. */
void rec_escaped(FILE *to, const char *text);

#endif
