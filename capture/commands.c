/* commands.c -- the commands of capture/: arguments and messages, no arithmetic. */
#include "capture.h"
#include "commands_shoot.h"
#include "dry_run.h"
#include "merge_shots.h"

#include <stdlib.h>

static const struct option merge_options[] = {
    {"output", "OUT", "write OUT/radiance/SHOT.exr", 'o'},
    {"dry-run", NULL, "print which photographs become which shot, and why; merge nothing", 0},
    {0},
};

static void print_result(const struct capture *capture, const bool *usable, const struct run *run,
                         const char *out, bool json)
{
    int maps = 0;
    for (int i = 0; i < capture->shots; i++)
        maps += usable[i];
    double seconds = 0;
    for (int i = 0; i < run->stages; i++)
        seconds += run->stage[i].seconds;
    if (json)
        printf("{\"command\": \"merge\", \"photographs\": %d, \"shots\": %d, \"maps\": %d, "
               "\"warnings\": %d, \"seconds\": %.3f}\n",
               capture->photos, capture->shots, maps, run->warnings, seconds);
    else
        printf("%d photographs, %d radiance maps in %s/radiance\n", capture->photos, maps, out);
}

static enum status merge_all(struct capture *capture, const char *out, bool json, struct run *run,
                             struct error *err)
{
    bool *usable = calloc((size_t)capture->shots, sizeof *usable);
    enum status status = usable ? cap_capture_settle(capture, run, err)
                                : cap_fail(err, STATUS_MEMORY, "%s", capture->folder);
    if (!status)
        status = merge_shots(capture, out, NULL, usable, true, run, err);
    if (!status)
        print_result(capture, usable, run, out, json);
    free(usable);
    return status;
}

static int run_merge(const struct arguments *args)
{
    const char *out = cap_option(args, "output");
    bool dry = cap_option(args, "dry-run") != NULL;
    int threads;
    if (args->count != 1 || (!dry && (!out || !*out))
        || !cap_option_int(args, "threads", 1, 1024, 0, &threads))
        return 2;
    struct run run;
    struct capture capture = {0};
    struct error err = {0};
    cap_run_begin(&run, threads, cap_option(args, "quiet"));
    enum status status = cap_capture_read(&capture, args->positional[0], &run, &err);
    if (!status && dry)
        status = dry_run(&capture, &run, &err);
    else if (!status)
        status = merge_all(&capture, out, cap_option(args, "json"), &run, &err);
    cap_capture_free(&capture);
    cap_run_end(&run);
    return cap_exit(status, &err);
}

const struct command cap_commands[] = {
    {"merge", "CAPTURE -o OUT", "merge exposure brackets into radiance maps", merge_options,
     run_merge},
    {"shoot", "CAPTURE", "take a bracket with a camera at the cable", shoot_options, run_shoot},
    {0},
};
