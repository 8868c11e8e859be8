/* check.c -- a BRDF of any format, tried for what must hold of every one.
 *
 * Reciprocity and albedo are laws. Symmetry about the plane of incidence is what isotropic surfaces
 * without grain have. That f does not fall at grazing angles, at a given half angle, holds of matt
 * and of glossy surfaces alike; tables from a gantry do fall there, since a pixel's footprint
 * outgrows the light's: N. Holzschuch, R. Pacanowski, "A Two-Scale Microfacet Reflectance Model
 * Combining Reflection and Diffraction", SIGGRAPH 2017; B. Burley, "Physically Based Shading at
 * Disney", 2012.
 */
#include "check.h"

#include "albedo.h"
#include "quantile.h"

#include <stdlib.h>

const double rec_check_angle[CHECK_ANGLES] = {0, 15, 30, 45, 60, 70, 75, 80, 83, 85, 88};

// Values are asked for at every sixth phi_d; whether there is one, at all.
enum { PHI_STEP = 6 };

// What one bin tells: f there, swapped, and on the other side of the plane of incidence.
struct look {
    double f[3], swapped[3], mirrored[3];
    double steepest;  // max(theta_i, theta_o), degrees
    bool above, asked, missing, negative;
};

// MERL's mark of a bin without value is -1 in the file's units, 1/1500 at least in 1/sr.
static bool marked(double value)
{
    return value < -0.999 / 1500;
}

static void look_at_value(struct look *look, const struct brdf *brdf, int bin)
{
    const double *table = brdf->table.value;
    for (int c = 0; c < 3; c++) {
        double f = table ? table[(size_t)c * MERL_BINS + (size_t)bin] : look->f[c];
        look->missing |= !isfinite(f) || (table && marked(f));
        look->negative |= f < 0 && !(table && marked(f));
    }
}

static struct look look_at(const struct brdf *brdf, int bin)
{
    struct look look = {.above = rec_merl_above(bin)};
    if (!look.above)
        return look;
    half_diff a = rec_merl_center(bin);
    vec3 wi, wo;
    look.asked = bin % PHI_STEP == 0;
    if (look.asked) {
        rec_directions(a, &wi, &wo);
        rec_brdf_eval(brdf, wi, wo, look.f);
        rec_brdf_eval(brdf, wo, wi, look.swapped);
        look.steepest = acos(fmin(wi.z, wo.z)) * 180 / CAP_PI;
        a.phi_d = -a.phi_d;
        rec_directions(a, &wi, &wo);
        rec_brdf_eval(brdf, wi, wo, look.mirrored);
    }
    look_at_value(&look, brdf, bin);
    return look;
}

/* ---- statistics -------------------------------------------------------------------------------
 */

// Relative differences of two values of each bin; room is [3 MERL_BINS]. Both 0: no difference.
static void differences(double *median, double *most, const struct look *look, bool swapped,
                        double *room)
{
    int n = 0;
    for (int bin = 0; bin < MERL_BINS; bin += PHI_STEP)
        for (int c = 0; look[bin].asked && !look[bin].missing && c < 3; c++) {
            double f = look[bin].f[c], g = swapped ? look[bin].swapped[c] : look[bin].mirrored[c];
            double mean = (f + g) / 2;
            room[n++] = mean > 0 ? fabs(f - g) / mean : 0;
        }
    *median = rec_quantile(room, n, 0.5);
    *most = rec_quantile(room, n, 0.95);
}

// Grazing over less steep, of one row of bins that differ in theta_d alone; NAN: not both are
// there.
static double row_grazing(const struct look *look, int theta_h, int phi_d)
{
    double sum[2] = {0, 0};
    int count[2] = {0, 0};
    for (int d = 0; d < MERL_THETA_D; d++) {
        const struct look *l = &look[phi_d + MERL_PHI_D * (d + MERL_THETA_D * theta_h)];
        int group = l->steepest >= 80 && l->steepest < 87   ? 1
                    : l->steepest >= 60 && l->steepest < 70 ? 0
                                                            : -1;
        if (!l->above || l->missing || group < 0)
            continue;
        sum[group] += l->f[1];
        count[group]++;
    }
    return count[0] && count[1] && sum[0] > 0 ? sum[1] / count[1] / (sum[0] / count[0]) : NAN;
}

static double grazing(const struct look *look, double *room)
{
    const double widest = 30 * CAP_PI / 180;
    int n = 0;
    for (int h = 0; h < MERL_THETA_H; h++)
        for (int p = 0; p < MERL_PHI_D; p += PHI_STEP) {
            if (rec_merl_center(MERL_THETA_D * MERL_PHI_D * h).theta_h > widest)
                continue;
            double ratio = row_grazing(look, h, p);
            if (isfinite(ratio))
                room[n++] = ratio;
        }
    return n ? rec_quantile(room, n, 0.5) : NAN;
}

enum status rec_check(struct check *check, const struct brdf *brdf, struct run *run,
                      struct error *err)
{
    struct look *look = malloc(MERL_BINS * sizeof *look);
    double *room = malloc(3 * MERL_BINS * sizeof *room);
    if (!look || !room) {
        free(look);
        free(room);
        return cap_fail(err, STATUS_MEMORY, "no memory to check a BRDF");
    }
    struct check made = {.table = brdf->table.value != NULL};
#pragma omp parallel for schedule(dynamic, 4096) num_threads(run->threads)
    for (int bin = 0; bin < MERL_BINS; bin++)
        look[bin] = look_at(brdf, bin);
    for (int bin = 0; bin < MERL_BINS; bin++) {
        made.bins += look[bin].above;
        made.missing += look[bin].missing;
        made.negative += look[bin].negative;
    }
    differences(&made.reciprocity_median, &made.reciprocity_95, look, true, room);
    differences(&made.mirror_median, &made.mirror_95, look, false, room);
    made.grazing = grazing(look, room);
#pragma omp parallel for schedule(dynamic) num_threads(run->threads)
    for (int i = 0; i < CHECK_ANGLES; i++)
        rec_brdf_albedo(made.albedo[i], brdf, rec_check_angle[i] * CAP_PI / 180);
    *check = made;
    free(look);
    free(room);
    return STATUS_OK;
}

unsigned rec_check_verdict(const struct check *k)
{
    unsigned verdict = 0;
    if (k->missing > 1e-3 * k->bins)
        verdict |= CHECK_MISSING;
    if (k->negative)
        verdict |= CHECK_NEGATIVE;
    if (k->reciprocity_95 > 0.1)
        verdict |= CHECK_RECIPROCITY;
    if (k->mirror_median > 0.05)
        verdict |= CHECK_MIRROR;
    for (int i = 0; i < CHECK_ANGLES; i++)
        for (int c = 0; c < 3; c++)
            if (!(k->albedo[i][c] <= 1.005))
                verdict |= CHECK_ALBEDO;
    if (k->grazing < 0.6)
        verdict |= CHECK_GRAZING;
    return verdict;
}
