/* commands.c -- the commands of reconstruct/: arguments and messages, no arithmetic. */
#include "commands.h"

#include "bins_hdf5.h"
#include "eval_lines.h"
#include "info.h"
#include "summary.h"
#include "team.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static bool begin(struct run *run, const struct arguments *args)
{
    int threads;
    if (!cap_option_int(args, "threads", 1, 1024, rec_team_threads, &threads))
        return false;
    cap_run_begin(run, threads, cap_option(args, "quiet") != NULL);
    return true;
}

/* ---- reconstruct ------------------------------------------------------------------------------
 */

// "180x90x180". false: no such grid, or more bins than 2^28.
static bool read_grid(struct grid *grid, const char *text)
{
    char rest;
    *grid = (struct grid){0};
    if (!text)
        return true;
    return sscanf(text, "%dx%dx%d%c", &grid->theta_h, &grid->theta_d, &grid->phi_d, &rest) == 3
           && grid->theta_h > 0 && grid->theta_d > 0 && grid->phi_d > 0
           && (double)grid->theta_h * grid->theta_d * grid->phi_d <= 1 << 28;
}

static int run_reconstruct(const struct arguments *args)
{
    const char *out = cap_option(args, "output");
    if (args->count != 1 || !out)
        return 2;
    struct run run;
    struct error err = {0};
    struct summary summary;
    if (!begin(&run, args))
        return 2;
    struct request request = {.capture = args->positional[0],
                              .out = out,
                              .calibration = cap_option(args, "calibration"),
                              .samples = cap_option(args, "samples") != NULL};
    if (!read_grid(&request.grid, cap_option(args, "bins"))) {
        fprintf(stderr, "goniocam: --bins wants three numbers of bins, as 180x90x180\n");
        return 2;
    }
    enum status status = rec_reconstruct(&summary, &request, &run, &err);
    cap_run_end(&run);
    if (!status && rec_leads())
        (cap_option(args, "json") ? rec_summary_print_json : rec_summary_print)(&summary, out);
    return rec_leads() ? cap_exit(status, &err) : status != STATUS_OK;
}

/* ---- fit --------------------------------------------------------------------------------------
 */

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

static bool is_folder(const char *path)
{
    struct stat info;
    return stat(path, &info) == 0 && S_ISDIR(info.st_mode);
}

static enum status read_bins(struct bins *bins, const char *path, int threads, struct error *err)
{
    if (is_folder(path)) {
        char *file = cap_path(path, "bins.h5");
        enum status status =
            file ? rec_bins_read(bins, file, err) : cap_fail(err, STATUS_MEMORY, "no memory");
        free(file);
        return status;
    }
    struct brdf brdf = {0};
    struct merl table = {0};
    enum status status = rec_brdf_read(&brdf, path, err);
    if (!status)
        status = rec_brdf_table(&table, &brdf, threads, err);
    if (!status)
        status = rec_bins_of_table(bins, &table, err);
    rec_merl_free(&table);
    rec_brdf_free(&brdf);
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

static int run_fit(const struct arguments *args)
{
    const char *names = cap_option(args, "model");
    const struct model *models[MODELS_MAX];
    int count = 0;
    struct run run;
    if (args->count != 1 || (names && !models_named(models, &count, names)) || !begin(&run, args))
        return 2;
    struct error err = {0};
    struct bins bins = {0};
    struct fits fits = {0};
    char *path = fits_path(args->positional[0], cap_option(args, "output"));
    enum status status = path ? STATUS_OK : cap_fail(&err, STATUS_MEMORY, "no memory");
    if (!status)
        status = read_bins(&bins, args->positional[0], run.threads, &err);
    if (!status) {
        cap_stage(&run, "fit", 0);
        status = rec_fit(&fits, &bins, names ? models : NULL, count, &run, &err);
    }
    if (!status)
        status = rec_fits_write(&fits, path, &err);
    cap_run_end(&run);
    if (!status && cap_option(args, "json"))
        printf("{\"fits\": \"%s\", \"best_fit\": \"%s\", \"log_rms\": %.4g}\n", path,
               fits.fit[0].model->name, fits.fit[0].log_rms);
    for (int i = 0; !status && !cap_option(args, "json") && i < fits.count; i++)
        rec_fit_print(&fits.fit[i]);
    rec_fits_free(&fits);
    rec_bins_free(&bins);
    free(path);
    return cap_exit(status, &err);
}

/* ---- eval -------------------------------------------------------------------------------------
 */

static int run_eval(const struct arguments *args)
{
    struct run run;
    if (args->count != 1 || !begin(&run, args))
        return 2;
    struct brdf brdf = {0};
    struct error err = {0};
    enum status status = rec_brdf_read(&brdf, args->positional[0], &err);
    if (!status)
        status = rec_eval_lines(&brdf, STDIN_FILENO, stdout, run.threads, &err);
    cap_run_end(&run);
    rec_brdf_free(&brdf);
    return cap_exit(status, &err);
}

/* ---- info -------------------------------------------------------------------------------------
 */

static int run_info(const struct arguments *args)
{
    struct error err = {0};
    if (args->count != 1)
        return 2;
    return cap_exit(rec_info(args->positional[0], cap_option(args, "json"), stdout, &err), &err);
}

static const struct option reconstruct_options[] = {
    {"output", "OUT", "folder for everything that is found", 'o'},
    {"calibration", "FILE", "start from this calibration.yaml: no board is needed", 0},
    {"bins", "HxDxP", "the bins on this grid too, as 180x90x180, in OUT/bins_HxDxP.h5", 0},
    {"samples", NULL, "keep every sample in OUT/samples.h5", 0},
    {0},
};
static const struct option fit_options[] = {
    {"model", "LIST", "models, as ggx,lambert (default: all)", 'm'},
    {"output", "FILE", "where to (default: fits.yaml in OUT, or beside the table)", 'o'},
    {0},
};

const struct command rec_commands[] = {
    {"reconstruct", "CAPTURE -o OUT", "photographs to BRDF: bins, fits, complete table",
     reconstruct_options, run_reconstruct},
    {"fit", "OUT|TABLE", "fit models to measured bins, or to a MERL table", fit_options, run_fit},
    {"eval", "BRDF", "\"theta_i theta_o phi\" lines (degrees) from stdin to \"r g b\" lines", NULL,
     run_eval},
    {"report", "OUT", "OUT/report.html: everything about a run, in one page", NULL, rec_run_report},
    {"plot", "OUT|TABLE... -o FILE", "lobes, slices, coverage, spheres, comparisons: PNG, SVG, PDF",
     rec_plot_options, rec_run_plot},
    {"export", "BRDF --to FORMAT", "write a BRDF in another program's format", rec_export_options,
     rec_run_export},
    {"compare", "A B", "how far BRDF B is from A, in all measures, by channel and angle",
     rec_compare_options, rec_run_compare},
    {"check", "BRDF", "reciprocity, energy, missing values, grazing angles: is it sound?", NULL,
     rec_run_check},
    {"info", "FILE", "what a photograph, radiance map, table, fits, bins or samples hold", NULL,
     run_info},
    {0},
};
