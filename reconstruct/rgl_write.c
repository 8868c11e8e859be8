/* rgl_write.c -- an isotropic BRDF as RGL material files, which Mitsuba 3 and pbrt-v4 load.
 *
 * Method.   The file's functions are those of Dupuy and Jakob: ndf is a distribution of normals D
 *           whose projected area is 1 straight down; sigma its projected area for each direction of
 *           the light; vndf the visible normals D <wi.m> / sigma, as a density on the unit square
 *           of (u(theta_m), u(phi_m - phi_i)); rgb what remains of f cos(theta_o) after ndf / (4
 *           sigma), at the nodes s of the square that vndf bends onto the normals; luminance the
 *           density over s that makes samples follow f cos(theta_o).
 *           Whatever D is, rgb makes the product exact at the nodes; D decides how many nodes a
 *           part of the lobe gets (rgl_ndf.c).
 * Accuracy. tests/rgl.py reads the files with code of its own and holds them to 1 % (median) and
 *           5 % (95 %) of the BRDF.
 */
#include "rgl.h"
#include "rgl_ndf.h"
#include "spectrum.h"
#include "warp.h"

#include <stdlib.h>
#include <string.h>

enum {
    THETAS = 49,     // of the light, closer together towards grazing
    SQUARE_X = 160,  // nodes of rgb and luminance over s
    SQUARE_Y = 97,
    VISIBLE_X = RGL_NDF,  // nodes of vndf over u(theta_m), u(phi_m - phi_i)
    VISIBLE_Y = 65,
    SIGMA = 64,
    NODES = SQUARE_X * SQUARE_Y,
    VISIBLE = VISIBLE_X * VISIBLE_Y
};
static const double steepest = 89.5 * CAP_PI / 180;

/** Everything that goes into the files. */
struct tables {
    float phi[1], theta[THETAS];
    float ndf[2][RGL_NDF], sigma[2][SIGMA];
    float vndf[THETAS][VISIBLE], luminance[THETAS][NODES];
    float rgb[THETAS][3][NODES], spectra[THETAS][SPECTRUM_SIZE][NODES];
    float wavelength[SPECTRUM_SIZE];
};

static vec3 direction(double theta, double phi)
{
    return (vec3){sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
}

// Linear between nodes that are even in u from 0 to 1, as the readers do it.
static double between(const float *value, int nodes, double u)
{
    double place = fmin(fmax(u, 0), 1) * (nodes - 1);
    int low = place < nodes - 2 ? (int)place : nodes - 2;
    double share = place - low;
    return (1 - share) * (double)value[low] + share * (double)value[low + 1];
}

static void fill_parameters(struct tables *t)
{
    t->phi[0] = 0;
    for (int i = 0; i < THETAS; i++)
        t->theta[i] = (float)(steepest * (1 - pow(1 - i / (THETAS - 1.0), 2)));
    for (int i = 0; i < SPECTRUM_SIZE; i++)
        t->wavelength[i] = (float)rec_spectrum_wavelength(i);
}

static void fill_distribution(struct tables *t, const struct brdf *brdf)
{
    double ndf[RGL_NDF];
    rec_rgl_ndf(ndf, brdf);
    for (int i = 0; i < RGL_NDF; i++)
        t->ndf[0][i] = t->ndf[1][i] = (float)ndf[i];
    for (int i = 0; i < SIGMA; i++) {
        double theta = rec_rgl_theta(i / (SIGMA - 1.0));
        t->sigma[0][i] = t->sigma[1][i] = (float)rec_rgl_projected_area(ndf, theta);
    }
}

/** Area on the sphere for an area of the unit square, 2 pi^2 u sin(theta). */
static double stretch(double u)
{
    return 2 * CAP_PI * CAP_PI * u * sin(rec_rgl_theta(u));
}

/** Normals that the light hardly sees keep a hundredth, so that the density can be inverted
 *  everywhere. */
static double visible(vec3 wi, vec3 m)
{
    return fmax(vec3_dot(wi, m), 0.01);
}

static void fill_visible(struct tables *t, int slice)
{
    vec3 wi = direction((double)t->theta[slice], 0);
    for (int y = 0; y < VISIBLE_Y; y++)
        for (int x = 0; x < VISIBLE_X; x++) {
            double u = x / (VISIBLE_X - 1.0), v = y / (VISIBLE_Y - 1.0);
            vec3 m = direction(rec_rgl_theta(u), (2 * v - 1) * CAP_PI);
            t->vndf[slice][y * VISIBLE_X + x] =
                (float)(between(t->ndf[0], RGL_NDF, u) * visible(wi, m) * stretch(u));
        }
}

/** f cos(theta_o) where normal m mirrors wi. Below the horizon f is that of its edge and the cosine
 *  is negative: the renderer never asks there, and a patch that the horizon crosses stays linear.
 */
static void outgoing(const struct brdf *brdf, vec3 wi, vec3 m, double value[3])
{
    const double edge = 0.004;
    vec3 wo = vec3_sub(vec3_scale(m, 2 * vec3_dot(wi, m)), wi), above = wo;
    if (wo.z < edge) {
        double flat = hypot(wo.x, wo.y), s = sqrt(1 - edge * edge) / fmax(flat, 1e-9);
        above = (vec3){wo.x * s, wo.y * s, edge};
    }
    rec_brdf_eval(brdf, wi, above, value);
    for (int c = 0; c < 3; c++)
        value[c] *= wo.z;
}

// One node of s: rgb there, and the weight that turns samples of vndf into samples of f
// cos(theta_o).
static void fill_node(struct tables *t, const struct brdf *brdf, const struct warp *vndf, int slice,
                      int node)
{
    double theta_i = (double)t->theta[slice],
           sigma = between(t->sigma[0], SIGMA, rec_rgl_u_theta(theta_i));
    double s[2] = {node % SQUARE_X / (SQUARE_X - 1.0), node / SQUARE_X / (SQUARE_Y - 1.0)}, u[2];
    struct blend only = {.weight = {1}, .count = 1};
    rec_warp_sample(vndf, &only, s, u);
    vec3 wi = direction(theta_i, 0), m = direction(rec_rgl_theta(u[0]), (2 * u[1] - 1) * CAP_PI);
    double value[3], d = between(t->ndf[0], RGL_NDF, u[0]), mean = 0;
    outgoing(brdf, wi, m, value);
    for (int c = 0; c < 3; c++) {
        value[c] *= 4 * sigma / d;
        t->rgb[slice][c][node] = (float)value[c];
        mean += fmax(0, value[c]) / 3;
    }
    double density = rec_warp_eval(vndf, &only, u);
    double wanted = mean * d / sigma * fmax(0, vec3_dot(wi, m)) * stretch(u[0]);
    t->luminance[slice][node] = (float)(density > 0 ? wanted / density : mean);
}

// A thousandth of the mean everywhere: no row of it is empty.
static void lift(float *luminance)
{
    double sum = 0;
    for (int i = 0; i < NODES; i++)
        sum += (double)luminance[i] / NODES;
    for (int i = 0; i < NODES; i++)
        luminance[i] += (float)(sum > 0 ? 1e-3 * sum : 1);
}

static void fill_spectra(struct tables *t, int slice)
{
    for (int i = 0; i < NODES; i++) {
        double rgb[3], spectrum[SPECTRUM_SIZE], sign = 1;
        for (int c = 0; c < 3; c++)
            rgb[c] = (double)t->rgb[slice][c][i];
        if (rgb[0] + rgb[1] + rgb[2] < 0)
            sign = -1;
        for (int c = 0; c < 3; c++)
            rgb[c] *= sign;
        rec_spectrum_of_rgb(spectrum, rgb);
        for (int k = 0; k < SPECTRUM_SIZE; k++)
            t->spectra[slice][k][i] = (float)(sign * spectrum[k]);
    }
}

static enum status fill_slice(struct tables *t, const struct brdf *brdf, int slice,
                              struct error *err)
{
    struct warp vndf = {0};
    fill_visible(t, slice);
    enum status status =
        rec_warp_make(&vndf, t->vndf[slice], VISIBLE_X, VISIBLE_Y, (const int[2]){1, 1},
                      (const float *const[2]){t->phi, t->phi}, true, err);
    for (int i = 0; !status && i < NODES; i++)
        fill_node(t, brdf, &vndf, slice, i);
    rec_warp_free(&vndf);
    if (status)
        return status;
    lift(t->luminance[slice]);
    fill_spectra(t, slice);
    return STATUS_OK;
}

static enum status fill(struct tables *t, const struct brdf *brdf, struct run *run,
                        struct error *err)
{
    enum status status = STATUS_OK;
    fill_parameters(t);
    fill_distribution(t, brdf);
    cap_stage(run, "export", THETAS);
#pragma omp parallel for schedule(dynamic) num_threads(run->threads)
    for (int i = 0; i < THETAS; i++) {
        struct error own = {0};
        if (fill_slice(t, brdf, i, &own))
#pragma omp critical
            status = cap_fail(err, own.status, "%s", own.text);
        cap_step(run);
    }
    return status;
}

/* ---- the files --------------------------------------------------------------------------------
 */

static const char about[] = "written by goniocam: an isotropic BRDF in the parameterization of "
                            "Dupuy and Jakob 2018";

#define FIELD(name, array, ...)                                                                    \
    {                                                                                              \
        name, TENSOR_F32, sizeof((size_t[]){__VA_ARGS__}) / sizeof(size_t), {__VA_ARGS__}, array   \
    }

static enum status write(const struct tables *t, bool spectral, const char *path, struct error *err)
{
    static const uint8_t jacobian[1] = {1};
    struct tensor field[] = {
        {"description", TENSOR_U8, 1, {sizeof about - 1}, about},
        FIELD("phi_i", t->phi, 1),
        FIELD("theta_i", t->theta, THETAS),
        FIELD("ndf", t->ndf, 2, RGL_NDF),
        FIELD("sigma", t->sigma, 2, SIGMA),
        FIELD("vndf", t->vndf, 1, THETAS, VISIBLE_Y, VISIBLE_X),
        FIELD("luminance", t->luminance, 1, THETAS, SQUARE_Y, SQUARE_X),
        {"jacobian", TENSOR_U8, 1, {1}, jacobian},
        FIELD("rgb", t->rgb, 1, THETAS, 3, SQUARE_Y, SQUARE_X),
        FIELD("wavelengths", t->wavelength, SPECTRUM_SIZE),
    };
    int count = sizeof field / sizeof *field;
    if (spectral)
        field[count - 2] = (struct tensor)FIELD("spectra", t->spectra, 1, THETAS, SPECTRUM_SIZE,
                                                SQUARE_Y, SQUARE_X);
    return rec_tensors_write(field, spectral ? count : count - 1, path, err);
}

static enum status write_both(const struct tables *t, const char *base, struct error *err)
{
    char *rgb = NULL, *spectral = NULL;
    if (asprintf(&rgb, "%s_rgb.bsdf", base) < 0 || asprintf(&spectral, "%s_spec.bsdf", base) < 0) {
        free(rgb);
        return cap_fail(err, STATUS_MEMORY, "%s: no memory", base);
    }
    enum status status = write(t, false, rgb, err);
    if (!status) {
        status = write(t, true, spectral, err);
        if (status)
            remove(rgb);
    }
    free(rgb);
    free(spectral);
    return status;
}

enum status rec_rgl_write(const struct brdf *brdf, const char *base, struct run *run,
                          struct error *err)
{
    struct tables *tables = malloc(sizeof *tables);
    if (!tables)
        return cap_fail(err, STATUS_MEMORY, "%s: no memory for its tables", base);
    enum status status = fill(tables, brdf, run, err);
    if (!status)
        status = write_both(tables, base, err);
    free(tables);
    return status;
}
