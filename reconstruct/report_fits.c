/* report_fits.c -- the fits as tables: how far they miss, and what their parameters are. */
#include "report.h"

static void write_ranking(const struct report *r)
{
    fputs(
        "<div class=\"scroll\" tabindex=\"0\" role=\"group\" aria-label=\"Fits\"><table><caption>"
        "Models by their error on bins that the fit did not see</caption><thead><tr><th "
        "scope=\"col\">model</th><th scope=\"col\" class=\"n\">log error, rms</th><th "
        "scope=\"col\" class=\"n\">median error</th><th scope=\"col\" class=\"n\">in units of the "
        "bins&rsquo; sigma</th><th scope=\"col\">source</th></tr></thead><tbody>\n",
        r->to);
    for (int k = 0; k < r->source.fits.count; k++) {
        const struct fit *fit = &r->source.fits.fit[k];
        fprintf(r->to,
                "<tr><th scope=\"row\">%s</th><td class=\"n\">%.3g</td><td class=\"n\">%.2g %%</td>"
                "<td class=\"n\">%.2g</td><td class=\"note\">%s</td></tr>\n",
                fit->model->name, fit->log_rms, 100 * fit->relative_median, fit->chi,
                fit->model->source);
    }
    fputs("</tbody></table></div>\n", r->to);
}

// One number with its standard deviation, 95 % within 1.96 of them and where it is physical.
static void write_value(const struct report *r, const struct parameter *p, double value,
                        double sigma)
{
    fprintf(r->to,
            "<td class=\"n\">%.5g <span class=\"pm\">&plusmn; %.1g</span><br><span class=\"pm\">"
            "%.5g &ndash; %.5g</span></td>",
            value, sigma, fmax(p->low, value - 1.96 * sigma), fmin(p->high, value + 1.96 * sigma));
}

static void write_parameters(const struct report *r, const struct fit *fit, bool open)
{
    static const char *const head = "<thead><tr><th scope=\"col\">parameter</th><th scope=\"col\" "
                                    "class=\"n\">value, or red</th>"
                                    "<th scope=\"col\" class=\"n\">green</th><th scope=\"col\" "
                                    "class=\"n\">blue</th></tr></thead>";
    fprintf(r->to,
            "<details%s><summary>%s</summary><div class=\"scroll\" tabindex=\"0\" "
            "role=\"group\" aria-label=\"Parameters of %s\"><table><caption>value &plusmn; 1 "
            "sigma, and the interval of 95 %%</caption>%s<tbody>\n",
            open ? " open" : "", fit->model->name, fit->model->name, head);
    int k = 0;
    for (const struct parameter *p = fit->model->parameter; p->name; p++) {
        fprintf(r->to, "<tr><th scope=\"row\">%s</th>", p->name);
        for (int c = 0; c < p->size; c++, k++)
            write_value(r, p, fit->value[k], fit->sigma[k]);
        for (int c = p->size; c < 3; c++)
            fputs("<td></td>", r->to);
        fputs("</tr>\n", r->to);
    }
    fputs("</tbody></table></div></details>\n", r->to);
}

void rec_report_fits(const struct report *r)
{
    if (r->source.fits.count == 0) {
        fputs("<p>There is no fits.yaml: <code>goniocam fit OUT</code> makes one.</p>\n", r->to);
        return;
    }
    write_ranking(r);
    fputs("<h3>Parameters</h3>\n", r->to);
    for (int k = 0; k < r->source.fits.count; k++)
        write_parameters(r, &r->source.fits.fit[k], k == 0);
}
