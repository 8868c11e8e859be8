/* report.h -- report.html: what a person wants to see of a run, in one file. */
#ifndef GONIOCAM_REPORT_H
#define GONIOCAM_REPORT_H

#include "plot.h"

#include <jansson.h>

/** Write OUT/report.html from the files in OUT: bins.h5, brdf.binary and fits.yaml; what run.json,
 *  calibration.yaml, overlay/ and predicted/ tell, where they are there. Complete or not at all.
 *  STATUS_IO, STATUS_FORMAT, STATUS_MEMORY. */
enum status rec_report(const char *out, int threads, struct error *err);

/* ---- inside of the report ---------------------------------------------------------------------
 */

/** What a report is made of. */
struct report {
    const char *out;
    struct plot_source source;
    struct calibration calibration;  // empty without calibration.yaml
    json_t *story;                   // run.json; JSON null without it
    struct plot_options options;
    FILE *to;
};

/** Sections of the page; each writes HTML to report->to, whose errors are looked at in the end. */
void rec_report_verdict(const struct report *report);
void rec_report_lobes(const struct report *report);
void rec_report_slices(const struct report *report);
void rec_report_albedo(const struct report *report);
void rec_report_coverage(const struct report *report);
void rec_report_fits(const struct report *report);
void rec_report_predictions(const struct report *report);
void rec_report_rig(const struct report *report);
void rec_report_lamp(const struct report *report, const struct lamp *lamp);
void rec_report_photographs(const struct report *report);
void rec_report_provenance(const struct report *report);

/** The tables that the page shades with: of the source and of its fits, packed (report_tables.c).
 */
void rec_report_tables(const struct report *report);
/** What page.js reads off the lobes; what rig.js draws. The caller owns them. */
json_t *rec_report_cuts(const struct report *report);
json_t *rec_report_rig_data(const struct report *report);

/** What to do about a warning (report_advice.c); never NULL. */
const char *rec_report_advice(const char *warning);

/** Write OUT/FOLDER/NAME.png as an <img> that becomes large when clicked, at most `width` pixels
 *  wide. false: there is no such picture; nothing was written. */
bool rec_report_picture(const struct report *report, const char *folder, const char *name,
                        int width, const char *alt);

/** A number of run.json, by the keys on the way to it, as "checks", "stray_part", NULL; NAN where
 *  it is not there. */
double rec_report_number(const struct report *report, ...) __attribute__((sentinel));
/** An <svg> begins: its size, and what it shows for who cannot see it. more: other attributes. */
struct pen rec_report_svg(const struct report *report, double width, double height, const char *alt,
                          const char *more);
void rec_report_svg_end(const struct report *report);

#endif
