/* plot_file.c -- plots as files: PNG, SVG and PDF. */
#include "plot.h"

#include <cairo-pdf.h>
#include <cairo-svg.h>
#include <string.h>

enum { PIXELS_PER_POINT = 2, PANEL = 400, HEIGHT = 250, SIDE = 190, BALL = 300 };

static const char *ending(const char *path)
{
    const char *dot = strrchr(path, '.');
    return dot && !strchr(dot, '/') ? dot : "";
}

// ---- a plot of each kind: its size, then its strokes

struct sheet {
    const struct plot_source *source;
    int sources;
    const struct plot_options *options;
};

static int channels(const struct sheet *s)
{
    return s->options->channel[0] + s->options->channel[1] + s->options->channel[2];
}

static void lobes(struct pen *pen, const struct sheet *s)
{
    for (int i = 0; i < s->sources; i++)
        for (int k = 0; k < s->options->thetas; k++) {
            point2 at = {8 + k * PANEL, i * (2.2 * HEIGHT + 40) + 8};
            rec_write(pen, (point2){at.x + 8, at.y + 14}, ALIGN_LEFT, 12, INK_TEXT, "%s, θi = %g°",
                      s->source[i].name, s->options->theta_deg[k]);
            rec_plot_polar(pen, s->source + i, s->options, k, (point2){at.x, at.y + 18}, PANEL,
                           HEIGHT);
            rec_plot_cartesian(pen, s->source + i, s->options, k,
                               (point2){at.x, at.y + 24 + HEIGHT}, PANEL, 1.2 * HEIGHT);
        }
}

static void lobes_size(const struct sheet *s, double size[2])
{
    size[0] = 16 + PANEL * s->options->thetas;
    size[1] = (2.2 * HEIGHT + 40) * s->sources + 16;
}

static void slice(struct pen *pen, const struct sheet *s)
{
    for (int i = 0; i < s->sources; i++) {
        double y = i * (SIDE + 84) + 8;
        rec_write(pen, (point2){16, y + 12}, ALIGN_LEFT, 12, INK_TEXT, "%s, φd = %g°",
                  s->source[i].name, s->options->phi_d_deg);
        rec_plot_slice(pen, s->source + i, s->options, (point2){8, y + 14}, SIDE);
    }
}

static void slice_size(const struct sheet *s, double size[2])
{
    size[0] = 60 + (1 + channels(s)) * (SIDE + 18) + 60;
    size[1] = s->sources * (SIDE + 84) + 16;
}

static void coverage(struct pen *pen, const struct sheet *s)
{
    for (int i = 0; i < s->sources; i++) {
        double y = i * (SIDE + 120) + 8;
        rec_write(pen, (point2){16, y + 12}, ALIGN_LEFT, 12, INK_TEXT, "%s", s->source[i].name);
        rec_plot_coverage(pen, s->source + i, (point2){8, y + 20}, SIDE);
    }
}

static void coverage_size(const struct sheet *s, double size[2])
{
    size[0] = 2 * SIDE + 210;
    size[1] = s->sources * (SIDE + 120) + 8;
}

static void albedo(struct pen *pen, const struct sheet *s)
{
    for (int i = 0; i < s->sources; i++)
        rec_plot_albedo(pen, s->source + i, s->options, (point2){8 + i * PANEL, 8}, PANEL, HEIGHT);
}

static void albedo_size(const struct sheet *s, double size[2])
{
    size[0] = 16 + PANEL * s->sources;
    size[1] = HEIGHT + 16;
}

static void sphere(struct pen *pen, const struct sheet *s)
{
    int column = 0;
    for (int i = 0; i < s->sources; i++)
        for (int k = -1; k < (s->source[i].fits.count > 0 && s->options->fits > 0 ? 1 : 0); k++) {
            struct brdf fit = k >= 0 ? rec_plot_fit(s->source + i, k) : s->source[i].brdf;
            struct picture p =
                rec_sphere_picture(&fit, rec_sphere_lamp, 1, 2 * BALL, 0, s->options->threads);
            point2 at = {10 + column++ * (BALL + 10), 10};
            if (p.argb)
                pen->picture(pen, &p, at, BALL, BALL);
            rec_picture_free(&p);
            rec_write(pen, (point2){at.x + BALL / 2.0, at.y + BALL + 18}, ALIGN_MIDDLE, 12,
                      INK_TEXT, "%s%s%s", s->source[i].name, fit.model ? ", fit: " : "",
                      fit.model ? fit.model->name : "");
        }
}

static void sphere_size(const struct sheet *s, double size[2])
{
    int columns = 0;
    for (int i = 0; i < s->sources; i++)
        columns += s->source[i].fits.count > 0 && s->options->fits > 0 ? 2 : 1;
    size[0] = 10 + columns * (BALL + 10);
    size[1] = BALL + 36;
}

static void comparison(struct pen *pen, const struct sheet *s)
{
    rec_plot_comparison(pen, s->source, s->source + 1, s->options, (point2){8, 8}, SIDE);
}

static void comparison_size(const struct sheet *s, double size[2])
{
    size[0] = 3 * (SIDE + 18) + 170;
    size[1] = channels(s) * (SIDE + 64) + 24;
}

static const struct {
    void (*size)(const struct sheet *s, double size[2]);
    void (*draw)(struct pen *pen, const struct sheet *s);
} sheets[] = {
    [PLOT_LOBES] = {lobes_size, lobes},          [PLOT_SLICE] = {slice_size, slice},
    [PLOT_COVERAGE] = {coverage_size, coverage}, [PLOT_ALBEDO] = {albedo_size, albedo},
    [PLOT_SPHERE] = {sphere_size, sphere},       [PLOT_COMPARISON] = {comparison_size, comparison}};

// ---- files

static cairo_surface_t *surface_for(const char *end, const char *path, const double size[2])
{
    if (strcmp(end, ".svg") == 0)
        return cairo_svg_surface_create(path, size[0], size[1]);
    if (strcmp(end, ".pdf") == 0)
        return cairo_pdf_surface_create(path, size[0], size[1]);
    cairo_surface_t *s =
        cairo_image_surface_create(CAIRO_FORMAT_RGB24, (int)ceil(PIXELS_PER_POINT * size[0]),
                                   (int)ceil(PIXELS_PER_POINT * size[1]));
    cairo_surface_set_device_scale(s, PIXELS_PER_POINT, PIXELS_PER_POINT);
    return s;
}

static cairo_status_t draw(cairo_surface_t *surface, enum plot_kind kind, const struct sheet *s)
{
    cairo_t *cr = cairo_create(surface);
    struct pen pen = rec_pen_paper(cr);
    cairo_set_source_rgb(cr, 1, 1, 1);
    cairo_paint(cr);
    sheets[kind].draw(&pen, s);
    cairo_status_t made = cairo_status(cr);
    cairo_destroy(cr);
    return made;
}

static enum status usable(enum plot_kind kind, const struct sheet *s, const char *end,
                          const char *path, struct error *err)
{
    if (strcmp(end, ".png") != 0 && strcmp(end, ".svg") != 0 && strcmp(end, ".pdf") != 0)
        return cap_fail(err, STATUS_FORMAT, "%s: a plot's name ends with .png, .svg or .pdf", path);
    if (kind == PLOT_COMPARISON && s->sources != 2)
        return cap_fail(err, STATUS_DATA, "a comparison is of two BRDFs, not of %d", s->sources);
    for (int i = 0; kind == PLOT_COVERAGE && i < s->sources; i++)
        if (!s->source[i].status)
            return cap_fail(err, STATUS_DATA,
                            "%s: what was measured is told by the bins.h5 of a folder OUT only",
                            s->source[i].name);
    return STATUS_OK;
}

enum status rec_plot(enum plot_kind kind, const struct plot_source *source, int sources,
                     const struct plot_options *options, const char *path, struct error *err)
{
    struct sheet sheet = {source, sources, options};
    const char *end = ending(path);
    struct atomic_file file;
    enum status status = usable(kind, &sheet, end, path, err);
    if (!status)
        status = cap_file_begin(&file, path, false, err);
    if (status)
        return status;
    double size[2];
    sheets[kind].size(&sheet, size);
    cairo_surface_t *surface = surface_for(end, file.aside, size);
    cairo_status_t made = draw(surface, kind, &sheet);
    if (made == CAIRO_STATUS_SUCCESS && strcmp(end, ".png") == 0)
        made = cairo_surface_write_to_png(surface, file.aside);
    cairo_surface_finish(surface);
    if (made == CAIRO_STATUS_SUCCESS)
        made = cairo_surface_status(surface);
    cairo_surface_destroy(surface);
    if (made == CAIRO_STATUS_SUCCESS)
        return cap_file_commit(&file, err);
    cap_file_abandon(&file);
    return cap_fail(err, STATUS_IO, "%s: %s", path, cairo_status_to_string(made));
}
