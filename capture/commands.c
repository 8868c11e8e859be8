/* commands.c -- the commands of capture/: arguments and messages, no arithmetic. */
#include "capture.h"

#include <stdlib.h>

static const struct option merge_options[] = {
    {"output", "OUT", "write OUT/radiance/SHOT.exr", 'o'},
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

static int run_merge(const struct arguments *args)
{
    const char *out = cap_option(args, "output");
    int threads;
    if (args->count != 1 || !out || !*out || !cap_option_int(args, "threads", 1, 1024, 0, &threads))
        return 2;
    struct run run;
    struct capture capture = {0};
    struct error err = {0};
    cap_run_begin(&run, threads, cap_option(args, "quiet"));
    bool *usable = NULL;
    enum status status = cap_capture_read(&capture, args->positional[0], &run, &err);
    if (!status && !(usable = calloc((size_t)capture.shots, sizeof *usable)))
        status = cap_fail(&err, STATUS_MEMORY, "%s", capture.folder);
    if (!status)
        status = cap_merge(&capture, out, NULL, usable, &run, &err);
    if (!status)
        print_result(&capture, usable, &run, out, cap_option(args, "json"));
    free(usable);
    cap_capture_free(&capture);
    cap_run_end(&run);
    return cap_exit(status, &err);
}

const struct command cap_commands[] = {
    {"merge", "CAPTURE -o OUT", "merge exposure brackets into radiance maps", merge_options,
     run_merge},
    {0},
};
