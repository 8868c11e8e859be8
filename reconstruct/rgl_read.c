/* rgl_read.c -- BRDFs of the RGL material database: tensor files, rgb or spectral.
 *
 *      f cos(theta_o) = rgb(s) ndf(u_m) / (4 sigma(u_i))       s = vndf.invert(u_m | phi_i,
 * theta_i)
 *
 * Source.   J. Dupuy, W. Jakob, "An Adaptive Parameterization for Efficient Material Acquisition
 *           and Rendering", SIGGRAPH Asia 2018. A spectral file becomes linear sRGB under D65 when
 *           it is read: both steps are linear. Where azimuths of the light cover a half or a
 *           quarter turn only, symmetry tells the rest.
 */
#include "formats.h"
#include "rgl.h"
#include "spectrum.h"
#include "warp.h"

#include <stdlib.h>
#include <string.h>

struct rgl {
    struct tensors file;  // the parameters' values stay there
    struct warp ndf, sigma, vndf, color[3];
    bool isotropic, divided;  // divided: rgb is what ndf / (4 sigma) leaves of f cos(theta_o)
    int reduction;            // 1, or how many times the azimuths repeat
};

static void rgl_free(void *data)
{
    struct rgl *rgl = data;
    for (int c = 0; rgl && c < 3; c++)
        rec_warp_free(&rgl->color[c]);
    if (rgl) {
        rec_warp_free(&rgl->ndf);
        rec_warp_free(&rgl->sigma);
        rec_warp_free(&rgl->vndf);
        rec_tensors_free(&rgl->file);
    }
    free(rgl);
}

// Into the part of the plane that was measured: turned or mirrored, both directions alike.
static void reduce(const struct rgl *rgl, vec3 *wi, vec3 *wo)
{
    if (rgl->isotropic || rgl->reduction < 2)
        return;
    double flip_y = wi->y > 0 ? -1 : 1;
    double flip_x = rgl->reduction == 4 ? (wi->x > 0 ? -1 : 1) : flip_y;
    *wi = (vec3){wi->x * flip_x, wi->y * flip_y, wi->z};
    *wo = (vec3){wo->x * flip_x, wo->y * flip_y, wo->z};
}

static double polar(vec3 w)
{
    return atan2(hypot(w.x, w.y), w.z);
}

static void rgl_eval(const void *data, vec3 wi, vec3 wo, double f[3])
{
    const struct rgl *rgl = data;
    reduce(rgl, &wi, &wo);
    vec3 m = vec3_normalize(vec3_add(wi, wo));
    double light[2] = {atan2(wi.y, wi.x), polar(wi)}, phi_m = atan2(m.y, m.x);
    double u_i[2] = {rec_rgl_u_theta(light[1]), rec_rgl_u_phi(light[0])};
    double u_m[2] = {rec_rgl_u_theta(polar(m)),
                     rec_rgl_u_phi(rgl->isotropic ? phi_m - light[0] : phi_m)};
    double s[2];
    struct blend at = rec_warp_blend(&rgl->vndf, light), only = {.weight = {1}, .count = 1};
    rec_warp_invert(&rgl->vndf, &at, u_m, s);
    double scale = 1 / wo.z;
    if (rgl->divided)
        scale *= rec_warp_eval(&rgl->ndf, &only, u_m)
                 / (4 * fmax(rec_warp_eval(&rgl->sigma, &only, u_i), 1e-12));
    for (int c = 0; c < 3; c++)
        f[c] = fmax(0, scale * rec_warp_eval(&rgl->color[c], &at, s));
}

/* ---- from the file's arrays -------------------------------------------------------------------
 */

// What is being read, for its messages.
struct reading {
    struct rgl *rgl;
    const char *path;
    struct error *err;
};

static enum status refuse(struct reading *r, const char *name)
{
    return cap_fail(r->err, STATUS_FORMAT, "%s: no proper field '%s': not an RGL material", r->path,
                    name);
}

// A field of float32 with this many dimensions; *status is kept from an earlier failure.
static const struct tensor *field(struct reading *r, const char *name, int dims,
                                  enum status *status)
{
    const struct tensor *t = rec_tensor_find(&r->rgl->file, name);
    bool proper = t && t->type == TENSOR_F32 && t->dims == dims;
    for (size_t i = 0; proper && i < rec_tensor_numbers(t); i++)
        proper = isfinite(((const float *)t->data)[i]);
    for (int i = 0; proper && i < dims; i++)
        proper = t->shape[i] <= 1 << 20;
    if (!*status && !proper)
        *status = refuse(r, name);
    return *status ? NULL : t;
}

static bool ascending(const struct tensor *t)
{
    const float *v = t->data;
    for (size_t i = 1; i < t->shape[0]; i++)
        if (!(v[i] > v[i - 1]))
            return false;
    return true;
}

// A warp of a field whose last two dimensions are its nodes.
static enum status make(struct reading *r, struct warp *warp, const struct tensor *t,
                        const float *value, const struct tensor *phi, const struct tensor *theta,
                        bool density)
{
    static const float zero[1] = {0};
    const int size[2] = {phi ? (int)phi->shape[0] : 1, phi ? (int)theta->shape[0] : 1};
    const float *const values[2] = {phi ? phi->data : zero, phi ? theta->data : zero};
    size_t height = t->shape[t->dims - 2], width = t->shape[t->dims - 1];
    if (width < 2 || height < 2)
        return refuse(r, t->name);
    enum status status =
        rec_warp_make(warp, value, (int)width, (int)height, size, values, density, r->err);
    return status == STATUS_DATA ? refuse(r, t->name) : status;
}

/** The three colours of a field [P][T][channels][h][w], each [P][T][h][w]: weight [channels][3]. */
static enum status make_colors(struct reading *r, const struct tensor *t, double (*weight)[3],
                               const struct tensor *phi, const struct tensor *theta)
{
    size_t channels = t->shape[2], nodes = t->shape[3] * t->shape[4];
    size_t slices = t->shape[0] * t->shape[1];
    const float *from = t->data;
    float *one = malloc(slices * nodes * sizeof *one);
    enum status status =
        one ? STATUS_OK : cap_fail(r->err, STATUS_MEMORY, "%s: no memory", r->path);
    for (int c = 0; !status && c < 3; c++) {
        for (size_t i = 0; i < slices * nodes; i++) {
            double sum = 0;
            for (size_t k = 0; k < channels; k++)
                sum +=
                    weight[k][c] * (double)from[((i / nodes) * channels + k) * nodes + i % nodes];
            one[i] = (float)sum;
        }
        status = make(r, &r->rgl->color[c], t, one, phi, theta, false);
    }
    free(one);
    return status;
}

static enum status read_colors(struct reading *r, const struct tensor *phi,
                               const struct tensor *theta)
{
    enum { WAVELENGTHS_MAX = 4096 };
    enum status status = STATUS_OK;
    static const double own[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    bool spectral = rec_tensor_find(&r->rgl->file, "wavelengths") != NULL;
    const char *name = spectral ? "spectra" : "rgb";
    const struct tensor *t = field(r, name, 5, &status);
    const struct tensor *nm = spectral ? field(r, "wavelengths", 1, &status) : NULL;
    if (status)
        return status;
    size_t channels = spectral ? nm->shape[0] : 3;
    if (t->shape[0] != phi->shape[0] || t->shape[1] != theta->shape[0] || t->shape[2] != channels
        || channels > WAVELENGTHS_MAX || (spectral && !ascending(nm)))
        return refuse(r, name);
    double(*weight)[3] = malloc(channels * sizeof *weight);
    double *wavelength = malloc(channels * sizeof *wavelength);
    if (!weight || !wavelength)
        status = cap_fail(r->err, STATUS_MEMORY, "%s: no memory", r->path);
    for (size_t i = 0; !status && spectral && i < channels; i++)
        wavelength[i] = (double)((const float *)nm->data)[i];
    if (!status && spectral)
        rec_spectrum_weights(weight, wavelength, (int)channels);
    else if (!status)
        memcpy(weight, own, sizeof own);
    if (!status)
        status = make_colors(r, t, weight, phi, theta);
    free(weight);
    free(wavelength);
    return status;
}

static enum status read_fields(struct reading *r)
{
    struct rgl *rgl = r->rgl;
    enum status status = STATUS_OK;
    const struct tensor *phi = field(r, "phi_i", 1, &status);
    const struct tensor *theta = field(r, "theta_i", 1, &status);
    const struct tensor *ndf = field(r, "ndf", 2, &status), *sigma = field(r, "sigma", 2, &status);
    const struct tensor *vndf = field(r, "vndf", 4, &status);
    const struct tensor *jacobian = rec_tensor_find(&rgl->file, "jacobian");
    if (status)
        return status;
    if (!ascending(phi) || !ascending(theta))
        return refuse(r, "theta_i");
    if (vndf->shape[0] != phi->shape[0] || vndf->shape[1] != theta->shape[0])
        return refuse(r, "vndf");
    const float *azimuth = phi->data;
    double range = (double)(azimuth[phi->shape[0] - 1] - azimuth[0]);
    rgl->isotropic = phi->shape[0] <= 2;
    rgl->reduction = range > 0.1 ? (int)lrint(2 * CAP_PI / range) : 1;
    rgl->divided = jacobian && jacobian->type == TENSOR_U8 && *(const uint8_t *)jacobian->data;
    status = make(r, &rgl->ndf, ndf, ndf->data, NULL, NULL, false);
    if (!status)
        status = make(r, &rgl->sigma, sigma, sigma->data, NULL, NULL, false);
    if (!status)
        status = make(r, &rgl->vndf, vndf, vndf->data, phi, theta, true);
    return status ? status : read_colors(r, phi, theta);
}

static const struct brdf_kind rgl_kind = {"RGL material", rgl_eval, rgl_free};

static enum status rgl_read(struct brdf *brdf, const char *path, struct error *err)
{
    struct reading r = {calloc(1, sizeof *r.rgl), path, err};
    if (!r.rgl)
        return cap_fail(err, STATUS_MEMORY, "%s: no memory", path);
    enum status status = rec_tensors_read(&r.rgl->file, path, err);
    if (!status)
        status = read_fields(&r);
    if (status)
        rgl_free(r.rgl);
    else
        *brdf = (struct brdf){.kind = &rgl_kind, .data = r.rgl};
    return status;
}

static bool rgl_probe(const char *start, size_t size)
{
    return size >= 12 && memcmp(start, "tensor_file", 12) == 0;
}

const struct format rec_format_rgl = {"RGL tensor file (.bsdf)", rgl_probe, rgl_read};
