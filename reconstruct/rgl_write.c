/* rgl_write.c -- an isotropic BRDF as RGL material files, which Mitsuba 3 and pbrt-v4 load.
 *
 * Method.   The file's functions are those of Dupuy and Jakob: ndf is a distribution of normals D
 *           whose projected area is 1 straight down; sigma its projected area for each direction of
 *           the light; vndf the density on the unit square of (u(theta_m), u(phi_m - phi_i)) that
 *           bends the square's nodes s onto the normals; rgb what remains of f cos(theta_o) after
 *           ndf / (4 sigma), at s; luminance the density over s that makes samples follow
 *           f cos(theta_o).
 *           u(theta_m) is the root of theta_h by which MERL divides it. So nodes are put where a
 *           table has its bins' middles, every 1/180 of u, and nothing bends them: vndf is even, D
 *           is the same for all normals. Between nodes f cos(theta_o) is linear, as a table's own
 *           interpolation (lookup.c) is; where light falls is left to luminance alone.
 * Accuracy. tests/rgl.py reads the files with code of its own and holds them to 1 % (median) and
 *           5 % (95 %) of the BRDF.
 */
#include "rgl.h"
#include "spectrum.h"
#include "tensor_file.h"

#include <stdlib.h>

enum {
    THETAS = 49,  // of the light, closer together towards grazing
    SQUARE_X =
        2 * MERL_THETA_H + 1,  // nodes of rgb and luminance over u(theta_m), u(phi_m - phi_i)
    SQUARE_Y = 97,
    EVEN = 8,  // along each side of a table that is even
    SIGMA = 64,
    NODES = SQUARE_X * SQUARE_Y
};
static const double steepest = 89.5 * CAP_PI / 180;

/** Everything that goes into the files. */
struct tables {
    float phi[1], theta[THETAS];
    float ndf[2][EVEN], sigma[2][SIGMA];
    float vndf[THETAS][EVEN * EVEN], luminance[THETAS][NODES];
    float rgb[THETAS][3][NODES], spectra[THETAS][SPECTRUM_SIZE][NODES];
    float wavelength[SPECTRUM_SIZE];
};

static vec3 direction(double theta, double phi)
{
    return (vec3){sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
}

static void fill_parameters(struct tables *t)
{
    t->phi[0] = 0;
    for (int i = 0; i < THETAS; i++)
        t->theta[i] = (float)(steepest * (1 - pow(1 - i / (THETAS - 1.0), 2)));
    for (int i = 0; i < SPECTRUM_SIZE; i++)
        t->wavelength[i] = (float)rec_spectrum_wavelength(i);
}

static const double ndf = 1 / CAP_PI;  // D

// Integral of D max(0, w.m) over the hemisphere of normals m, for w at theta from the middle.
static double projected_area(double theta)
{
    return 0.5 * (1 + cos(theta));
}

static void fill_distribution(struct tables *t)
{
    for (int i = 0; i < EVEN; i++)
        t->ndf[0][i] = t->ndf[1][i] = (float)ndf;
    for (int i = 0; i < SIGMA; i++)
        t->sigma[0][i] = t->sigma[1][i] = (float)projected_area(rec_rgl_theta(i / (SIGMA - 1.0)));
    for (int i = 0; i < THETAS; i++)
        for (int k = 0; k < EVEN * EVEN; k++)
            t->vndf[i][k] = 1;
}

/** Area on the sphere for an area of the unit square, 2 pi^2 u sin(theta). */
static double stretch(double u)
{
    return 2 * CAP_PI * CAP_PI * u * sin(rec_rgl_theta(u));
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

// One node: rgb there, and the density that makes samples follow f cos(theta_o).
static void fill_node(struct tables *t, const struct brdf *brdf, int slice, int node)
{
    double theta_i = (double)t->theta[slice], sigma = projected_area(theta_i), value[3], mean = 0;
    double u = node % SQUARE_X / (SQUARE_X - 1.0), v = node / SQUARE_X / (SQUARE_Y - 1.0);
    vec3 wi = direction(theta_i, 0), m = direction(rec_rgl_theta(u), (2 * v - 1) * CAP_PI);
    outgoing(brdf, wi, m, value);
    for (int c = 0; c < 3; c++) {
        value[c] *= 4 * sigma / ndf;
        t->rgb[slice][c][node] = (float)value[c];
        mean += fmax(0, value[c]) / 3;
    }
    t->luminance[slice][node] = (float)(mean * fmax(0, vec3_dot(wi, m)) * stretch(u));
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

static void fill(struct tables *t, const struct brdf *brdf, struct run *run)
{
    fill_parameters(t);
    fill_distribution(t);
    cap_stage(run, "export", THETAS);
#pragma omp parallel for schedule(dynamic) num_threads(run->threads)
    for (int slice = 0; slice < THETAS; slice++) {
        for (int i = 0; i < NODES; i++)
            fill_node(t, brdf, slice, i);
        lift(t->luminance[slice]);
        fill_spectra(t, slice);
        cap_step(run);
    }
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
        FIELD("ndf", t->ndf, 2, EVEN),
        FIELD("sigma", t->sigma, 2, SIGMA),
        FIELD("vndf", t->vndf, 1, THETAS, EVEN, EVEN),
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
    fill(tables, brdf, run);
    enum status status = write_both(tables, base, err);
    free(tables);
    return status;
}
