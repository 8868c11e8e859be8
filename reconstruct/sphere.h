/* sphere.h -- a picture of a sphere of a material, and how two such pictures differ. */
#ifndef GONIOCAM_SPHERE_H
#define GONIOCAM_SPHERE_H

#include "reconstruct.h"

enum { SPHERE_SIZE = 256 };

/** Where the lamp stands. */
extern const vec3 rec_sphere_lamp;
/** Radiance of the point of a sphere whose normal is n, seen along -z under a lamp at infinity,
 *  irradiance pi. */
void rec_sphere_shade(const struct brdf *brdf, vec3 n, vec3 lamp, double radiance[3]);

/** The sphere seen along -z from afar under a lamp at infinity 30 degrees off the view (to the
 * upper left), irradiance pi: linear rgb [SPHERE_SIZE][SPHERE_SIZE][3], 0 beside the sphere and
 * where the lamp does not shine. */
void rec_lit_sphere(float *rgb, const struct brdf *brdf, int threads);
/** Is the pixel on the sphere? */
bool rec_on_sphere(int x, int y);

/** CIE 2000 colour difference of two linear sRGB colours (method: sphere.c). */
double rec_delta_e(const double a[3], const double b[3]);

/** How two pictures differ, over the sphere's pixels clipped to [0, 1]. */
struct picture_errors {
    double psnr;        // dB of linear values, peak 1; INFINITY: no difference
    double delta_e;     // mean CIE 2000 colour difference, of linear sRGB
    double delta_e_95;  // that 95 % of the pixels do not exceed
};
/** STATUS_MEMORY. */
enum status rec_sphere_compare(struct picture_errors *errors, const float *a, const float *b,
                               struct error *err);
#endif
