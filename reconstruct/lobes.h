/* lobes.h -- what directions are drawn from: a mixture of lobes whose densities are known.
 *
 * A model names the lobes that resemble it for light from wi, and about how much light each sends
 * back; f itself need not be the mixture.
 */
#ifndef GONIOCAM_LOBES_H
#define GONIOCAM_LOBES_H

#include "microfacet.h"

enum { LOBES_MAX = 8 };

/** Lobes of h have wo mirrored at h, and density p(h) / (4 wi.h). */
enum lobe_kind {
    LOBE_COSINE,    // cos_o / pi
    LOBE_VISIBLE,   // h: GGX facets of width shape[0] that wi sees
    LOBE_BECKMANN,  // h: D cos_h of width shape[0]
    LOBE_POWER,     // h: cos_h^shape[0]
    LOBE_GTR,       // h: D cos_h, D = k / (a^2 cos^2 + sin^2)^g, a = shape[0], g = shape[1]
    LOBE_GAMMA,     // h: about the SGD model's D cos_h, alpha = shape[0], p = shape[1]
    LOBE_ABC,       // h: (1 + shape[0] (1 - cos_h))^-shape[1]
    LOBE_AXIS,      // (wo.axis)^n, n = shape[2], axis along (shape[0] wi.xy, shape[1] wi.z)
};
struct lobe {
    enum lobe_kind kind;
    double weight;  // >= 0: about how much of the light it sends back
    double shape[3];
};

/** A matt body and lobes beside it: fill lobe[0], and return 1. */
int rec_lobe_body(struct lobe *lobe, const double colour[3]);
/** Another lobe of one shape number or two. */
static inline struct lobe rec_lobe(enum lobe_kind kind, double weight, double a, double b)
{
    struct lobe lobe = {.kind = kind, .weight = weight, .shape = {a, b}};
    return lobe;
}
/** The mean of a colour's three channels. */
static inline double rec_mean(const double colour[3])
{
    return (colour[0] + colour[1] + colour[2]) / 3;
}

/** As rec_brdf_sample and rec_brdf_pdf, of a model. */
double rec_lobes_sample(const struct model *model, const double *parameters, vec3 wi,
                        const double u[3], vec3 *wo);
double rec_lobes_pdf(const struct model *model, const double *parameters, vec3 wi, vec3 wo);

#endif
