/* commands_init.c -- goniocam init: a first capture.yaml from the photographs. */
#include "commands.h"
#include "init.h"

#include <ftw.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

const struct option init_options[] = {
    {"tag-size", "MM", "side of a tag's black square, measured on the print", 's'},
    {"family", "NAME", "AprilTag family (default: the one in the photographs)", 0},
    {"output", "FILE", "where to (default: capture.yaml beside the photographs)", 'o'},
    {0},
};

static int remove_one(const char *path, const struct stat *info, int kind, struct FTW *at)
{
    (void)info;
    (void)kind;
    (void)at;
    return remove(path);
}

// A folder of one's own for radiance maps that nobody keeps. NULL: it cannot be made.
static char *make_scratch(struct error *err)
{
    const char *folder = getenv("TMPDIR");
    char *path;
    if (asprintf(&path, "%s/goniocam-init.%ld", folder ? folder : "/tmp", (long)getpid()) < 0)
        return NULL;
    if (!cap_make_folder(path, err))
        return path;
    free(path);
    return NULL;
}

static enum status look(const struct arguments *args, double size, const char *path,
                        struct run *run, struct error *err)
{
    struct init_finding finding = {0};
    char *scratch = make_scratch(err);
    if (!scratch)
        return cap_fail_within(err, "no folder for radiance maps");
    enum status status = init_find(&finding, args->positional[0], cap_option(args, "family"), size,
                                   scratch, run, err);
    nftw(scratch, remove_one, 16, FTW_DEPTH | FTW_PHYS);
    cap_stage(run, "", 0);
    if (!status)
        status = init_write(&finding, size, path, err);
    if (!status && cap_option(args, "json"))
        printf("{\"capture\": \"%s\", \"shots\": %d, \"family\": \"%s\", \"tags\": %d}\n", path,
               finding.capture.shots, finding.family, finding.found.tags);
    else if (!status)
        printf("%s: %d shots, %d tags of %s placed. Now fill in what is marked there, then:\n"
               "  goniocam reconstruct %s -o OUT\n",
               path, finding.capture.shots, finding.found.tags, finding.family,
               args->positional[0]);
    init_free(&finding);
    free(scratch);
    return status;
}

int run_init(const struct arguments *args)
{
    double size;
    int threads;
    if (args->count != 1 || !option_length(args, "tag-size", &size)
        || !cap_option_int(args, "threads", 1, 1024, 0, &threads))
        return 2;
    if (!(size > 0)) {
        fprintf(stderr,
                "goniocam init: measure the black square of a tag, and give --tag-size MM\n");
        return 2;
    }
    struct run run;
    struct error err = {0};
    const char *output = cap_option(args, "output");
    char *path = output ? strdup(output) : cap_path(args->positional[0], "capture.yaml");
    cap_run_begin(&run, threads, cap_option(args, "quiet") != NULL);
    enum status status = path ? STATUS_OK : cap_fail(&err, STATUS_MEMORY, "no memory for a path");
    if (!status && access(path, F_OK) == 0)
        status = cap_fail(
            &err, STATUS_IO,
            "%s: is there already, and is not written over: name another file with -o", path);
    if (!status)
        status = look(args, size, path, &run, &err);
    cap_run_end(&run);
    free(path);
    return cap_exit(status, &err);
}
