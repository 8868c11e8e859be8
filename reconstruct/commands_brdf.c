/* commands_brdf.c -- export: arguments and messages, no arithmetic. */
#include "commands.h"
#include "export.h"

#include <stdlib.h>
#include <string.h>

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
