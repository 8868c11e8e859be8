/* plain.h -- a material as most renderers know it. */
#ifndef GONIOCAM_PLAIN_H
#define GONIOCAM_PLAIN_H

#include "reconstruct.h"

/** Matt colour under a GGX gloss, or a GGX metal. */
struct plain {
    enum { PLAIN_MATT, PLAIN_GLOSSY, PLAIN_METAL } kind;
    double albedo[3];   // Lambert's, of matt and glossy ones
    double alpha, ior;  // GGX width; of glossy ones
    double f0[3];       // reflectance at normal incidence: a metal's colour, a gloss's strength
    const char *model;  // that it was taken from
};

/** From the best model of fits.yaml that is one of these (lambert, ggx, ggx_schlick), or the BRDF's
 *  own, else from a fit of them to it. Statuses are those of rec_fits_read and rec_fit. */
enum status rec_plain_find(struct plain *plain, const struct brdf *brdf, const char *path,
                           struct run *run, struct error *err);
/** What a dielectric lets through and back at normal incidence, 1 - f0. */
double rec_plain_through(const struct plain *plain);
#endif
