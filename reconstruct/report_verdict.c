/* report_verdict.c -- was the evening a success? In words, in three numbers, and what to do. */
#include "report.h"

#include "bins.h"
#include "quantile.h"

#include <stdarg.h>
#include <stdlib.h>

enum grade { GOOD, FAIR, BAD };
static const char *const grade_class[] = {"good", "fair", "bad"};

struct judgement {
    double sigma, to_80, whole, pairs, rms_px, misfit;  // NAN: not known
    size_t warnings;
    enum grade grade;
};

// What part of the bins with both angles up to `degrees` was measured.
static double measured_part(const struct report *r, double degrees)
{
    double bins = 0, measured = 0, least = cos(degrees * CAP_PI / 180);
    for (int bin = 0; r->source.status && bin < MERL_BINS; bin++) {
        vec3 wi, wo;
        rec_directions(rec_merl_center(bin), &wi, &wo);
        if (wi.z <= least || wo.z <= least)
            continue;
        bins++;
        measured += r->source.status[bin] == BIN_MEASURED;
    }
    return bins > 0 ? measured / bins : NAN;
}

// What part of the pairs (theta_i, theta_o) up to 80 degrees, whatever the azimuth, was seen.
static double pairs_part(const struct report *r)
{
    enum { CELLS = 40 };
    bool seen[CELLS][CELLS] = {{false}};
    double n = 0;
    for (int i = 0; i < r->source.bins.count; i++) {
        vec3 wi, wo;
        rec_directions(r->source.bins.bin[i].centroid, &wi, &wo);
        int a = (int)(acos(fmin(wi.z, 1)) * 90 / CAP_PI),
            b = (int)(acos(fmin(wo.z, 1)) * 90 / CAP_PI);
        if (wi.z > 0 && wo.z > 0 && a < CELLS && b < CELLS)
            seen[a][b] = seen[b][a] = true;
    }
    for (int a = 0; a < CELLS; a++)
        for (int b = 0; b < CELLS; b++)
            n += seen[a][b];
    return n / (CELLS * CELLS);
}

static double median_rms(const struct calibration *c)
{
    double *rms = malloc(((size_t)c->views + 1) * sizeof *rms);
    int n = 0;
    for (int v = 0; rms && v < c->views; v++)
        if (c->view[v].rms_px > 0)
            rms[n++] = c->view[v].rms_px;
    double median = rec_quantile(rms, rms ? n : 0, 0.5);
    free(rms);
    return median;
}

// A number that is not known spoils no grade.
static enum grade grade_of(double value, double fair, double bad)
{
    return value > bad ? BAD : value > fair ? FAIR : GOOD;
}

static enum grade worse(enum grade a, enum grade b)
{
    return a > b ? a : b;
}

static struct judgement judge(const struct report *r)
{
    struct judgement j = {
        .sigma = rec_median_sigma(&r->source.bins),
        .to_80 = measured_part(r, 80),
        .whole = measured_part(r, 90),
        .pairs = pairs_part(r),
        .rms_px = median_rms(&r->calibration),
        .misfit = r->source.fits.count > 0 ? r->source.fits.fit[0].log_rms : NAN,
        .warnings = json_array_size(json_object_get(r->story, "warnings")),
    };
    // A national laboratory reaches 0.5 %, photographs 3 % (Marschner et al. 2000); a residual of
    // half a pixel means that something moved. What is filled is as good as the fit.
    j.grade = worse(grade_of(j.sigma, 0.02, 0.06), grade_of(j.rms_px, 0.25, 1));
    j.grade = worse(j.grade, grade_of(j.misfit, 0.15, 0.5));
    j.grade = worse(j.grade, grade_of(-j.pairs, -0.5, -0.1));
    if (j.grade == GOOD && j.warnings > 0)
        j.grade = FAIR;
    return j;
}

// ---- words

static void say_headline(const struct report *r, const struct judgement *j)
{
    static const char *const words[] = {"A good measurement.", "Usable, with reservations.",
                                        "Not to be relied on: photograph again."};
    FILE *to = r->to;
    fprintf(to, "<h2 id=\"verdict-title\" class=\"headline %s\">%s</h2>\n<p>",
            grade_class[j->grade], words[j->grade]);
    fprintf(to,
            "%d shots measured reflectance in %d bins of the table, typically to %.2g&nbsp;%%. ",
            r->calibration.views, r->source.bins.count, 100 * j->sigma);
    if (r->source.fits.count > 0)
        fprintf(
            to,
            "The rest is filled by the model <i>%s</i>, which predicts bins that it did not see "
            "to %.2g&nbsp;%% (root mean square). ",
            r->source.fits.fit[0].model->name, 100 * j->misfit);
    if (j->warnings > 0)
        fprintf(to, "%zu warning%s below should be looked at.", j->warnings,
                j->warnings == 1 ? "" : "s");
    else
        fputs("Nothing was found that contradicts itself.", to);
    fputs("</p>\n", to);
}

static double length(const double v[3])
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static void say_calibration(const struct report *r, const struct judgement *j)
{
    const struct calibration *c = &r->calibration;
    double lamp = 0;
    for (int i = 0; i < c->lamps; i++)
        lamp = fmax(lamp, c->lamp[i].at_infinity ? 0 : length(c->lamp[i].sigma_position));
    FILE *to = r->to;
    if (j->rms_px > 0)
        fprintf(to,
                "<div><dt>Calibration residual</dt><dd>%.2g px</dd><dd class=\"say\">of the tags' "
                "corners, median of the shots",
                j->rms_px);
    else
        fputs("<div><dt>Calibration residual</dt><dd>&ndash;</dd><dd class=\"say\">the calibration "
              "was given, not made from tags",
              to);
    if (length(c->sample.sigma_center) > 0)
        fprintf(to, "; sample's centre &plusmn;&nbsp;%.2g mm", length(c->sample.sigma_center));
    if (lamp > 0)
        fprintf(to, "; lamps &plusmn;&nbsp;%.2g mm", lamp);
    fputs("</dd></div>\n", to);
}

static void say_numbers(const struct report *r, const struct judgement *j)
{
    FILE *to = r->to;
    double systematic = 0;
    for (int i = 0; i < r->source.bins.count; i++)
        systematic += r->source.bins.bin[i].systematic / r->source.bins.count;
    fprintf(to,
            "<dl class=\"numbers\">\n<div><dt>Error estimate</dt><dd>&plusmn;&nbsp;%.2g %%</dd>"
            "<dd class=\"say\">1 sigma of a measured bin, the median; of it %.2g&nbsp;%% shared by "
            "all (geometry, lamp). The reference's albedo adds its own error.</dd></div>\n",
            100 * j->sigma, 100 * systematic);
    fprintf(to,
            "<div><dt>Coverage</dt><dd>%.2g %%</dd><dd class=\"say\">of the table's bins up to 80 "
            "degrees (%.2g&nbsp;%% of all) were measured; %.0f&nbsp;%% of the pairs of light and "
            "camera angles to 80 degrees were seen at some azimuth</dd></div>\n",
            100 * j->to_80, 100 * j->whole, 100 * j->pairs);
    say_calibration(r, j);
    fputs("</dl>\n", to);
}

// ---- what to do

static void say_hint(const struct report *r, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

static void say_hint(const struct report *r, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    fputs("<li class=\"hint\">", r->to);
    vfprintf(r->to, format, args);
    fputs("</li>\n", r->to);
    va_end(args);
}

static double part_of_photosites(const struct report *r, const char *fate)
{
    const char *key;
    json_t *count;
    double all = 0;
    json_object_foreach(json_object_get(r->story, "photosites"), key, count) all +=
        json_number_value(count);
    return all > 0 ? rec_report_number(r, "photosites", fate, NULL) / all : 0;
}

// Bands of 20 degrees between lamp and camera (twice theta_d) that hold less than a two-hundredth
// of the bins, as "0 to 20 and 120 to 160". *first and *last are the lowest and the end of the
// highest.
static void describe_gaps(char text[120], const struct bins *bins, int *first, int *last)
{
    enum { BANDS = 8 };  // from 160 degrees on, nothing but grazing is left
    int count[BANDS + 1] = {0}, length = 0;
    text[0] = '\0';
    *first = *last = -1;
    for (int i = 0; i < bins->count; i++)
        count[bins->bin[i].index / MERL_PHI_D % MERL_THETA_D / 10]++;
    for (int b = 0, end; b < BANDS; b = end + 1) {
        for (end = b; end < BANDS && count[end] < bins->count / 200;)
            end++;
        if (end == b)
            continue;
        length += snprintf(text + length, 120 - (size_t)length, "%s%d to %d", length ? " and " : "",
                           20 * b, 20 * end);
        *first = *first < 0 ? b : *first;
        *last = end;
    }
}

static void hint_at_gaps(const struct report *r)
{
    char gaps[120];
    int first, last;
    describe_gaps(gaps, &r->source.bins, &first, &last);
    if (first < 0)
        return;
    say_hint(r,
             "<strong>Missing directions.</strong> Few or no photographs have lamp and camera %s "
             "degrees apart, as seen from the sample%s. <code>goniocam plan OUT</code> proposes "
             "places for the next shots.",
             gaps,
             first >= 6  ? ": those show grazing reflection; put both low, on opposite sides"
             : last <= 1 ? ": put the lamp beside the camera"
                         : "");
}

static void say_hints(const struct report *r, const struct judgement *j)
{
    double saturated = part_of_photosites(r, "saturated");
    double bounced = rec_report_number(r, "interreflection", "mean_part_of_radiance", NULL);
    hint_at_gaps(r);
    if (saturated > 0.01)
        say_hint(
            r,
            "<strong>Saturated.</strong> %.0f&nbsp;%% of the photosites are saturated in every "
            "frame of their bracket: add a shorter exposure.",
            100 * saturated);
    if (bounced > 0.05)
        say_hint(
            r,
            "<strong>Light from the board</strong> is %.0f&nbsp;%% of what the sample shows; it "
            "is taken out, but not perfectly. Dark paper around the tags makes it less.",
            100 * bounced);
    if (j->misfit > 0.15)
        say_hint(
            r,
            "<strong>No model fits well:</strong> what is filled may be off by %.0f&nbsp;%%. More "
            "shots make less of the table depend on it.",
            100 * j->misfit);
}

static void say_warnings(const struct report *r)
{
    json_t *warning, *warnings = json_object_get(r->story, "warnings");
    size_t i;
    if (json_array_size(warnings) == 0)
        return;
    fputs("<h3>Warnings, and what to do</h3>\n<ul class=\"advice\">\n", r->to);
    json_array_foreach(warnings, i, warning)
    {
        const char *text = json_string_value(warning);
        fputs("<li><strong>", r->to);
        rec_escaped(r->to, text ? text : "");
        fprintf(r->to, "</strong><p>%s</p></li>\n", rec_report_advice(text ? text : ""));
    }
    fputs("</ul>\n", r->to);
}

void rec_report_verdict(const struct report *r)
{
    if (r->source.bins.count == 0) {
        fputs("<h2 id=\"verdict-title\" class=\"headline fair\">A table alone.</h2><p>There is no "
              "bins.h5 beside it: nothing is known of its errors, or of what was measured.</p>\n",
              r->to);
        say_warnings(r);
        return;
    }
    struct judgement j = judge(r);
    say_headline(r, &j);
    say_numbers(r, &j);
    say_warnings(r);
    fputs("<ul class=\"advice\">\n", r->to);
    say_hints(r, &j);
    fputs("</ul>\n", r->to);
}
