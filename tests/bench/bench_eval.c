/* bench_eval.c -- evaluations and samples a second of one core through the C face.
 *
 *     bench_eval [BRDF] [PAIRS]
 *
 * BRDF is a MERL table, a fits.yaml or OUT; by default a table of the model ggx. Directions are
 * strewn over the whole table, which is the worst for the caches. User CPU time: neighbours on the
 * machine disturb it little. Issue 7 asks for 20 million evaluations of a table a second.
 */
#include "reconstruct.h"

#include <stdlib.h>
#include <time.h>

enum { BLOCK = 4096 };

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static double chance(uint64_t *state)  // Marsaglia 2003
{
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return (double)(*state >> 11) * 0x1p-53;
}

static vec3 strewn(uint64_t *state)
{
    double z = 1 - chance(state), phi = 2 * CAP_PI * chance(state), s = sqrt(1 - z * z);
    return (vec3){s * cos(phi), s * sin(phi), z};
}

static enum status made_table(struct brdf *brdf, struct error *err)
{
    const double value[] = {0.3, 0.2, 0.1, 0.15, 1.5};
    brdf->table.value = malloc(3 * (size_t)MERL_BINS * sizeof(double));
    if (!brdf->table.value)
        return cap_fail(err, STATUS_MEMORY, "no memory for a table");
    for (int bin = 0; bin < MERL_BINS; bin++) {
        vec3 wi, wo;
        double f[3] = {-1, -1, -1};
        rec_directions(rec_merl_center(bin), &wi, &wo);
        if (wi.z > 0 && wo.z > 0)
            rec_model_find("ggx")->eval(value, wi, wo, f);
        for (int c = 0; c < 3; c++)
            brdf->table.value[(size_t)c * MERL_BINS + (size_t)bin] = f[c];
    }
    return rec_brdf_prepare(brdf, err);
}

int main(int argc, char **argv)
{
    struct brdf brdf = {0};
    struct error err = {0};
    enum status status =
        argc > 1 && *argv[1] ? rec_brdf_read(&brdf, argv[1], &err) : made_table(&brdf, &err);
    long pairs = argc > 2 ? atol(argv[2]) : 20000000, done = 0;
    if (status)
        return cap_exit(status, &err);
    static vec3 wi[BLOCK], wo[BLOCK];
    static double f[BLOCK][3];
    uint64_t state = 88172645463325252ull;
    double many = 0, one = 0, drawn = 0, sum = 0;
    while (done < pairs) {
        for (int i = 0; i < BLOCK; i++) {
            wi[i] = strewn(&state);
            wo[i] = strewn(&state);
        }
        double begin = seconds();
        rec_brdf_eval_many(&brdf, wi, wo, f, BLOCK);
        many += seconds() - begin;
        sum += f[0][0];
        begin = seconds();
        for (int i = 0; i < BLOCK; i++)
            rec_brdf_eval(&brdf, wi[i], wo[i], f[i]);
        one += seconds() - begin;
        begin = seconds();
        for (int i = 0; i < BLOCK; i++) {
            double u[3] = {f[i][0] - floor(f[i][0]), wo[i].z, wi[i].z};
            sum += rec_brdf_sample(&brdf, wi[i], u, &wo[i]);
        }
        drawn += seconds() - begin;
        done += BLOCK;
    }
    printf("%-34s %8.1f million a second\n", "rec_brdf_eval_many", 1e-6 * (double)done / many);
    printf("%-34s %8.1f\n", "rec_brdf_eval", 1e-6 * (double)done / one);
    printf("%-34s %8.1f     (%g)\n", "rec_brdf_sample", 1e-6 * (double)done / drawn, sum);
    rec_brdf_free(&brdf);
    return 0;
}
