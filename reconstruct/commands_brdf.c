/* commands_brdf.c -- export, check and compare: arguments and messages, no arithmetic. */
#include "bins_hdf5.h"
#include "check.h"
#include "commands.h"
#include "compare.h"
#include "export.h"
#include "plot.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static bool begin(struct run *run, const struct arguments *args)
{
    int threads;
    if (!cap_option_int(args, "threads", 1, 1024, 0, &threads))
        return false;
    cap_run_begin(run, threads, cap_option(args, "quiet") != NULL);
    return true;
}

const struct option rec_export_options[] = {
    {"to", "FORMAT", "merl, rgl, mitsuba, pbrt, materialx, gltf, exr, csv or json", 't'},
    {"output", "FILE", "where to (default: the BRDF's name with the format's ending)", 'o'},
    {0},
};

static void tell_formats(const char *wrong)
{
    fprintf(stderr, "goniocam: --to wants a format%s%s; there are:\n", wrong ? ", not " : "",
            wrong ? wrong : "");
    for (const struct exporter *e = rec_exporters; e->name; e++)
        fprintf(stderr, "  %-10s %s\n", e->name, e->help);
}

// -o FILE, or the source's name with the format's ending, in the folder we are in.
static char *output_path(const struct arguments *args, const struct exporter *e)
{
    const char *output = cap_option(args, "output"), *source = args->positional[0];
    if (output)
        return strdup(output);
    size_t length = strlen(source);
    while (length > 1 && source[length - 1] == '/')
        length--;
    size_t begin = length;
    while (begin > 0 && source[begin - 1] != '/')
        begin--;
    const char *dot = memrchr(source + begin, '.', length - begin);
    if (dot && dot > source + begin)
        length = (size_t)(dot - source);
    char *path = NULL;
    return asprintf(&path, "%.*s%s", (int)(length - begin), source + begin, e->ending) < 0 ? NULL
                                                                                           : path;
}

int rec_run_export(const struct arguments *args)
{
    const char *to = cap_option(args, "to");
    const struct exporter *exporter = to ? rec_exporter_find(to) : NULL;
    struct run run;
    if (args->count != 1)
        return 2;
    if (!exporter)
        return tell_formats(to), 2;
    if (!begin(&run, args))
        return 2;
    struct brdf brdf = {0};
    struct error err = {0};
    char *path = output_path(args, exporter);
    enum status status = path ? rec_brdf_read(&brdf, args->positional[0], &err)
                              : cap_fail(&err, STATUS_MEMORY, "no memory");
    struct exported what = {&brdf, args->positional[0]};
    if (!status)
        status = exporter->write(&what, path, &run, &err);
    cap_run_end(&run);
    if (!status && cap_option(args, "json"))
        printf("{\"format\": \"%s\", \"output\": \"%s\"}\n", exporter->name, path);
    rec_brdf_free(&brdf);
    free(path);
    return cap_exit(status, &err);
}

/* ---- check ------------------------------------------------------------------------------------
 */

int rec_run_check(const struct arguments *args)
{
    struct run run;
    if (args->count != 1 || !begin(&run, args))
        return 2;
    struct brdf brdf = {0};
    struct error err = {0};
    struct check check = {.bins = 0};
    enum status status = rec_brdf_read(&brdf, args->positional[0], &err);
    if (!status)
        status = rec_check(&check, &brdf, &run, &err);
    cap_run_end(&run);
    if (!status)
        (cap_option(args, "json") ? rec_check_print_json : rec_check_print)(&check, stdout);
    rec_brdf_free(&brdf);
    return status ? cap_exit(status, &err) : rec_check_verdict(&check) != 0;
}

/* ---- compare ----------------------------------------------------------------------------------
 */

const struct option rec_compare_options[] = {
    {"mask", "BINS", "only bins that this bins.h5 (or OUT's) calls measured", 'm'},
    {"output", "FILE", "slices of both and their ratio as .png, .svg or .pdf", 'o'},
    {0},
};

// The status of every bin of a bins.h5, or of the one in OUT.
static enum status read_mask(uint8_t **mask, const char *path, struct error *err)
{
    struct stat info;
    bool folder = stat(path, &info) == 0 && S_ISDIR(info.st_mode);
    char *file = folder ? cap_path(path, "bins.h5") : strdup(path);
    uint8_t *state = malloc(MERL_BINS);
    enum status status = file && state ? rec_bins_read_status(state, file, err)
                                       : cap_fail(err, STATUS_MEMORY, "%s: no memory", path);
    free(file);
    if (status)
        free(state);
    else
        *mask = state;
    return status;
}

static enum status draw(const struct arguments *args, const char *path, int threads,
                        struct error *err)
{
    struct plot_source source[2] = {{0}, {0}};
    struct plot_options options = {
        .channel = {true, true, true}, .phi_d_deg = 90, .threads = threads};
    enum status status = rec_plot_source_read(&source[0], args->positional[0], err);
    if (!status)
        status = rec_plot_source_read(&source[1], args->positional[1], err);
    if (!status)
        status = rec_plot(PLOT_COMPARISON, source, 2, &options, path, err);
    rec_plot_source_free(&source[0]);
    rec_plot_source_free(&source[1]);
    return status;
}

int rec_run_compare(const struct arguments *args)
{
    const char *bins = cap_option(args, "mask"), *picture = cap_option(args, "output");
    struct run run;
    if (args->count != 2 || !begin(&run, args))
        return 2;
    struct brdf a = {0}, b = {0};
    struct error err = {0};
    struct comparison comparison;
    uint8_t *mask = NULL;
    enum status status = rec_brdf_read(&a, args->positional[0], &err);
    if (!status)
        status = rec_brdf_read(&b, args->positional[1], &err);
    if (!status && bins)
        status = read_mask(&mask, bins, &err);
    if (!status)
        status = rec_compare(&comparison, &a, &b, mask, &run, &err);
    if (!status && picture)
        status = draw(args, picture, run.threads, &err);
    cap_run_end(&run);
    if (!status)
        (cap_option(args, "json") ? rec_compare_print_json : rec_compare_print)(&comparison,
                                                                                stdout);
    free(mask);
    rec_brdf_free(&a);
    rec_brdf_free(&b);
    return cap_exit(status, &err);
}
