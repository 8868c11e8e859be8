/* commands.c -- the commands of reconstruct/: arguments and messages, no arithmetic. */
#include "commands.h"

#include "eval_lines.h"
#include "info.h"
#include "summary.h"
#include "team.h"

#include <stdlib.h>
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

const struct command rec_commands[] = {
    {"reconstruct", "CAPTURE -o OUT", "photographs to BRDF: bins, fits, complete table",
     reconstruct_options, run_reconstruct},
    {"fit", "OUT|BRDF", "fit models to measured bins, samples.h5 or a table", rec_fit_options,
     rec_run_fit},
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
