/* compare_print.c -- a comparison, told. */
#include "compare.h"

#include <jansson.h>
#include <stdlib.h>

static const char *const channel_name[] = {"red", "green", "blue", "all"};

static void print_row(FILE *to, const char *what, const struct brdf_errors *e)
{
    if (!e->bins) {
        fprintf(to, "%-22s no bins\n", what);
        return;
    }
    fprintf(to, "%-22s %8d %9.3f %8.2f %+9.3f %9.4g %9.4g %9.4g %9.4g\n", what, e->bins,
            100 * e->relative_median, 100 * e->relative_95, 100 * e->signed_median, e->log_rms,
            e->cube_root, e->ngan, e->low);
}

void rec_compare_print(const struct comparison *comparison, FILE *to)
{
    fprintf(to, "%-22s %8s %9s %8s %9s %9s %9s %9s %9s\n", "", "bins", "median %", "95 %",
            "signed %", "log rms", "cube root", "Ngan", "Low E2");
    for (int c = 0; c <= COMPARE_ALL; c++)
        print_row(to, channel_name[c], &comparison->channel[c]);
    double from = 0;
    for (int band = 0; band < COMPARE_BANDS; band++) {
        char what[64];
        snprintf(what, sizeof what, "all, %g to %g degrees", from, rec_compare_band[band]);
        print_row(to, what, &comparison->by_angle[COMPARE_ALL][band]);
        from = rec_compare_band[band];
    }
    fprintf(
        to,
        "sphere under a lamp: PSNR %.2f dB, colour difference (CIE 2000) mean %.3f, 95 %% %.3f\n",
        comparison->sphere.psnr, comparison->sphere.delta_e, comparison->sphere.delta_e_95);
}

// JSON has no NaN and no infinity.
static json_t *number(double value)
{
    return isfinite(value) ? json_real(value) : json_null();
}

static json_t *errors(const struct brdf_errors *e)
{
    return json_pack("{s:i, s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "bins", e->bins, "relative_median",
                     number(e->relative_median), "relative_95", number(e->relative_95),
                     "signed_median", number(e->signed_median), "log_rms", number(e->log_rms),
                     "cube_root", number(e->cube_root), "ngan", number(e->ngan), "low",
                     number(e->low));
}

void rec_compare_print_json(const struct comparison *comparison, FILE *to)
{
    json_t *root = json_object();
    for (int c = 0; c <= COMPARE_ALL; c++) {
        json_t *channel = errors(&comparison->channel[c]), *angles = json_array();
        for (int band = 0; band < COMPARE_BANDS; band++) {
            json_t *one = errors(&comparison->by_angle[c][band]);
            json_object_set_new(one, "to_degrees", json_real(rec_compare_band[band]));
            json_array_append_new(angles, one);
        }
        json_object_set_new(channel, "by_angle", angles);
        json_object_set_new(root, channel_name[c], channel);
    }
    json_object_set_new(root, "sphere",
                        json_pack("{s:o, s:o, s:o}", "psnr", number(comparison->sphere.psnr),
                                  "delta_e", number(comparison->sphere.delta_e), "delta_e_95",
                                  number(comparison->sphere.delta_e_95)));
    json_dumpf(root, to, JSON_REAL_PRECISION(9));
    fputc('\n', to);
    json_decref(root);
}
