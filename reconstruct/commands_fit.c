/* commands_fit.c -- the command fit: arguments and messages, no arithmetic. */
#include "commands.h"

#include "bins_hdf5.h"
#include "samples_bins.h"
#include "summary.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

const struct option rec_fit_options[] = {
    {"model", "LIST", "models, as ggx,lambert (default: all)", 'm'},
    {"cost", "COST", "statistical (of measurements), picture (of tables), log or cube-root", 'c'},
    {"per-channel", NULL, "a shape of its own in each channel: models NAME_rgb", 0},
    {"output", "FILE", "where to (default: fits.yaml in OUT, or beside the table)", 'o'},
    {0},
};

enum { MODELS_MAX = 64 };

static void tell_models(const char *wrong)
{
    fprintf(stderr, "goniocam: no model is called '%s'; there are:", wrong);
    for (const struct model *const *m = rec_models_all; *m; m++)
        fprintf(stderr, " %s", (*m)->name);
    fprintf(stderr, "\n");
}

// "ggx,lambert" to models. false: one is unknown, and a message is out.
static bool models_named(const struct model **models, int *count, const char *names)
{
    char *rest = NULL, *copy = strdup(names);
    bool known = copy != NULL;
    *count = 0;
    for (char *name = known ? strtok_r(copy, ",", &rest) : NULL; known && name;
         name = strtok_r(NULL, ",", &rest)) {
        const struct model *model = rec_model_find(name);
        known = model && *count < MODELS_MAX;
        if (known)
            models[(*count)++] = model;
        else
            tell_models(name);
    }
    free(copy);
    return known && *count > 0;
}

// All models, or those that are named; with --per-channel, in their variants.
static bool models_asked(const struct model **models, int *count, const struct arguments *args)
{
    const char *names = cap_option(args, "model");
    if (names && !models_named(models, count, names))
        return false;
    for (*count = names ? *count : 0; !names && rec_models_all[*count]; ++*count)
        models[*count] = rec_models_all[*count];
    for (int i = 0; i < *count && cap_option(args, "per-channel"); i++)
        models[i] = rec_model_per_channel(models[i]);
    return true;
}

static bool is_folder(const char *path)
{
    struct stat info;
    return stat(path, &info) == 0 && S_ISDIR(info.st_mode);
}

static bool is_measured(const char *path)
{
    return is_folder(path) || rec_is_hdf5(path);
}

static bool cost_asked(enum fit_cost *cost, const struct arguments *args)
{
    static const char *const names[] = {"statistical", "log", "cube-root", "picture"};
    const char *name = cap_option(args, "cost");
    *cost = is_measured(args->positional[0]) ? FIT_STATISTICAL : FIT_PICTURE;
    for (int k = 0; name && k < 4; k++)
        if (strcmp(name, names[k]) == 0) {
            *cost = (enum fit_cost)k;
            return true;
        }
    if (name)
        fprintf(stderr, "goniocam: --cost wants statistical, log, cube-root or picture, not %s\n",
                name);
    return !name;
}

// What is fitted: bins, and a complete table where there is one.
struct target {
    struct bins bins;
    struct brdf table;
};

static void target_free(struct target *t)
{
    rec_bins_free(&t->bins);
    rec_brdf_free(&t->table);
}

static enum status read_folder(struct target *t, const char *path, struct error *err)
{
    char *bins = cap_path(path, "bins.h5"), *table = cap_path(path, "brdf.binary");
    enum status status = bins && table ? rec_bins_read(&t->bins, bins, err)
                                       : cap_fail(err, STATUS_MEMORY, "no memory");
    if (!status && access(table, R_OK) == 0)
        status = rec_brdf_read(&t->table, table, err);
    free(bins);
    free(table);
    return status;
}

// OUT, bins.h5, samples.h5, or any BRDF, which is tabulated where it is none.
static enum status read_target(struct target *t, const char *path, struct run *run,
                               struct error *err)
{
    if (is_folder(path))
        return read_folder(t, path, err);
    if (rec_is_hdf5(path))
        return rec_has_samples(path) ? rec_samples_bins(&t->bins, path, run, err)
                                     : rec_bins_read(&t->bins, path, err);
    struct brdf read = {0};
    enum status status = rec_brdf_read(&read, path, err);
    if (!status && read.lookup) {
        t->table = read;
        read = (struct brdf){0};
    } else if (!status) {
        status = rec_brdf_table(&t->table.table, &read, run->threads, err);
        if (!status)
            status = rec_brdf_prepare(&t->table, err);
    }
    if (!status)
        status = rec_bins_of_table(&t->bins, &t->table.table, err);
    rec_brdf_free(&read);
    return status;
}

// Where the fits go: -o FILE, or fits.yaml in OUT, or beside the table.
static char *fits_path(const char *input, const char *output)
{
    if (output)
        return strdup(output);
    if (is_folder(input))
        return cap_path(input, "fits.yaml");
    char *path;
    return asprintf(&path, "%s.fits.yaml", input) < 0 ? NULL : path;
}

static enum status fit(struct fits *fits, const struct target *target, enum fit_cost cost,
                       const struct model *const *models, int count, struct run *run,
                       struct error *err)
{
    cap_stage(run, "fit", count);
    enum status status = rec_fit_by(fits, &target->bins, cost, models, count, run, err);
    if (!status && target->table.lookup)
        status = rec_fit_pictures(fits, &target->table, run, err);
    return status;
}

static void tell(const struct fits *fits, const char *path, bool json)
{
    if (json)
        printf("{\"fits\": \"%s\", \"best_fit\": \"%s\", \"log_rms\": %.4g}\n", path,
               fits->fit[0].model->name, fits->fit[0].log_rms);
    for (int i = 0; !json && i < fits->count; i++)
        rec_fit_print(&fits->fit[i]);
}

int rec_run_fit(const struct arguments *args)
{
    const struct model *models[MODELS_MAX];
    enum fit_cost cost;
    int count = 0, threads;
    if (args->count != 1 || !models_asked(models, &count, args) || !cost_asked(&cost, args)
        || !cap_option_int(args, "threads", 1, 1024, 0, &threads))
        return 2;
    struct run run;
    struct error err = {0};
    struct target target = {0};
    struct fits fits = {0};
    cap_run_begin(&run, threads, cap_option(args, "quiet") != NULL);
    char *path = fits_path(args->positional[0], cap_option(args, "output"));
    enum status status = path ? STATUS_OK : cap_fail(&err, STATUS_MEMORY, "no memory");
    if (!status)
        status = read_target(&target, args->positional[0], &run, &err);
    if (!status)
        status = fit(&fits, &target, cost, models, count, &run, &err);
    if (!status)
        status = rec_fits_write(&fits, path, &err);
    cap_run_end(&run);
    if (!status)
        tell(&fits, path, cap_option(args, "json") != NULL);
    rec_fits_free(&fits);
    target_free(&target);
    free(path);
    return cap_exit(status, &err);
}
