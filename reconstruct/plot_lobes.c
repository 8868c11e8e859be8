/* plot_lobes.c -- f in the plane of incidence: as a polar diagram, and over theta_o with the
 * ratio to the table below it.
 *
 * A thick line is measured, a thin one filled; fits are dotted. Bands are two standard errors.
 */
#include "plot.h"

#include <stdlib.h>
#include <string.h>

static const double degree = CAP_PI / 180;
static const enum ink channel_ink[3] = {INK_RED, INK_GREEN, INK_BLUE};

// Directions with the light at theta_i on the left, in the plane of incidence.
static void directions(double theta_i, double theta_o, vec3 *wi, vec3 *wo)
{
    *wi = (vec3){-sin(theta_i), 0, cos(theta_i)};
    *wo = (vec3){sin(theta_o), 0, cos(theta_o)};
}

void rec_cut(struct cut *lobe, const struct plot_source *source, const struct brdf *of,
             double theta_i_deg)
{
    lobe->theta_i_deg = theta_i_deg;
    bool table = of == &source->brdf;
    for (int i = 0; i < CUT_POINTS; i++) {
        vec3 wi, wo;
        double f[3];
        lobe->theta_o_deg[i] = -90 + 0.5 * (i + 1);
        directions(theta_i_deg * degree, lobe->theta_o_deg[i] * degree, &wi, &wo);
        rec_brdf_eval(of, wi, wo, f);
        int bin = rec_merl_index(rec_half_diff(wi, wo));
        const struct bin *b = table && source->bin_at && source->bin_at[bin] >= 0
                                  ? &source->bins.bin[source->bin_at[bin]]
                                  : NULL;
        lobe->status[i] = table && source->status ? source->status[bin] : BIN_MEASURED;
        for (int c = 0; c < 3; c++) {
            lobe->f[c][i] = f[c];
            lobe->sigma[c][i] = b && b->mean[c] > 0 ? f[c] * b->sigma[c] / b->mean[c] : NAN;
        }
    }
}

void rec_cut_range(double *low, double *high, const struct plot_source *source,
                   const struct plot_options *o, int k)
{
    *low = INFINITY;
    *high = 0;
    for (double theta_o = -80; theta_o <= 80; theta_o += 0.5) {
        vec3 wi, wo;
        double f[3];
        directions(o->theta_deg[k] * degree, theta_o * degree, &wi, &wo);
        rec_brdf_eval(&source->brdf, wi, wo, f);
        for (int c = 0; c < 3; c++) {
            *high = fmax(*high, o->channel[c] ? f[c] : 0);
            *low = o->channel[c] && f[c] > 0 ? fmin(*low, f[c]) : *low;
        }
    }
    *low *= 0.7;
    rec_decades(low, high, 4);
}

// ---- polar

struct disc {
    point2 center;
    double radius, low, high;
};

static point2 on_disc(const struct disc *d, double theta_deg, double f)
{
    double r = d->radius * log(fmin(fmax(f, d->low), d->high) / d->low) / log(d->high / d->low);
    return (point2){d->center.x + r * sin(theta_deg * degree),
                    d->center.y - r * cos(theta_deg * degree)};
}

static void arc(struct pen *pen, const struct disc *d, double f, double width)
{
    enum { STEPS = 60 };
    point2 p[STEPS + 1];
    for (int i = 0; i <= STEPS; i++)
        p[i] = on_disc(d, -90 + 180.0 * i / STEPS, f);
    pen->path(pen, p, STEPS + 1, false, (pen_style){.stroke = INK_GRID, .width = width});
}

static void draw_ring(struct pen *pen, const struct disc *d, double f)
{
    char text[24];
    arc(pen, d, f, f == d->high ? 1 : 0.75);
    rec_number(text, f);
    for (int side = -1; side <= 1; side += 2) {
        point2 at = on_disc(d, 90 * side, f);
        rec_write(pen, (point2){at.x, at.y + 14}, ALIGN_MIDDLE, 10, INK_FAINT, "%s", text);
    }
}

static void draw_disc(struct pen *pen, const struct disc *d, double theta_i_deg)
{
    for (int e = (int)ceil(log10(d->low) + 0.2); pow(10, e) < d->high * 0.45; e++)
        draw_ring(pen, d, pow(10, e));
    draw_ring(pen, d, d->high);
    for (int theta = -90; theta <= 90; theta += 30) {
        point2 edge = on_disc(d, theta, d->high);
        double x = sin(theta * degree), y = cos(theta * degree);
        rec_line(pen, d->center, edge, INK_GRID, 0.75);
        if (abs(theta) < 90)
            rec_write(pen, (point2){edge.x + 13 * x, edge.y - 9 * y + 3}, ALIGN_MIDDLE, 10,
                      INK_FAINT, "%d°", theta);
    }
    // The light comes in along an arrow.
    point2 from = on_disc(d, -theta_i_deg, d->high), to = d->center;
    double x = (from.x - to.x) / d->radius, y = (from.y - to.y) / d->radius;
    point2 tip[] = {{to.x + 2 * x, to.y + 2 * y},
                    {to.x + 11 * x - 4 * y, to.y + 11 * y + 4 * x},
                    {to.x + 11 * x + 4 * y, to.y + 11 * y - 4 * x}};
    rec_line(pen, from, (point2){to.x + 8 * x, to.y + 8 * y}, INK_LAMP, 1.75);
    pen->path(pen, tip, 3, true, (pen_style){.fill = INK_LAMP, .opacity = 1});
}

static void polar_band(struct pen *pen, const struct disc *d, const struct cut *l, int c)
{
    point2 p[2 * CUT_POINTS];
    for (int i = 0; i < CUT_POINTS;) {
        int m = 0, end = i;
        while (end < CUT_POINTS && isfinite(l->sigma[c][end]))
            end++;
        for (int k = i; k < end; k++)
            p[m++] = on_disc(d, l->theta_o_deg[k], l->f[c][k] + 2 * l->sigma[c][k]);
        for (int k = end - 1; k >= i; k--)
            p[m++] = on_disc(d, l->theta_o_deg[k], l->f[c][k] - 2 * l->sigma[c][k]);
        if (m > 2)
            pen->path(pen, p, m, true, (pen_style){.fill = channel_ink[c], .opacity = 0.25});
        i = end + 1;
    }
}

// The points whose status is `measured` or not; a span reaches to the first point of the next.
static void polar_curve(struct pen *pen, const struct disc *d, const struct cut *l, int c,
                        bool measured, pen_style style)
{
    point2 p[CUT_POINTS];
    for (int i = 0; i < CUT_POINTS; i++) {
        bool here = (l->status[i] == BIN_MEASURED) == measured;
        bool before = i > 0 && (l->status[i - 1] == BIN_MEASURED) == measured;
        p[i] = here || before ? on_disc(d, l->theta_o_deg[i], l->f[c][i]) : (point2){NAN, NAN};
    }
    pen->path(pen, p, CUT_POINTS, false, style);
}

static void begin(struct pen *pen, const char *kind, int k)
{
    char classes[48];
    snprintf(classes, sizeof classes, "%s %s%d", kind, kind, k);
    pen->begin(pen, classes);
}

static void polar_fits(struct pen *pen, const struct plot_source *s, const struct plot_options *o,
                       const struct disc *d, struct cut *l)
{
    for (int k = 0; k < o->fits && k < s->fits.count && k < PLOT_FITS; k++) {
        struct brdf fit = rec_plot_fit(s, k);
        rec_cut(l, s, &fit, l->theta_i_deg);
        begin(pen, "fit", k);
        for (int c = 0; c < 3; c++)
            if (o->channel[c]) {
                begin(pen, "ch", c);
                polar_curve(pen, d, l, c, true,
                            (pen_style){.stroke = INK_FIT0 + k, .width = 1.3, .line = LINE_DOTTED});
                pen->end(pen);
            }
        pen->end(pen);
    }
}

void rec_plot_polar(struct pen *pen, const struct plot_source *s, const struct plot_options *o,
                    int k, point2 at, double width, double height)
{
    struct disc d = {.center = {at.x + width / 2, at.y + height - 20}};
    d.radius = fmin(width / 2 - 26, height - 38);
    rec_cut_range(&d.low, &d.high, s, o, k);
    draw_disc(pen, &d, o->theta_deg[k]);
    struct cut *l = malloc(sizeof *l);
    for (int c = 0; l && c < 3; c++) {
        if (!o->channel[c])
            continue;
        rec_cut(l, s, &s->brdf, o->theta_deg[k]);
        begin(pen, "ch", c);
        polar_band(pen, &d, l, c);
        polar_curve(pen, &d, l, c, false, (pen_style){.stroke = channel_ink[c], .width = 1});
        polar_curve(pen, &d, l, c, true, (pen_style){.stroke = channel_ink[c], .width = 3});
        pen->end(pen);
    }
    if (l)
        polar_fits(pen, s, o, &d, l);
    free(l);
}

// ---- over theta_o

// Values of one kind of status; a span reaches to the first point of the next.
static void select_status(double *to, const struct cut *l, const double *from, bool measured)
{
    for (int i = 0; i < CUT_POINTS; i++) {
        bool here = (l->status[i] == BIN_MEASURED) == measured;
        bool before = i > 0 && (l->status[i - 1] == BIN_MEASURED) == measured;
        to[i] = here || before ? from[i] : NAN;
    }
}

static void cartesian_table(struct pen *pen, const struct axes *value, const struct axes *ratio,
                            const struct cut *l, int c)
{
    double low[CUT_POINTS], high[CUT_POINTS], y[CUT_POINTS];
    const double *x = l->theta_o_deg, *f = l->f[c], *sigma = l->sigma[c];
    enum ink ink = channel_ink[c];
    begin(pen, "ch", c);
    for (int i = 0; i < CUT_POINTS; i++) {
        low[i] = f[i] - 2 * sigma[i];
        high[i] = f[i] + 2 * sigma[i];
    }
    rec_axes_band(pen, value, x, low, high, CUT_POINTS, ink, 0.25);
    select_status(y, l, f, false);
    rec_axes_curve(pen, value, x, y, CUT_POINTS, (pen_style){.stroke = ink, .width = 1});
    select_status(y, l, f, true);
    rec_axes_curve(pen, value, x, y, CUT_POINTS, (pen_style){.stroke = ink, .width = 3});
    for (int i = 0; i < CUT_POINTS; i++) {
        low[i] = -200 * sigma[i] / f[i];
        high[i] = -low[i];
    }
    rec_axes_band(pen, ratio, x, low, high, CUT_POINTS, ink, 0.25);
    pen->end(pen);
}

static void cartesian_fits(struct pen *pen, const struct plot_source *s,
                           const struct plot_options *o, const struct axes *value,
                           const struct axes *ratio, const struct cut *table, struct cut *l)
{
    double y[CUT_POINTS];
    for (int k = 0; k < o->fits && k < s->fits.count && k < PLOT_FITS; k++) {
        struct brdf fit = rec_plot_fit(s, k);
        pen_style style = {.stroke = INK_FIT0 + k, .width = 1.3, .line = LINE_DOTTED};
        rec_cut(l, s, &fit, table->theta_i_deg);
        begin(pen, "fit", k);
        for (int c = 0; c < 3; c++) {
            if (!o->channel[c])
                continue;
            begin(pen, "ch", c);
            rec_axes_curve(pen, value, l->theta_o_deg, l->f[c], CUT_POINTS, style);
            for (int i = 0; i < CUT_POINTS; i++)
                y[i] = table->f[c][i] > 0 ? 100 * (l->f[c][i] / table->f[c][i] - 1) : NAN;
            rec_axes_curve(pen, ratio, l->theta_o_deg, y, CUT_POINTS, style);
            pen->end(pen);
        }
        pen->end(pen);
    }
}

void rec_plot_cartesian(struct pen *pen, const struct plot_source *s, const struct plot_options *o,
                        int k, point2 at, double width, double height)
{
    const double below = 0.26 * height;
    struct axis x = {SCALE_LINEAR, -90, 90, 30, "θo in degrees; the light is at the left"};
    struct axes value = {.x = x,
                         .y = {.scale = SCALE_LOG, .label = "f in 1/sr"},
                         .left = at.x + 50,
                         .top = at.y + 8,
                         .width = width - 60,
                         .height = height - below - 64};
    struct axes ratio = value;
    ratio.top = value.top + value.height + 18;
    ratio.height = below;
    ratio.y = (struct axis){SCALE_LINEAR, -10, 10, 5, "fit/table - 1, %"};
    value.x.label = NULL;
    rec_cut_range(&value.y.low, &value.y.high, s, o, k);
    rec_axes_draw(pen, &value, true);
    rec_axes_draw(pen, &ratio, true);
    struct cut *l = malloc(2 * sizeof *l);
    if (l)
        rec_cut(l, s, &s->brdf, o->theta_deg[k]);
    for (int c = 0; l && c < 3; c++)
        if (o->channel[c])
            cartesian_table(pen, &value, &ratio, l, c);
    if (l)
        cartesian_fits(pen, s, o, &value, &ratio, l, l + 1);
    free(l);
}
