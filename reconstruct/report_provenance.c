/* report_provenance.c -- where the numbers are from: version, options, hash of the inputs, times.
 */
#include "report.h"

static void row(const struct report *r, const char *name, const char *value, const char *class)
{
    fprintf(r->to, "<tr><th scope=\"row\">%s</th><td class=\"%s\">", name, class);
    rec_escaped(r->to, value);
    fputs("</td></tr>\n", r->to);
}

static void write_options(const struct report *r)
{
    const char *key;
    json_t *value;
    json_object_foreach(json_object_get(r->story, "options"), key, value)
    {
        char number[32];
        if (json_is_string(value))
            row(r, key, json_string_value(value), "hash");
        if (json_is_number(value)) {
            snprintf(number, sizeof number, "%g", json_number_value(value));
            row(r, key, number, "text");
        }
    }
}

static void write_checks(const struct report *r)
{
    static const struct {
        const char *name, *check, *value, *sigma;
    } checks[] = {
        {"Reciprocity: f(i,o) against f(o,i)", "reciprocity", "mean_relative", "sigma"},
        {"Isotropy: change with the azimuth on the sample", "isotropy", "rms_relative", "sigma"},
        {"Homogeneity: change with the place", "homogeneity", "rms_relative", "sigma"},
        {"Light beyond the terminator, to 20°", "dusk", "part_of_lamp", "sigma"},
        {"Light on the dark side, beyond 40°", "night", "part_of_lamp", "sigma"},
    };
    fputs(
        "<div class=\"scroll\" tabindex=\"0\" role=\"group\" aria-label=\"Checks\"><table><caption>"
        "Checks of physics</caption><tbody>\n",
        r->to);
    for (size_t i = 0; i < sizeof checks / sizeof *checks; i++) {
        char text[80];
        double value = rec_report_number(r, "checks", checks[i].check, checks[i].value, NULL);
        double sigma = rec_report_number(r, "checks", checks[i].check, checks[i].sigma, NULL);
        snprintf(text, sizeof text, "%+.3f %% ± %.3f %%", 100 * value, 100 * sigma);
        row(r, checks[i].name, isnan(value) ? "not known" : text, "n");
    }
    char text[80];
    double bounced = rec_report_number(r, "interreflection", "mean_part_of_radiance", NULL);
    snprintf(text, sizeof text, "%.2f %%, taken out", 100 * bounced);
    row(r, "Light by way of the board, of the sample's", isnan(bounced) ? "not known" : text, "n");
    fputs("</tbody></table></div>\n", r->to);
}

static void write_stages(const struct report *r)
{
    json_t *stage;
    size_t i;
    double all = 0;
    fputs(
        "<div class=\"scroll\" tabindex=\"0\" role=\"group\" aria-label=\"Times\"><table><caption>"
        "Times of the stages</caption><tbody>\n",
        r->to);
    json_array_foreach(json_object_get(r->story, "stages"), i, stage)
    {
        double seconds = json_number_value(json_object_get(stage, "seconds"));
        all += seconds;
        fputs("<tr><th scope=\"row\">", r->to);
        rec_escaped(r->to, json_string_value(json_object_get(stage, "name")));
        fprintf(r->to, "</th><td class=\"n\">%.2f s</td></tr>\n", seconds);
    }
    fprintf(
        r->to,
        "<tr><th scope=\"row\">all</th><td class=\"n\">%.2f s</td></tr></tbody></table></div>\n",
        all);
}

void rec_report_provenance(const struct report *r)
{
    const char *version = json_string_value(json_object_get(r->story, "version"));
    const char *hash = json_string_value(json_object_get(r->story, "input_xxh3"));
    if (!version) {
        fputs(
            "<p>There is no run.json beside the table: nothing is known of how it was made.</p>\n",
            r->to);
        return;
    }
    fputs("<div class=\"two\"><div><div class=\"scroll\" tabindex=\"0\" role=\"group\" "
          "aria-label=\"Run\"><table><caption>Run</caption><tbody>\n",
          r->to);
    row(r, "goniocam", version, "text");
    row(r, "hash of the inputs (XXH3)", hash ? hash : "", "hash");
    write_options(r);
    fputs("</tbody></table></div>\n", r->to);
    write_checks(r);
    fputs("</div>\n", r->to);
    write_stages(r);
    fputs("</div>\n", r->to);
}
