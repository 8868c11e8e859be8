/* check_print.c -- what a check found, in words and as JSON. */
#include "check.h"

#include <jansson.h>

static void line(FILE *to, bool bad, const char *what)
{
    fprintf(to, "%-4s %-22s ", bad ? "BAD" : "good", what);
}

static void print_albedo(const struct check *k, bool bad, FILE *to)
{
    int worst = 0, channel = 0;
    for (int i = 0; i < CHECK_ANGLES; i++)
        for (int c = 0; c < 3; c++)
            if (k->albedo[i][c] > k->albedo[worst][channel]) {
                worst = i;
                channel = c;
            }
    line(to, bad, "energy");
    fprintf(to, "%s: reflectance is %.4f at most, of light from %g degrees\n",
            bad ? "more leaves than arrives" : "conserved", k->albedo[worst][channel],
            rec_check_angle[worst]);
    for (int i = 0; i < CHECK_ANGLES; i++)
        fprintf(to, "     %22g degrees: %.4f %.4f %.4f\n", rec_check_angle[i], k->albedo[i][0],
                k->albedo[i][1], k->albedo[i][2]);
}

void rec_check_print(const struct check *k, FILE *to)
{
    unsigned verdict = rec_check_verdict(k);
    line(to, verdict & CHECK_MISSING, "complete");
    fprintf(to, "%d of %d bins above the horizon have no value\n", k->missing, k->bins);
    line(to, verdict & CHECK_NEGATIVE, "not negative");
    fprintf(to, "%d bins are below 0\n", k->negative);
    line(to, verdict & CHECK_RECIPROCITY, "reciprocity");
    if (k->table)
        fprintf(to, "built into the table's angles\n");
    else
        fprintf(to, "swapped directions differ by %.3g %% (median), %.3g %% (95 %%)\n",
                100 * k->reciprocity_median, 100 * k->reciprocity_95);
    line(to, verdict & CHECK_MIRROR, "symmetry");
    fprintf(to, "across the plane of incidence it differs by %.3g %% (median), %.3g %% (95 %%)%s\n",
            100 * k->mirror_median, 100 * k->mirror_95,
            verdict & CHECK_MIRROR ? ": grain, or noise" : "");
    print_albedo(k, verdict & CHECK_ALBEDO, to);
    line(to, verdict & CHECK_GRAZING, "grazing angles");
    fprintf(to, "f at 80 to 87 degrees is %.3g of f at 60 to 70%s\n", k->grazing,
            verdict & CHECK_GRAZING ? ": it falls where surfaces do not, as MERL's tables do" : "");
    fprintf(to, "%s\n", verdict ? "verdict: not to be trusted as it is" : "verdict: sound");
}

static json_t *number(double value)
{
    return isfinite(value) ? json_real(value) : json_null();
}

void rec_check_print_json(const struct check *k, FILE *to)
{
    unsigned verdict = rec_check_verdict(k);
    json_t *albedo = json_array();
    for (int i = 0; i < CHECK_ANGLES; i++)
        json_array_append_new(albedo, json_pack("{s:f, s:[o, o, o]}", "theta_i", rec_check_angle[i],
                                                "rgb", number(k->albedo[i][0]),
                                                number(k->albedo[i][1]), number(k->albedo[i][2])));
    json_t *good =
        json_pack("{s:b, s:b, s:b, s:b, s:b, s:b}", "complete", !(verdict & CHECK_MISSING),
                  "not_negative", !(verdict & CHECK_NEGATIVE), "reciprocity",
                  !(verdict & CHECK_RECIPROCITY), "symmetry", !(verdict & CHECK_MIRROR), "energy",
                  !(verdict & CHECK_ALBEDO), "grazing", !(verdict & CHECK_GRAZING));
    json_t *root =
        json_pack("{s:b, s:o, s:i, s:i, s:i, s:o, s:o, s:o, s:o, s:o, s:o}", "sound", !verdict,
                  "good", good, "bins", k->bins, "missing", k->missing, "negative", k->negative,
                  "reciprocity_median", number(k->reciprocity_median), "reciprocity_95",
                  number(k->reciprocity_95), "mirror_median", number(k->mirror_median), "mirror_95",
                  number(k->mirror_95), "grazing", number(k->grazing), "albedo", albedo);
    json_dumpf(root, to, JSON_REAL_PRECISION(9));
    fputc('\n', to);
    json_decref(root);
}
