/* brdf.h -- the face of reconstruct/ for renderers: tables and models of reflectance from files,
 * evaluated and sampled.
 *
 * Directions are unit vectors in the local frame of the surface, whose normal is +z, and point
 * away from it: wi to the light, wo to the camera. Angles are in radians. f is in 1/sr and holds
 * no foreshortening: L = f I cos(theta_i) / r^2.
 *
 *     struct brdf brdf = {0};
 *     if (!rec_brdf_read(&brdf, "OUT", &err)) {
 *         double pdf = rec_brdf_sample(&brdf, wi, u, &wo);
 *         rec_brdf_eval(&brdf, wi, wo, f);
 *     }
 *     rec_brdf_free(&brdf);
 */
#ifndef GONIOCAM_BRDF_H
#define GONIOCAM_BRDF_H

#include "program.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- half/difference angles ---------------------------------------------------------------- */

/** The angles of h and d (see rec_half_diff) that an isotropic BRDF depends on. */
typedef struct {
    double theta_h;  // h from the normal, [0, pi/2]
    double theta_d;  // wi from h,         [0, pi/2]
    double phi_d;    // wi around h,       [-pi, pi]
} half_diff;

/** Half/difference angles of a pair of directions:
 *
 *      h = (wi + wo) / |wi + wo|       d = Ry(-theta_h) Rz(-phi_h) wi
 *
 *  Requires wi.z > 0 and wo.z > 0. Swapping wi and wo turns phi_d by pi and changes
 *  nothing else. Where theta_h = 0 or theta_d = 0, phi_d is finite but arbitrary.
 *
 *  S. Rusinkiewicz, "A New Change of Variables for Efficient BRDF Representation",
 *  Eurographics Workshop on Rendering, 1998. */
half_diff rec_half_diff(vec3 wi, vec3 wo);
/** The inverse, with the azimuth of h at 0. wi or wo may lie below the horizon. */
void rec_directions(half_diff angles, vec3 *wi, vec3 *wo);

/* ---- MERL tables ---------------------------------------------------------------------------- */

enum {
    MERL_THETA_H = 90,
    MERL_THETA_D = 90,
    MERL_PHI_D = 180,
    MERL_BINS = MERL_THETA_H * MERL_THETA_D * MERL_PHI_D
};

/** The bin of a pair of angles: phi_d + 180 (theta_d + 90 theta_h), each a whole number;
 *  theta_h is divided by its square root, and phi_d is folded to [0, pi) (reciprocity).
 *
 *  W. Matusik, H. Pfister, M. Brand, L. McMillan, "A Data-Driven Reflectance Model",
 *  SIGGRAPH 2003, and the code published with the data. */
int rec_merl_index(half_diff angles);
/** The middle of a bin: rec_merl_index(rec_merl_center(bin)) is bin. */
half_diff rec_merl_center(int bin);
/** Both directions of the bin's middle are above the horizon: true of 1,096,216 bins. */
bool rec_merl_above(int bin);
/** The bin on the other side of the plane of incidence, phi_d -> pi - phi_d: an isotropic
 *  surface without grain has the same f there. */
int rec_merl_mirror(int bin);

/** Another division of the same angles: theta_h by its square root, theta_d, and phi_d over pi. */
struct grid {
    int theta_h, theta_d, phi_d;
};
extern const struct grid rec_merl_grid;
/** How many bins it has. */
static inline int rec_grid_bins(struct grid grid)
{
    return grid.theta_h * grid.theta_d * grid.phi_d;
}
/** As rec_merl_index. */
int rec_grid_index(struct grid grid, half_diff angles);
/** The ranges of a bin: its angles from low (included) to high. */
void rec_grid_ranges(struct grid grid, int bin, half_diff *low, half_diff *high);

/** An isotropic BRDF as a table. Owns value; {0} is empty; release with rec_merl_free(). */
struct merl {
    double *value;  // [3][MERL_BINS]: red, green, blue; 1/sr; < 0 where there is none
};

/** Read a MERL file. On success the caller owns *merl; on failure it is untouched.
 *  STATUS_IO, STATUS_FORMAT (other dimensions or length, not a number) or STATUS_MEMORY. */
enum status rec_merl_read(struct merl *merl, const char *path, struct error *err);
/** Write a MERL file, complete or not at all. STATUS_IO. */
enum status rec_merl_write(const struct merl *merl, const char *path, struct error *err);
void rec_merl_free(struct merl *merl);

/* ---- models -------------------------------------------------------------------------------- */

enum { MODEL_PARAMETERS_MAX = 32 };

/** A parameter of a model: a number, or a colour of three. Physical values lie in [low, high]. */
struct parameter {
    const char *name;
    int size;  // 1 or 3
    double low, high;
};
struct lobe;
/** A reflectance model. Its parameters stand one after another in an array of doubles, in the
 *  order of the table, colours as three. */
struct model {
    const char *name;                   // as in fits.yaml and in scenes
    const char *source;                 // the paper
    const struct parameter *parameter;  // ends with {0}
    /** f[3] for unit wi, wo with wi.z > 0 and wo.z > 0. */
    void (*eval)(const double *parameters, vec3 wi, vec3 wo, double f[3]);
    /** The same with its derivatives by the parameters, slope [3][size]; NULL: take differences. */
    void (*slopes)(const double *parameters, vec3 wi, vec3 wo, double f[3], double *slope);
    /** The lobes that directions are drawn from, for light from wi (lobes.h); returns how many. */
    int (*lobes)(const double *parameters, vec3 wi, struct lobe *lobe);
};
/** The few models that a reconstruction tries; those, and the costlier ones that it tries where
 * none of the few fits; all models. Each ends with NULL. */
extern const struct model *const rec_models[];
extern const struct model *const rec_models_more[];
extern const struct model *const rec_models_all[];
/** The model that has a shape of its own in each channel, "NAME_rgb" (method: per_channel.c); the
 *  model itself where it has one already. */
const struct model *rec_model_per_channel(const struct model *model);
/** By name; NULL: there is none. */
const struct model *rec_model_find(const char *name);
/** How many doubles its parameters are. */
int rec_model_size(const struct model *model);

/* ---- any BRDF ---------------------------------------------------------------------------------
 */

struct lookup;
struct sampler;
/** What a BRDF of another format is: how to evaluate its data, for directions above the horizon,
 *  and to free it. */
struct brdf_kind {
    const char *name;
    void (*eval)(const void *data, vec3 wi, vec3 wo, double f[3]);
    void (*free)(void *data);
};
/** A BRDF from a file: a table, a model with its parameters, or what another format holds. {0} is
 *  empty; rec_brdf_free(). */
struct brdf {
    struct merl table;  // empty where model or kind is set
    const struct model *model;
    double value[MODEL_PARAMETERS_MAX];
    const struct brdf_kind *kind;
    void *data;
    struct lookup *lookup;    // of a table, made by rec_brdf_prepare
    struct sampler *sampler;  // likewise
};
/** From a folder OUT (its brdf.binary), or a file of any format that is read: MERL, RGL (.bsdf),
 * MIT and text tables, a fits.yaml (its best fit), parameters as JSON (of a collection
 * FILE#MODEL/NAME). Tables and models are prepared. On success the caller owns *brdf. STATUS_IO,
 * STATUS_FORMAT, STATUS_MEMORY. */
enum status rec_brdf_read(struct brdf *brdf, const char *path, struct error *err);
/** Make a brdf whose table was set by hand ready to be evaluated and sampled, or one of another
 * format ready to be sampled (it is tabulated for that); it must not change afterwards. A model
 * needs none. Then any number of threads may use it. STATUS_MEMORY. */
enum status rec_brdf_prepare(struct brdf *brdf, struct error *err);
/** One material of a collection {MODEL: {NAME: {PARAMETER: ...}}}, e.g. the published parameters of
 *  models sgd and abc. As rec_brdf_read. */
enum status rec_published_read(struct brdf *brdf, const char *path, const char *model,
                               const char *name, struct error *err);
/** A table of any BRDF: its values at the middles of bins, or a copy of its own. On success the
 *  caller owns *table. STATUS_MEMORY. */
enum status rec_brdf_table(struct merl *table, const struct brdf *brdf, int threads,
                           struct error *err);
void rec_brdf_free(struct brdf *brdf);
/** f[3], 1/sr; 0 below the horizon. A table is interpolated between the middles of its bins,
 *  continuously (method: lookup.c); one that is not prepared answers with the nearest bin. */
void rec_brdf_eval(const struct brdf *brdf, vec3 wi, vec3 wo, double f[3]);
/** The same for many pairs of directions [count], which is faster: f [count][3]. */
void rec_brdf_eval_many(const struct brdf *brdf, const vec3 *wi, const vec3 *wo, double (*f)[3],
                        size_t count);

/** Draw wo for light from wi, in proportion to about f cos(theta_o), by three independent numbers
 *  in [0, 1). Requires wi.z > 0, and a table that is prepared. Returns the density of *wo in 1/sr,
 * that of rec_brdf_pdf; 0 where the numbers led below the horizon, and an estimate gets nothing. */
double rec_brdf_sample(const struct brdf *brdf, vec3 wi, const double u[3], vec3 *wo);
/** The density with which rec_brdf_sample draws wo, 1/sr: it integrates to 1 less what is drawn
 *  below the horizon, and is above 0 wherever f is. */
double rec_brdf_pdf(const struct brdf *brdf, vec3 wi, vec3 wo);

#ifdef __cplusplus
}
#endif
#endif
