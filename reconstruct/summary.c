/* summary.c -- what reconstruct tells at its end: was the evening a success? */
#include "summary.h"

#include "quantile.h"

#include <stdlib.h>

static double median_rms_px(const struct calibration *c)
{
    double *rms = malloc(((size_t)c->views + 1) * sizeof *rms);
    for (int v = 0; rms && v < c->views; v++)
        rms[v] = c->view[v].rms_px;
    double median = rec_quantile(rms, rms ? c->views : 0, 0.5);
    free(rms);
    return median;
}

static double length(const double v[3])
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

// Bands of 10 degrees up to the one that ends at to_deg.
static double coverage(const struct checks *k, int to_deg)
{
    double bins = 0, measured = 0;
    for (int i = 0; i < to_deg / 10; i++) {
        bins += k->coverage[i].bins;
        measured += k->coverage[i].measured;
    }
    return bins > 0 ? measured / bins : 0;
}

struct summary rec_summary_of(const struct job *j)
{
    const struct checks *k = &j->checks;
    struct summary s = {
        .shots = j->census.shots,
        .left_out = j->capture.shots - j->census.shots,
        .bins = j->bins.count,
        .warnings = j->run->warnings,
        .rms_px = median_rms_px(&j->calibration),
        .sigma_center = length(j->calibration.sample.sigma_center),
        .used = (double)j->census.photosites[FATE_USED],
        .within_60 = coverage(k, 60),
        .within_80 = coverage(k, 80),
        .whole = coverage(k, 90),
        .median_sigma = j->median_sigma,
        .albedo = k->albedo[0].value[1],
        .sigma_albedo = k->albedo[0].sigma[1],
        .best = j->fits.fit[0],
    };
    for (int i = 0; i < FATES; i++)
        s.seen += (double)j->census.photosites[i];
    for (int i = 0; i < j->calibration.lamps; i++)
        if (!j->calibration.lamp[i].at_infinity)
            s.sigma_lamp = fmax(s.sigma_lamp, length(j->calibration.lamp[i].sigma_position));
    cal_glare_of(&j->calibration, &s.glare, &s.sigma_glare);
    return s;
}

void rec_fit_print(const struct fit *fit)
{
    int k = 0;
    printf("%s:", fit->model->name);
    for (const struct parameter *p = fit->model->parameter; p->name; p++)
        for (int c = 0; c < p->size; c++, k++)
            printf("%s%s %.5g +- %.1g", c ? "," : "  ", c ? "" : p->name, fit->value[k],
                   fit->sigma[k]);
    printf("; misses by %.2g in log, %.2g %% in the median", fit->log_rms,
           100 * fit->relative_median);
    if (fit->psnr[0] > 0)
        printf("; pictures %.1f, %.1f dB", fit->psnr[0], fit->psnr[1]);
    printf("\n");
}

void rec_summary_print(const struct summary *s, const char *out)
{
    printf("\nshots        %d used", s->shots);
    if (s->left_out > 0)
        printf(", %d left out", s->left_out);
    printf("\ncalibration  tags to %.3f px; sample's centre +- %.3f mm", s->rms_px,
           s->sigma_center);
    if (s->sigma_lamp > 0)
        printf("; lamps +- %.2f mm", s->sigma_lamp);
    if (s->glare > 0)
        printf("\nglare        %.2g +- %.1g %% of the light, spread by the lens: taken off",
               100 * s->glare, 100 * s->sigma_glare);
    printf("\nphotosites   %.3g used, %.0f %% of those that see the sample\n", s->used,
           s->seen > 0 ? 100 * s->used / s->seen : 0);
    printf("bins         %d measured, with a standard error of %.2g %% (median)\n", s->bins,
           100 * s->median_sigma);
    printf("             they cover %.0f %% of all to 60 degrees, %.0f %% to 80, %.0f %% of the "
           "table; the rest is filled\n",
           100 * s->within_60, 100 * s->within_80, 100 * s->whole);
    printf("albedo       %.3f +- %.3f (green, light from 0 degrees)\n", s->albedo, s->sigma_albedo);
    printf("best fit     ");
    rec_fit_print(&s->best);
    if (s->warnings > 0)
        printf("warnings     %d, above and in %s/run.json\n", s->warnings, out);
    printf("results      %s/brdf.binary (table)   %s/fits.yaml   %s/report.html (look at it)\n",
           out, out, out);
}

void rec_summary_print_json(const struct summary *s, const char *out)
{
    printf("{\"out\": \"%s\", \"shots\": %d, \"bins\": %d, \"median_relative_sigma\": %.4g, "
           "\"best_fit\": \"%s\", \"rms_px\": %.4g, \"warnings\": %d}\n",
           out, s->shots, s->bins, s->median_sigma, s->best.model->name, s->rms_px, s->warnings);
}
