/* random.h -- random numbers that depend on where they are used, not on when.
 *
 * A stream is named by a seed and a place (frame, photosite); its numbers are the same at any
 * number of threads and in any order of work.
 */
#ifndef GONIOCAM_SAMPLES_RANDOM_H
#define GONIOCAM_SAMPLES_RANDOM_H

#include <stdint.h>

/** One stream. Begin with sam_random_at(). */
struct random {
    uint32_t key[2], counter[4];
    uint32_t ready[4];
    int left;  // numbers still unused in ready
};

/** The stream of photosite `site` of frame `frame` under a seed. */
struct random sam_random_at(uint64_t seed, uint32_t frame, uint64_t site);
/** Uniform in (0, 1), 32 bits. */
double sam_uniform(struct random *random);
/** Standard normal. */
double sam_normal(struct random *random);
/** Poisson of the given mean, exact for every mean in [0, 1e9]. */
double sam_poisson(struct random *random, double mean);
#endif
