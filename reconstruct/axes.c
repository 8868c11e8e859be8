/* axes.c -- Cartesian axes and what is drawn in them. */
#include "axes.h"

#include <stdlib.h>
#include <string.h>

enum { LETTERS = 11 };  // size of numbers and labels

double rec_axis_share(const struct axis *a, double value)
{
    if (a->scale == SCALE_LOG)
        return log(fmax(value, 1e-300) / a->low) / log(a->high / a->low);
    double share = (value - a->low) / (a->high - a->low);
    return a->scale == SCALE_ROOT ? sqrt(fmax(0, share)) : share;
}

point2 rec_axes_at(const struct axes *a, double x, double y)
{
    return (point2){a->left + a->width * rec_axis_share(&a->x, x),
                    a->top + a->height * (1 - rec_axis_share(&a->y, y))};
}

static void power_of_ten(char text[24], int exponent)
{
    static const char *const digit[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
    if (exponent >= -3 && exponent <= 4) {
        snprintf(text, 24, "%g", pow(10, exponent));
        return;
    }
    int size = exponent < 0 ? -exponent : exponent;
    snprintf(text, 24, "10%s%s%s", exponent < 0 ? "⁻" : "", size > 9 ? digit[size / 10 % 10] : "",
             digit[size % 10]);
}

// The nearest of 1, 2, 5 times a power of ten that is not below (above) a value.
static double round_number(double value, bool up)
{
    static const double step[] = {1, 2, 5, 10};
    double ten = pow(10, floor(log10(value) + 1e-9));
    int k = up ? 0 : 3;
    while (up ? step[k] * ten < value * (1 - 1e-9) : step[k] * ten > value * (1 + 1e-9))
        k += up ? 1 : -1;
    return step[k] * ten;
}

void rec_decades(double *low, double *high, int decades)
{
    *high = round_number(fmax(*high, 1e-12), true);
    *low = round_number(fmax(fmin(fmax(*low, 1e-12), *high / 4), *high / pow(10, decades)), false);
}

// Values of ticks, and whether each has a number. At most `room`.
static int ticks_of(const struct axis *a, double *value, bool *numbered, int room)
{
    int n = 0;
    if (a->scale == SCALE_LOG) {
        double decades = log10(a->high / a->low);
        bool many = decades < 4, most = decades < 2;
        for (int e = (int)floor(log10(a->low) + 1e-9); pow(10, e) <= a->high * 1.001; e++)
            for (int k = 1; k < 10 && n < room; k++) {
                double v = k * pow(10, e);
                bool shown = k == 1 || (many && (k == 2 || k == 5));
                if (!shown || v < a->low * 0.999 || v > a->high * 1.001)
                    continue;
                value[n] = v;
                numbered[n++] = k == 1 || most;
            }
        return n;
    }
    double raw = (a->high - a->low) / 5, ten = pow(10, floor(log10(raw)));
    double nice = raw / ten < 1.5 ? 1 : raw / ten < 3.5 ? 2 : raw / ten < 7.5 ? 5 : 10;
    double step = a->step > 0 ? a->step : nice * ten;
    static const double root[] = {0, 2, 10, 30, 60, 90};
    if (a->scale == SCALE_ROOT) {
        for (int i = 0; i < 6 && n < room; i++) {
            value[n] = root[i];
            numbered[n++] = true;
        }
        return n;
    }
    for (double v = ceil(a->low / step - 1e-9) * step; v <= a->high + 1e-9 * step && n < room;
         v += step) {
        value[n] = fabs(v) < 1e-9 * step ? 0 : v;
        numbered[n++] = true;
    }
    return n;
}

void rec_number(char text[24], double value)
{
    double e = log10(fmax(value, 1e-300));
    if (value > 0 && fabs(e - round(e)) < 1e-6)
        power_of_ten(text, (int)round(e));
    else
        snprintf(text, 24, "%.4g", value);
}

static void draw_ticks(struct pen *pen, const struct axes *a, bool horizontal, bool grid)
{
    enum { ROOM = 64 };
    double value[ROOM];
    bool numbered[ROOM];
    const struct axis *axis = horizontal ? &a->x : &a->y;
    int n = ticks_of(axis, value, numbered, ROOM);
    for (int i = 0; i < n; i++) {
        char text[24];
        point2 at =
            horizontal ? rec_axes_at(a, value[i], a->y.low) : rec_axes_at(a, a->x.low, value[i]);
        point2 end = horizontal ? (point2){at.x, grid ? a->top : at.y + 4}
                                : (point2){grid ? a->left + a->width : at.x - 4, at.y};
        rec_line(pen, at, end, grid ? INK_GRID : INK_FAINT, numbered[i] ? 0.75 : 0.4);
        rec_number(text, value[i]);
        if (!numbered[i] || !axis->label)
            continue;
        if (horizontal)
            rec_write(pen, (point2){at.x, at.y + 16}, ALIGN_MIDDLE, LETTERS, INK_FAINT, "%s", text);
        else
            rec_write(pen, (point2){at.x - 7, at.y + 4}, ALIGN_RIGHT, LETTERS, INK_FAINT, "%s",
                      text);
    }
}

void rec_axes_draw(struct pen *pen, const struct axes *a, bool grid)
{
    draw_ticks(pen, a, true, grid);
    draw_ticks(pen, a, false, grid);
    rec_box(pen, (point2){a->left, a->top}, a->width, a->height, INK_NONE, INK_FAINT);
    if (a->x.label)
        rec_write(pen, (point2){a->left + a->width / 2, a->top + a->height + 33}, ALIGN_MIDDLE,
                  LETTERS, INK_TEXT, "%s", a->x.label);
    if (a->y.label)
        pen->text(pen, (point2){a->left - 40, a->top + a->height / 2},
                  (text_style){ALIGN_MIDDLE, LETTERS, INK_TEXT, .upward = true}, a->y.label);
}

// Where the way from a to b crosses the height y.
static point2 crossing(point2 a, point2 b, double y)
{
    double t = (y - a.y) / (b.y - a.y);
    return (point2){a.x + t * (b.x - a.x), y};
}

void rec_axes_curve(struct pen *pen, const struct axes *a, const double *x, const double *y, int n,
                    pen_style style)
{
    point2 *p = malloc((4 * (size_t)n + 1) * sizeof *p), lift = {NAN, NAN};
    double top = a->top, bottom = a->top + a->height;
    int m = 0;
    for (int i = 0; p && i < n; i++) {
        bool number_here = isfinite(x[i]) && isfinite(y[i]);
        point2 here = number_here ? rec_axes_at(a, x[i], y[i]) : lift;
        bool inside = number_here && here.y >= top && here.y <= bottom;
        bool before = i > 0 && isfinite(x[i - 1]) && isfinite(y[i - 1]);
        point2 last = before ? rec_axes_at(a, x[i - 1], y[i - 1]) : lift;
        bool last_inside = before && last.y >= top && last.y <= bottom;
        if (inside && before && !last_inside)
            p[m++] = crossing(last, here, last.y < top ? top : bottom);
        if (inside)
            p[m++] = here;
        else if (number_here && last_inside)
            p[m++] = crossing(last, here, here.y < top ? top : bottom);
        if (!inside)
            p[m++] = lift;
    }
    if (p)
        pen->path(pen, p, m, false, style);
    free(p);
}

void rec_axes_band(struct pen *pen, const struct axes *a, const double *x, const double *low,
                   const double *high, int n, enum ink ink, double opacity)
{
    point2 *p = malloc((2 * (size_t)n + 1) * sizeof *p);
    for (int i = 0; p && i < n;) {
        int m = 0, end = i;
        while (end < n && isfinite(low[end]) && isfinite(high[end]))
            end++;
        for (int k = i; k < end; k++)
            p[m++] = rec_axes_at(a, x[k], fmin(fmax(high[k], a->y.low), a->y.high));
        for (int k = end - 1; k >= i; k--)
            p[m++] = rec_axes_at(a, x[k], fmin(fmax(low[k], a->y.low), a->y.high));
        if (m > 2)
            pen->path(pen, p, m, true, (pen_style){.fill = ink, .opacity = opacity});
        i = end + 1;
    }
    free(p);
}
