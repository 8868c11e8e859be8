/* shade.h -- how much light leaves a spot: direct light from the lamp, with shadows. */
#ifndef GONIOCAM_SAMPLES_SHADE_H
#define GONIOCAM_SAMPLES_SHADE_H

#include "light.h"
#include "world.h"

/** Cosines from 0 to 1 at which a directional albedo is known. */
enum { AMBIENT_ANGLES = 65 };
struct ambient_albedo {
    double at[AMBIENT_ANGLES][3];
};

/** A shot, ready for rays. */
struct shot_view {
    const struct world *world;
    struct lighting light;
    struct vantage eye_vantage;
    struct vantage lamp_vantage;  // of rays to the lamp's parts
    struct vantage lamp_around;   // of rays to its middle, wide enough for its radius
    mat3 rotation;
    vec3 eye;
    const struct ambient_albedo *ambient;  // of the sample, then the things; NULL: no ambient light
};

/** A material's directional albedo, integral of f cos(theta_i) over the hemisphere, for light that
 *  leaves at cosine i / (AMBIENT_ANGLES - 1). */
void sam_ambient_albedo(const struct material *material, struct ambient_albedo *albedo);
/** The radiance towards wo that even light from everywhere adds; nothing is in its way. */
void sam_ambient_add(const struct shot_view *view, const struct spot *spot, vec3 wo, double rgb[3]);

/** How much of the lamp a spot sees. */
enum lit { LIT_NOT, LIT_PARTLY, LIT_FULLY };

struct shot_view sam_shot_view(const struct world *world, const struct scene_shot *shot);
/** f of a spot. What is matt is albedo/pi; materials are isotropic, but for the sample's flaws. */
void sam_reflectance(const struct world *world, const struct spot *spot, vec3 wi, vec3 wo,
                     double f[3]);
enum lit sam_lit(const struct shot_view *view, const struct spot *spot, vec3 wo);
/** The radiance of a spot towards wo, L = f I cos(theta_i) / r^2, summed over what it sees of the
 *  lamp. lit is sam_lit's. */
void sam_shade(const struct shot_view *view, const struct spot *spot, enum lit lit, vec3 wo,
               double rgb[3]);
#endif
