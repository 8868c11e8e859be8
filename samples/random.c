/* random.c -- Philox streams, normal and Poisson numbers.
 *
 * Method.   Philox4x32-10 maps (key, counter) to 128 random bits: Salmon et al., "Parallel Random
 *           Numbers: As Easy as 1, 2, 3", SC 2011. Normal: Box and Muller 1958. Poisson: below a
 *           mean of 10 products of uniforms (Knuth); from there PTRS, transformed rejection with
 *           squeeze (W. Hoermann, "The transformed rejection method for generating Poisson random
 *           variables", Insurance: Mathematics and Economics 12, 1993).
 * Accuracy. Both Poisson methods are exact but for the 32 bits of a uniform.
 */
#include "random.h"

#include "capture.h"

#include <assert.h>
#include <math.h>

static void philox_round(uint32_t c[4], const uint32_t key[2])
{
    uint64_t a = (uint64_t)0xD2511F53u * c[0], b = (uint64_t)0xCD9E8D57u * c[2];  // the paper's
    uint32_t next[4] = {(uint32_t)(b >> 32) ^ c[1] ^ key[0], (uint32_t)b,
                        (uint32_t)(a >> 32) ^ c[3] ^ key[1], (uint32_t)a};
    for (int i = 0; i < 4; i++)
        c[i] = next[i];
}

static void philox(struct random *random)
{
    uint32_t key[2] = {random->key[0], random->key[1]};
    for (int i = 0; i < 4; i++)
        random->ready[i] = random->counter[i];
    for (int round = 0; round < 10; round++) {
        philox_round(random->ready, key);
        key[0] += 0x9E3779B9u;  // the golden ratio and sqrt(3) - 1, as in the paper
        key[1] += 0xBB67AE85u;
    }
    random->counter[0]++;
    random->left = 4;
}

struct random sam_random_at(uint64_t seed, uint32_t frame, uint64_t site)
{
    return (struct random){
        .key = {(uint32_t)seed, (uint32_t)(seed >> 32)},
        .counter = {0, frame, (uint32_t)site, (uint32_t)(site >> 32)},
    };
}

double sam_uniform(struct random *random)
{
    if (!random->left)
        philox(random);
    return (random->ready[--random->left] + 0.5) * 0x1p-32;
}

double sam_normal(struct random *random)
{
    double radius = sqrt(-2 * log(sam_uniform(random)));
    return radius * cos(2 * CAP_PI * sam_uniform(random));
}

static double poisson_by_products(struct random *random, double mean)
{
    double limit = exp(-mean), product = sam_uniform(random);
    int n = 0;
    for (; product > limit; n++)
        product *= sam_uniform(random);
    return n;
}

/** ln k!, by Stirling's series from 10 on (error below 1e-10), by a sum before. */
static double log_factorial(double k)
{
    double sum = 0;
    if (k < 10) {
        for (int i = 2; i <= (int)k; i++)
            sum += log(i);
        return sum;
    }
    double x = k + 1, xx = x * x;
    return (x - 0.5) * log(x) - x + 0.91893853320467274  // ln(2 pi) / 2
           + (1 - (1 - 2 / (7 * xx)) / (30 * xx)) / (12 * x);
}

/** PTRS; the numbers are the published ones. */
static double poisson_by_rejection(struct random *random, double mean)
{
    double b = 0.931 + 2.53 * sqrt(mean), a = -0.059 + 0.02483 * b;
    double squeeze = 0.9277 - 3.6224 / (b - 2);
    for (;;) {
        double u = sam_uniform(random) - 0.5, v = sam_uniform(random);
        double us = 0.5 - fabs(u), k = floor((2 * a / us + b) * u + mean + 0.43);
        if (us >= 0.07 && v <= squeeze)
            return k;
        if (k < 0 || (us < 0.013 && v > us))
            continue;
        double inverse_alpha = 1.1239 + 1.1328 / (b - 3.4);
        if (log(v * inverse_alpha / (a / (us * us) + b)) <= k * log(mean) - mean - log_factorial(k))
            return k;
    }
}

double sam_poisson(struct random *random, double mean)
{
    assert(mean >= 0 && mean <= 1e9);
    return mean < 10 ? poisson_by_products(random, mean) : poisson_by_rejection(random, mean);
}
