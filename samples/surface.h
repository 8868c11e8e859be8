/* surface.h -- small patches of explicit geometry, for the goniometer. */
#ifndef GONIOCAM_SAMPLES_SURFACE_H
#define GONIOCAM_SAMPLES_SURFACE_H

#include "material.h"

/** What SURFACE.yaml says. */
struct surface {
    enum { SURFACE_GAUSSIAN, SURFACE_FIBRES } kind;
    double alpha;  // of a height field: Beckmann's width, root of the slopes' total variance
    int nodes;     // of a height field, along a side
    int fibres;    // how many of them; of a pile on a plane
    double radius, length;     // of a fibre, as parts of the patch's side
    double tilt;               // largest from the normal, radians
    struct material material;  // of its surface: one model, or a mirror
    long long rays;
    int bounces;
    uint64_t seed;
};
/** On success the caller owns *surface; sam_surface_free(). STATUS_IO, STATUS_FORMAT with file,
 * line and key. */
enum status sam_surface_read(struct surface *surface, const char *path, struct error *err);
void sam_surface_free(struct surface *surface);

/** The patch made: rays are to cross its mean plane within |x|, |y| <= core of the middle, and
 * begin at z = top. What lies around it is there for their way in and out. */
struct patch_mesh {
    struct mesh *mesh;
    double core, top;
};
/** On success the caller owns patch->mesh. STATUS_MEMORY. */
enum status sam_surface_make(struct patch_mesh *patch, const struct surface *surface, int threads,
                             struct error *err);

// The two kinds, each in the file of its name: points, normals and triangles of a patch.
struct geometry {
    vec3 *point, *normal;
    unsigned (*triangle)[3];
    int points, triangles;
};
/** Owns its arrays, which may be NULL where memory ran out. */
struct geometry sam_gaussian_field(const struct surface *surface, int threads);
struct geometry sam_fibres(const struct surface *surface);
#endif
