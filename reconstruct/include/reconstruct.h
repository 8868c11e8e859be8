/* reconstruct.h -- the face of reconstruct/: reflectance samples, MERL bins, models, fits.
 *
 * Directions are unit vectors in the local frame of the surface, whose normal is +z, and point
 * away from it: wi to the light, wo to the camera. Angles are in radians. f is in 1/sr and holds
 * no foreshortening: L = f I cos(theta_i) / r^2.
 */
#ifndef GONIOCAM_RECONSTRUCT_H
#define GONIOCAM_RECONSTRUCT_H

#include "calib.h"

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

/* ---- models -------------------------------------------------------------------------------- */

enum { MODEL_PARAMETERS_MAX = 32 };

/** A parameter of a model: a number, or a colour of three. Physical values lie in [low, high]. */
struct parameter {
    const char *name;
    int size;  // 1 or 3
    double low, high;
};
/** A reflectance model. Its parameters stand one after another in an array of doubles, in the
 *  order of the table, colours as three. */
struct model {
    const char *name;    // as in fits.yaml and in scenes
    const char *source;  // the paper
    const struct parameter *parameter;  // ends with {0}
    /** f[3] for unit wi, wo with wi.z > 0 and wo.z > 0. */
    void (*eval)(const double *parameters, vec3 wi, vec3 wo, double f[3]);
};
/** All models; ends with NULL. */
extern const struct model *const rec_models[];
/** By name; NULL: there is none. */
const struct model *rec_model_find(const char *name);
/** How many doubles its parameters are. */
int rec_model_size(const struct model *model);

extern const struct command rec_commands[];

#ifdef __cplusplus
}
#endif
#endif
