/* report_plots.c -- the report's plots: lobes for several angles, slices, albedo, coverage. */
#include "report.h"

#include <stdlib.h>

enum { WIDTH = 520, POLAR = 300, CARTESIAN = 380, SIDE = 200 };

static int fits_shown(const struct report *r)
{
    return r->source.fits.count < PLOT_FITS ? r->source.fits.count : PLOT_FITS;
}

static void write_controls(const struct report *r)
{
    static const char *const channel[] = {"red", "green", "blue"};
    FILE *to = r->to;
    fputs("<div class=\"row\"><label>Light from <select id=\"theta\">", to);
    for (int k = 0; k < r->options.thetas; k++)
        fprintf(to, "<option value=\"%d\"%s>%g&deg;</option>", k, k == 3 ? " selected" : "",
                r->options.theta_deg[k]);
    fputs("</select></label>\n", to);
    for (int c = 0; c < 3; c++)
        fprintf(to,
                "<label><input type=\"checkbox\" data-hides=\"hide-%d\" checked> <span class=\"key "
                "k%d\"></span>%s</label>\n",
                c, c, channel[c]);
    for (int k = 0; k < fits_shown(r); k++)
        fprintf(to,
                "<label><input type=\"checkbox\" data-hides=\"hide-fit%d\"%s> <span class=\"key "
                "dashed f%d\"></span>%s</label>\n",
                k, k == 0 ? " checked" : "", k, r->source.fits.fit[k].model->name);
    fputs("</div>\n", to);
}

static void write_pair(const struct report *r, int k)
{
    char alt[256], more[200];
    double theta = r->options.theta_deg[k];
    fprintf(r->to, "<div class=\"plots\" data-theta=\"%d\"%s>\n", k, k == 3 ? "" : " hidden");
    snprintf(alt, sizeof alt,
             "Polar diagram of reflectance in the plane of incidence for light from %g degrees, "
             "table with bands of two standard errors, and fits.",
             theta);
    snprintf(more, sizeof more, "data-cut=\"%d\" data-kind=\"polar\" data-center=\"%d,%d\"", k,
             WIDTH / 2, POLAR - 20);
    struct pen pen = rec_report_svg(r, WIDTH, POLAR, alt, more);
    rec_plot_polar(&pen, &r->source, &r->options, k, (point2){0, 0}, WIDTH, POLAR);
    rec_report_svg_end(r);
    snprintf(alt, sizeof alt,
             "The same over the camera's angle, on a logarithmic scale, with the ratio of the fits "
             "to the table below.");
    snprintf(more, sizeof more,
             "data-cut=\"%d\" data-kind=\"cartesian\" data-center=\"0,0\" data-left=\"50\" "
             "data-width=\"%d\"",
             k, WIDTH - 60);
    pen = rec_report_svg(r, WIDTH, CARTESIAN, alt, more);
    rec_plot_cartesian(&pen, &r->source, &r->options, k, (point2){0, 0}, WIDTH, CARTESIAN);
    rec_report_svg_end(r);
    fputs("</div>\n", r->to);
}

void rec_report_lobes(const struct report *r)
{
    fputs("<figure id=\"lobes\" class=\"", r->to);
    for (int k = 1; k < PLOT_FITS; k++)
        fprintf(r->to, "hide-fit%d ", k);
    fputs("\">\n<h3>In the plane of incidence</h3>\n", r->to);
    write_controls(r);
    for (int k = 0; k < r->options.thetas; k++)
        write_pair(r, k);
    fputs("<p class=\"readout\" id=\"lobe-readout\">Point at a curve for its numbers.</p>\n"
          "<figcaption>The light comes along the arrow; negative angles are on its side. The "
          "table&rsquo;s lines are thick where it was measured, thin where it is filled; bands are "
          "two standard errors. Fits are dotted. Below: how far fits are from the table, and the "
          "table&rsquo;s two standard errors.</figcaption></figure>\n",
          r->to);
}

// ---- numbers under the pointer: every degree from -89 to 89

static json_t *numbers(const double *value, const double *over)
{
    json_t *list = json_array();
    for (int degree = -89; degree <= 89; degree++) {
        int i = 2 * (degree + 90) - 1;
        double v = over ? value[i] / over[i] : value[i];
        json_array_append_new(list, isfinite(v) ? json_real(v) : json_integer(0));
    }
    return list;
}

static json_t *cut_json(const struct report *r, struct cut *cut, int k)
{
    json_t *f = json_array(), *s = json_array(), *m = json_array(), *fits = json_array();
    json_t *names = json_array();
    rec_cut(cut, &r->source, &r->source.brdf, r->options.theta_deg[k]);
    for (int c = 0; c < 3; c++) {
        json_array_append_new(f, numbers(cut->f[c], NULL));
        json_array_append_new(s, numbers(cut->sigma[c], cut->f[c]));
    }
    for (int degree = -89; degree <= 89; degree++)
        json_array_append_new(
            m, json_integer(cut->status[2 * (degree + 90) - 1] == BIN_MEASURED ? 1 : 0));
    for (int n = 0; n < fits_shown(r); n++) {
        struct brdf fit = rec_plot_fit(&r->source, n);
        rec_cut(cut, &r->source, &fit, r->options.theta_deg[k]);
        json_array_append_new(fits, numbers(cut->f[1], NULL));
        json_array_append_new(names, json_string(fit.model->name));
    }
    return json_pack("{s:o, s:o, s:o, s:o, s:o}", "f", f, "s", s, "m", m, "fit", fits, "fits",
                     names);
}

json_t *rec_report_cuts(const struct report *r)
{
    json_t *list = json_array();
    struct cut *cut = malloc(sizeof *cut);
    for (int k = 0; cut && k < r->options.thetas; k++)
        json_array_append_new(list, cut_json(r, cut, k));
    free(cut);
    return list;
}

// ---- slices, albedo, coverage

void rec_report_slices(const struct report *r)
{
    char more[300];
    int n = snprintf(more, sizeof more, "data-slices='[");
    for (int k = 0; k < 4; k++)
        n += snprintf(more + n, sizeof more - (size_t)n, "%s{\"x\":%d,\"y\":20,\"side\":%d}",
                      k ? "," : "", 52 + k * (SIDE + 18), SIDE);
    snprintf(more + n, sizeof more - (size_t)n, "]'");
    fputs("<figure class=\"wide\"><h3>The slice at &phi;d = 90&deg;</h3><div class=\"scroll\" "
          "tabindex=\"0\" role=\"group\" aria-label=\"Slices of the table\">\n",
          r->to);
    struct pen pen = rec_report_svg(r, 52 + 4 * (SIDE + 18) + 50, SIDE + 62,
                                    "The table at phi_d of 90 degrees: theta_h to the right, "
                                    "theta_d upwards, in colour and for red, green and blue, on a "
                                    "logarithmic scale.",
                                    more);
    rec_plot_slice(&pen, &r->source, &r->options, (point2){0, 0}, SIDE);
    rec_report_svg_end(r);
    fputs("</div><p class=\"readout\">Point at a slice for its numbers.</p>\n"
          "<figcaption>&theta;h, the half vector's angle from the normal, by its square root; "
          "&theta;d, half the angle between light and camera. The highlight is at the left, "
          "Fresnel's rise at the top left, retro-reflection at the bottom. f in 1/sr, logarithmic."
          "</figcaption></figure>\n",
          r->to);
}

static void albedo_row(const struct report *r, json_t *at)
{
    json_t *value = json_object_get(at, "albedo"), *sigma = json_object_get(at, "sigma");
    json_t *filled = json_object_get(at, "not_measured");
    fprintf(r->to, "<tr><th scope=\"row\">%g&deg;</th>",
            json_number_value(json_object_get(at, "theta_i_deg")));
    for (size_t c = 0; c < 3; c++)
        fprintf(r->to, "<td class=\"n\">%.4f <span class=\"pm\">&plusmn; %.4f</span></td>",
                json_number_value(json_array_get(value, c)),
                json_number_value(json_array_get(sigma, c)));
    double green = json_number_value(json_array_get(value, 1));
    fprintf(r->to, "<td class=\"n\">%.0f %%</td></tr>\n",
            green > 0 ? 100 * (1 - json_number_value(json_array_get(filled, 1)) / green) : 0);
}

void rec_report_albedo(const struct report *r)
{
    json_t *list = json_object_get(json_object_get(r->story, "checks"), "directional_albedo"), *at;
    size_t i;
    fputs("<h3>How much light leaves</h3><div class=\"two\"><figure>\n", r->to);
    struct pen pen = rec_report_svg(r, WIDTH, POLAR,
                                    "Directional albedo of the table and of the best fit, dashed, "
                                    "over the light's angle.",
                                    "");
    rec_plot_albedo(&pen, &r->source, &r->options, (point2){0, 0}, WIDTH, POLAR);
    rec_report_svg_end(r);
    fputs("<figcaption>Directional albedo of the table (solid) and of the best fit (dashed). "
          "Physics allows no more than 1.</figcaption></figure>\n",
          r->to);
    if (json_array_size(list) > 0) {
        fputs("<div class=\"scroll\" tabindex=\"0\" role=\"group\" aria-label=\"Albedo\"><table>"
              "<caption>Directional albedo, and how much of it was measured</caption><thead><tr>"
              "<th scope=\"col\">&theta;i</th><th scope=\"col\" class=\"n\">red</th><th "
              "scope=\"col\" class=\"n\">green</th><th scope=\"col\" class=\"n\">blue</th><th "
              "scope=\"col\" class=\"n\">measured</th></tr></thead><tbody>\n",
              r->to);
        json_array_foreach(list, i, at) albedo_row(r, at);
        fputs("</tbody></table></div>\n", r->to);
    }
    fputs("</div>\n", r->to);
}

static void count_row(const struct report *r, const char *name, const char *means, double count,
                      double all)
{
    fprintf(r->to,
            "<tr><th scope=\"row\">%s</th><td class=\"n\">%.0f</td><td class=\"n\">%.1f %%</td>"
            "<td>%s</td></tr>\n",
            name, count, all > 0 ? 100 * count / all : 0, means);
}

static void write_counts(const struct report *r)
{
    double of[4] = {0};
    for (int i = 0; i < MERL_BINS; i++)
        of[r->source.status[i]]++;
    double all = of[BIN_MEASURED] + of[BIN_INTERPOLATED] + of[BIN_EXTRAPOLATED];
    fputs(
        "<div class=\"scroll\" tabindex=\"0\" role=\"group\" aria-label=\"Bins by status\"><table>"
        "<caption>Bins of the table</caption><thead><tr><th scope=\"col\">status</th><th "
        "scope=\"col\" class=\"n\">bins</th><th scope=\"col\" class=\"n\">part</th><th "
        "scope=\"col\">where the value is from</th></tr></thead><tbody>\n",
        r->to);
    count_row(r, "measured", "photosites, moved to the bin's middle by the fit's slope",
              of[BIN_MEASURED], all);
    count_row(r, "interpolated", "the mirror bin, or measured bins around", of[BIN_INTERPOLATED],
              all);
    count_row(r, "extrapolated", "the best fit, times what neighbours say", of[BIN_EXTRAPOLATED],
              all);
    fputs("</tbody></table></div>\n", r->to);
}

// Why photosites that see the sample were not used.
static void write_photosites(const struct report *r)
{
    static const struct {
        const char *fate, *means;
    } fates[] = {{"used", "became samples"},
                 {"dark", "the lamp is below their horizon"},
                 {"outline", "within a photosite of the sample's outline"},
                 {"terminator", "within a photosite of where the lamp sets"},
                 {"shadowed", "something keeps the lamp's light off"},
                 {"occluded", "something stands before the sample"},
                 {"bounced", "taking out the board's light leaves too little"},
                 {"saturated", "in every frame of the bracket"},
                 {"unusable", "no number"},
                 {"stray", "far from their neighbours: dust, scratches, flare"}};
    const char *key;
    json_t *count, *counts = json_object_get(r->story, "photosites");
    double all = 0;
    json_object_foreach(counts, key, count) all += json_number_value(count);
    if (!(all > 0))
        return;
    fputs("<div class=\"scroll\" tabindex=\"0\" role=\"group\" aria-label=\"Photosites by fate\">"
          "<table><caption>Photosites that see the sample</caption><thead><tr><th scope=\"col\">"
          "fate</th><th scope=\"col\" class=\"n\">photosites</th><th scope=\"col\" class=\"n\">part"
          "</th><th scope=\"col\">meaning</th></tr></thead><tbody>\n",
          r->to);
    for (size_t i = 0; i < sizeof fates / sizeof *fates; i++) {
        double n = rec_report_number(r, "photosites", fates[i].fate, NULL);
        if (n > 0)
            count_row(r, fates[i].fate, fates[i].means, n, all);
    }
    fputs("</tbody></table></div>\n", r->to);
}

void rec_report_coverage(const struct report *r)
{
    if (!r->source.status) {
        fputs("<p>There is no bins.h5 beside the table: what was measured is not known.</p>\n",
              r->to);
        return;
    }
    fputs("<figure class=\"middle\"><div class=\"scroll\" tabindex=\"0\" role=\"group\" "
          "aria-label=\"Coverage\">\n",
          r->to);
    struct pen pen = rec_report_svg(r, 2 * SIDE + 175, SIDE + 84,
                                    "Which pairs of light and camera angle, and which half and "
                                    "difference angles, were measured, mirrored, or extrapolated.",
                                    "");
    rec_plot_coverage(&pen, &r->source, (point2){0, 0}, SIDE);
    rec_report_svg_end(r);
    fputs("</div><figcaption>The fuller the colour, the more of a cell's bins were measured, over "
          "all azimuths.</figcaption></figure>\n<div class=\"two\">",
          r->to);
    write_counts(r);
    write_photosites(r);
    fputs("</div>\n", r->to);
}
