/* report.c -- report.html: the skeleton in report/report.html, with each mark <!--@name--> replaced
 * by what a function of that name writes. */
#include "report.h"

#include "report_assets.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

double rec_report_number(const struct report *r, ...)
{
    va_list keys;
    json_t *at = r->story;
    va_start(keys, r);
    for (const char *key; (key = va_arg(keys, const char *));)
        at = json_object_get(at, key);
    va_end(keys);
    return json_is_number(at) ? json_number_value(at) : NAN;
}

struct pen rec_report_svg(const struct report *r, double width, double height, const char *alt,
                          const char *more)
{
    fprintf(r->to, "<svg viewBox=\"0 0 %g %g\" role=\"img\" aria-label=\"", width, height);
    rec_escaped(r->to, alt);
    fprintf(r->to, "\"%s%s>\n", *more ? " " : "", more);
    return rec_pen_page(r->to);
}

void rec_report_svg_end(const struct report *r)
{
    fputs("</svg>\n", r->to);
}

// ---- marks

static void write_title(const struct report *r)
{
    fputs("<title>", r->to);
    rec_escaped(r->to, r->source.name);
    fputs(": BRDF report</title>\n", r->to);
}

static void write_style(const struct report *r)
{
    fprintf(r->to, "<style>\n%s</style>\n", rec_asset_style_css);
}

static void write_heading(const struct report *r)
{
    fputs("<h1>", r->to);
    rec_escaped(r->to, r->source.name);
    fputs("</h1>\n", r->to);
    const char *capture =
        json_string_value(json_object_get(json_object_get(r->story, "options"), "capture"));
    if (capture) {
        fputs("<p class=\"note\">BRDF measured from ", r->to);
        rec_escaped(r->to, capture);
        fputs("</p>\n", r->to);
    }
}

// Where there is no WebGL2: the table, and beside it the best fit.
static void write_still(const struct report *r)
{
    const int size = 300;
    struct picture both = rec_picture_make(2 * size + 10, size);
    for (int k = 0; both.argb && k < (r->source.fits.count > 0 ? 2 : 1); k++) {
        struct brdf brdf = k > 0 ? rec_plot_fit(&r->source, 0) : r->source.brdf;
        struct picture ball =
            rec_sphere_picture(&brdf, rec_sphere_lamp, 1, size, 0, r->options.threads);
        for (int y = 0; ball.argb && y < size; y++)
            memcpy(both.argb + y * both.width + k * (size + 10), ball.argb + y * size,
                   (size_t)size * sizeof *ball.argb);
        rec_picture_free(&ball);
    }
    fputs("<img id=\"still\" hidden style=\"aspect-ratio:auto\" alt=\"Balls of the material under "
          "one lamp: the table",
          r->to);
    fputs(r->source.fits.count > 0 ? ", and beside it the best fit\" src=\"data:image/png;base64,"
                                   : "\" src=\"data:image/png;base64,",
          r->to);
    if (both.argb)
        rec_png_base64(r->to, &both);
    fputs("\">\n", r->to);
    rec_picture_free(&both);
}

static void write_data(const struct report *r)
{
    json_t *data =
        json_pack("{s:o, s:o}", "rig", rec_report_rig_data(r), "cuts", rec_report_cuts(r));
    fputs("<script type=\"application/json\" id=\"data\">", r->to);
    json_dumpf(data, r->to, JSON_COMPACT | JSON_REAL_PRECISION(5) | JSON_ESCAPE_SLASH);
    fputs("</script>\n", r->to);
    json_decref(data);
    rec_report_tables(r);
}

static void write_script(const struct report *r)
{
    static const char *const scripts[] = {rec_asset_tables_js, rec_asset_viewer_js,
                                          rec_asset_rig_js, rec_asset_page_js};
    for (int i = 0; i < 4; i++)
        fprintf(r->to, "<script>\n%s</script>\n", scripts[i]);
}

static const struct {
    const char *name;
    void (*write)(const struct report *report);
} marks[] = {
    {"title", write_title},
    {"style", write_style},
    {"heading", write_heading},
    {"verdict", rec_report_verdict},
    {"still", write_still},
    {"lobes", rec_report_lobes},
    {"slices", rec_report_slices},
    {"albedo", rec_report_albedo},
    {"coverage", rec_report_coverage},
    {"fits", rec_report_fits},
    {"predictions", rec_report_predictions},
    {"rig", rec_report_rig},
    {"photographs", rec_report_photographs},
    {"provenance", rec_report_provenance},
    {"script", write_script},
    {"data", write_data},
};

enum { MARKS = sizeof marks / sizeof *marks, DATA = MARKS - 1 };

static bool write_section(char **text, int mark, const struct report *r)
{
    size_t size;
    struct report section = *r;
    section.to = open_memstream(text, &size);
    if (section.to)
        marks[mark].write(&section);
    return section.to && !ferror(section.to) && fclose(section.to) == 0;
}

// What stands in place of the marks, in memory. The data takes as long as all the rest, and has
// work for all threads by itself; the others are made beside each other, the longest, which are
// the last ones, first.
static bool write_sections(char *text[MARKS], const struct report *r)
{
    bool good = write_section(&text[DATA], DATA, r);
#pragma omp parallel for schedule(dynamic, 1) num_threads(r->options.threads) reduction(&& : good)
    for (int i = DATA - 1; i >= 0; i--)
        good = write_section(&text[i], i, r) && good;
    return good;
}

static void write_mark(FILE *to, char *const text[MARKS], const char *name, size_t length)
{
    for (int i = 0; i < MARKS; i++)
        if (strlen(marks[i].name) == length && strncmp(marks[i].name, name, length) == 0)
            fputs(text[i], to);
}

static enum status write_page(const struct report *r, struct error *err)
{
    static const char begin[] = "<!--@", end[] = "-->";
    const char *at = rec_asset_report_html, *mark;
    char *text[MARKS] = {NULL};
    enum status status = STATUS_OK;
    if (!write_sections(text, r))
        status = cap_fail(err, STATUS_MEMORY, "%s: no memory for the report", r->out);
    while (!status && (mark = strstr(at, begin))) {
        const char *name = mark + strlen(begin), *stop = strstr(name, end);
        fwrite(at, 1, (size_t)(mark - at), r->to);
        write_mark(r->to, text, name, (size_t)(stop - name));
        at = stop + strlen(end);
    }
    fputs(at, r->to);
    for (int i = 0; i < MARKS; i++)
        free(text[i]);
    return status;
}

// ---- files

static enum status read_story(json_t **story, const char *path, struct error *err)
{
    json_error_t why;
    *story = access(path, R_OK) == 0 ? json_load_file(path, 0, &why) : json_null();
    return *story ? STATUS_OK
                  : cap_fail(err, STATUS_FORMAT, "%s: line %d: %s", path, why.line, why.text);
}

static enum status read_all(struct report *r, struct error *err)
{
    char *story = cap_path(r->out, "run.json");
    char *calibration = cap_path(r->out, "calibration.yaml");
    enum status status = story && calibration
                             ? rec_plot_source_read(&r->source, r->out, err)
                             : cap_fail(err, STATUS_MEMORY, "%s: no memory to read it", r->out);
    if (!status)
        status = read_story(&r->story, story, err);
    if (!status && access(calibration, R_OK) == 0)
        status = cal_calibration_read(&r->calibration, calibration, err);
    free(story);
    free(calibration);
    return status;
}

enum status rec_report(const char *out, int threads, struct error *err)
{
    struct report r = {.out = out,
                       .options = {.theta_deg = {0, 15, 30, 45, 60, 75, 85},
                                   .thetas = 7,
                                   .channel = {true, true, true},
                                   .fits = PLOT_FITS,
                                   .phi_d_deg = 90,
                                   .threads = threads > 0 ? threads : 1}};
    char *path = cap_path(out, "report.html");
    struct atomic_file file;
    enum status status =
        path ? read_all(&r, err) : cap_fail(err, STATUS_MEMORY, "%s: no memory", out);
    if (!status)
        status = cap_file_begin(&file, path, true, err);
    if (!status) {
        r.to = file.stream;
        status = write_page(&r, err);
        if (status)
            cap_file_abandon(&file);
        else
            status = cap_file_commit(&file, err);  // it knows of writes that failed
    }
    rec_plot_source_free(&r.source);
    cal_calibration_free(&r.calibration);
    json_decref(r.story);
    free(path);
    return status;
}
