/* bench_fits.c -- models fitted to complete tables of the published SGD materials.
 *
 *     bench_fits JSON MODELS STEP COST
 *
 * JSON holds the published parameters (../shared/data/sgd_abc.json); MODELS are as goniocam fit's,
 * or all; every STEP-th material is taken; COST is a number of
 * enum fit_cost. Each is made into a table by our SGD model and fitted. A line for each material
 * and model, in columns: material, model, processor seconds of all fits of this material, seconds,
 * median relative error over all bins and channels in per cent, PSNR and delta E under a lamp, and
 * in a room; and, after the models, variance of the albedo's estimate at 10, 45 and 75 degrees by
 * the table's own sampling over that by the best model's lobes. tests/bench/fit_table.py runs it
 * and sums it up.
 */
#include "reconstruct.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { MODELS = 64 };

static double seconds(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void read_material(double *value, json_t *material)
{
    for (const struct parameter *p = rec_model_find("sgd")->parameter; p->name; p++)
        for (int c = 0; c < 3; c++) {
            double x = json_number_value(json_array_get(json_object_get(material, p->name), c));
            *value++ = fmin(p->high, fmax(p->low, x));
        }
}

static void make_table(struct merl *table, const double *value)
{
#pragma omp parallel for
    for (int bin = 0; bin < MERL_BINS; bin++) {
        vec3 wi, wo;
        double f[3] = {-1, -1, -1};
        rec_directions(rec_merl_center(bin), &wi, &wo);
        if (wi.z > 0 && wo.z > 0)
            rec_model_find("sgd")->eval(value, wi, wo, f);
        for (int c = 0; c < 3; c++)
            table->value[(size_t)c * MERL_BINS + (size_t)bin] = f[c];
    }
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// Of every seventh bin, all channels.
static double median_error(const struct merl *table, const struct fit *fit)
{
    double *error = malloc(3 * (MERL_BINS / 7 + 1) * sizeof *error), median;
    int n = 0;
    for (int bin = 0; bin < MERL_BINS && error; bin += 7) {
        vec3 wi, wo;
        double f[3];
        rec_directions(rec_merl_center(bin), &wi, &wo);
        if (wi.z <= 0 || wo.z <= 0)
            continue;
        fit->model->eval(fit->value, wi, wo, f);
        for (int c = 0; c < 3; c++)
            error[n++] = fabs(f[c] / table->value[(size_t)c * MERL_BINS + (size_t)bin] - 1);
    }
    qsort(error, (size_t)n, sizeof *error, by_size);
    median = n ? error[n / 2] : NAN;
    free(error);
    return median;
}

static double chance(uint64_t *state)  // Marsaglia 2003
{
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return (double)(*state >> 11) * 0x1p-53;
}

// Variance of f cos_o / density over its mean squared.
static double variance(const struct brdf *table, const struct brdf *by, double theta)
{
    uint64_t state = 88172645463325252ull;
    double sum = 0, sum2 = 0;
    const int drawn = 20000;
    vec3 wi = {sin(theta), 0, cos(theta)};
    for (int i = 0; i < drawn; i++) {
        double u[3] = {chance(&state), chance(&state), chance(&state)}, f[3];
        vec3 wo;
        double density = rec_brdf_sample(by, wi, u, &wo);
        if (density == 0)
            continue;
        rec_brdf_eval(table, wi, wo, f);
        double x = (f[0] + f[1] + f[2]) / 3 * wo.z / density;
        sum += x;
        sum2 += x * x;
    }
    return sum2 * drawn / (sum * sum) - 1;
}

static void print_sampling(const char *name, const struct brdf *table, const struct fits *fits)
{
    printf("%s sampling", name);
    for (double theta = 10; theta < 80; theta += 32.5) {
        double least = INFINITY, own = variance(table, table, theta * CAP_PI / 180);
        for (int i = 0; i < fits->count; i++) {
            struct brdf brdf = {.model = fits->fit[i].model};
            memcpy(brdf.value, fits->fit[i].value, sizeof brdf.value);
            least = fmin(least, variance(table, &brdf, theta * CAP_PI / 180));
        }
        // Below a tenth of a per cent of a standard deviation a draw nobody sees a difference.
        printf(" %.3g", fmax(own, 1e-6) / fmax(least, 1e-6));
    }
    printf("\n");
}

static enum status fit_material(const char *name, const double *value, enum fit_cost cost,
                                const struct model *const *models, int count, struct run *run,
                                struct error *err)
{
    struct brdf table = {.table = {malloc(3 * (size_t)MERL_BINS * sizeof(double))}};
    struct bins bins = {0};
    struct fits fits = {0};
    make_table(&table.table, value);
    enum status status = rec_brdf_prepare(&table, err);
    double begin = seconds(CLOCK_MONOTONIC), spent = seconds(CLOCK_PROCESS_CPUTIME_ID);
    if (!status)
        status = rec_bins_of_table(&bins, &table.table, err);
    if (!status)
        status = rec_fit_by(&fits, &bins, cost, models, count, run, err);
    if (!status)
        status = rec_fit_pictures(&fits, &table, run, err);
    begin = seconds(CLOCK_MONOTONIC) - begin;
    spent = seconds(CLOCK_PROCESS_CPUTIME_ID) - spent;
    for (int i = 0; i < fits.count && !status; i++) {
        const struct fit *f = &fits.fit[i];
        printf("%s %s %.2f %.2f %.4f %.2f %.3f %.2f %.3f\n", name, f->model->name, spent, begin,
               100 * median_error(&table.table, f), f->psnr[0], f->delta_e[0], f->psnr[1],
               f->delta_e[1]);
    }
    if (!status)
        print_sampling(name, &table, &fits);
    fflush(stdout);
    rec_fits_free(&fits);
    rec_bins_free(&bins);
    rec_brdf_free(&table);
    return status;
}

static int models_named(const struct model **models, char *names)
{
    int count = 0;
    if (strcmp(names, "all") == 0)
        for (; rec_models_all[count]; count++)
            models[count] = rec_models_all[count];
    else
        for (char *rest = NULL, *name = strtok_r(names, ",", &rest); name && count < MODELS;
             name = strtok_r(NULL, ",", &rest))
            if ((models[count] = rec_model_find(name)))
                count++;
    return count;
}

int main(int argc, char **argv)
{
    const struct model *models[MODELS];
    int count = argc == 5 ? models_named(models, argv[2]) : 0, step = argc == 5 ? atoi(argv[3]) : 0;
    enum fit_cost cost = argc == 5 ? (enum fit_cost)atoi(argv[4]) : FIT_LOG;
    if (!count || step < 1) {
        fprintf(stderr, "bench_fits JSON MODELS STEP COST\n");
        return 2;
    }
    struct run run;
    struct error err = {0};
    enum status status = STATUS_OK;
    json_error_t why;
    json_t *root = json_load_file(argv[1], 0, &why), *materials = json_object_get(root, "sgd");
    const char *name;
    json_t *material;
    int k = 0;
    cap_run_begin(&run, 0, true);
    if (!materials)
        status = cap_fail(&err, STATUS_FORMAT, "%s: no published materials: %s", argv[1], why.text);
    json_object_foreach(materials, name, material)
    {
        double value[MODEL_PARAMETERS_MAX];
        if (status || k++ % step)
            continue;
        read_material(value, material);
        status = fit_material(name, value, cost, models, count, &run, &err);
    }
    json_decref(root);
    cap_run_end(&run);
    return cap_exit(status, &err);
}
