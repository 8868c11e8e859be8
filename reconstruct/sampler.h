/* sampler.h -- directions drawn in proportion to a table. */
#ifndef GONIOCAM_SAMPLER_H
#define GONIOCAM_SAMPLER_H

#include "lookup.h"

struct sampler;

/** On success the caller owns *sampler, which does not refer to the lookup. STATUS_MEMORY. */
enum status rec_sampler_make(struct sampler **sampler, const struct lookup *lookup,
                             struct error *err);
/** NULL is empty. */
void rec_sampler_free(struct sampler *sampler);
/** As rec_brdf_sample and, above the horizon, rec_brdf_pdf. */
double rec_sampler_draw(const struct sampler *sampler, vec3 wi, const double u[3], vec3 *wo);
double rec_sampler_density(const struct sampler *sampler, vec3 wi, vec3 wo);

#endif
