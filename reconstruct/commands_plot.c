/* commands_plot.c -- goniocam plot, goniocam report: arguments and messages. */
#include "commands.h"
#include "report.h"
#include "team.h"

#include <stdlib.h>
#include <string.h>

const struct option rec_plot_options[] = {
    {"output", "FILE", "picture to write, by its ending .png, .svg or .pdf", 'o'},
    {"what", "KIND", "lobes, slice, coverage, albedo, sphere or comparison (default: lobes)", 'w'},
    {"theta", "LIST", "angles of the light for lobes, as 0,30,60 degrees (default)", 0},
    {"phi", "DEGREES", "phi_d of slices (default: 90)", 0},
    {"channel", "NAME", "red, green, blue or all (default)", 'c'},
    {"fits", "N", "how many of the best fits are drawn over the table (default: 1)", 0},
    {0},
};

// The place of text in a list that ends with NULL; -1: nowhere.
static int place_in(const char *const *list, const char *text)
{
    for (int i = 0; list[i]; i++)
        if (strcmp(list[i], text) == 0)
            return i;
    return -1;
}

// "0,30,60". false: not a list of at most PLOT_THETAS angles from 0 to below 90.
static bool read_thetas(struct plot_options *o, const char *text)
{
    while (o->thetas < PLOT_THETAS) {
        char *end;
        double theta = strtod(text, &end);
        if (end == text || !(theta >= 0 && theta < 90) || (*end && *end != ','))
            return false;
        o->theta_deg[o->thetas++] = theta;
        if (!*end)
            return true;
        text = end + 1;
    }
    return false;
}

// false: usage; a message is out.
static bool read_options(struct plot_options *o, int *kind, const struct arguments *args)
{
    static const char *const kinds[] = {"lobes",  "slice",      "coverage", "albedo",
                                        "sphere", "comparison", NULL};
    static const char *const channels[] = {"red", "green", "blue", "all", NULL};
    const char *what = cap_option(args, "what"), *theta = cap_option(args, "theta");
    const char *channel = cap_option(args, "channel"), *phi = cap_option(args, "phi");
    char *end;
    *kind = place_in(kinds, what ? what : "lobes");
    int c = place_in(channels, channel ? channel : "all");
    if (!cap_option_int(args, "fits", 0, PLOT_FITS, 1, &o->fits)
        || !cap_option_int(args, "threads", 1, 1024, rec_team_threads, &o->threads))
        return false;
    if (o->threads < 1)
        o->threads = 1;
    for (int k = 0; k < 3; k++)
        o->channel[k] = c == 3 || c == k;
    o->phi_d_deg = phi ? strtod(phi, &end) : 90;
    bool good_phi = !phi || (end != phi && !*end && o->phi_d_deg >= 0 && o->phi_d_deg < 180);
    if (*kind < 0)
        fprintf(stderr, "goniocam: --what %s: no such plot\n", what);
    else if (c < 0)
        fprintf(stderr, "goniocam: --channel %s: red, green, blue or all\n", channel);
    else if (!good_phi)
        fprintf(stderr, "goniocam: --phi %s: degrees from 0 to below 180\n", phi);
    else if (!read_thetas(o, theta ? theta : "0,30,60"))
        fprintf(stderr, "goniocam: --theta %s: up to %d angles from 0 to below 90, as 0,30,60\n",
                theta, PLOT_THETAS);
    else
        return true;
    return false;
}

int rec_run_plot(const struct arguments *args)
{
    struct plot_options options = {0};
    const char *path = cap_option(args, "output");
    int kind;
    if (args->count < 1 || !path || !read_options(&options, &kind, args))
        return 2;
    struct plot_source source[ARGUMENTS_MAX] = {{0}};
    struct error err = {0};
    enum status status = STATUS_OK;
    for (int i = 0; i < args->count && !status; i++)
        status = rec_plot_source_read(source + i, args->positional[i], &err);
    if (!status)
        status = rec_plot((enum plot_kind)kind, source, args->count, &options, path, &err);
    if (!status && cap_option(args, "json"))
        printf("{\"plot\": \"%s\"}\n", path);
    for (int i = 0; i < args->count; i++)
        rec_plot_source_free(source + i);
    return cap_exit(status, &err);
}

int rec_run_report(const struct arguments *args)
{
    int threads;
    struct run run;
    if (args->count != 1 || !cap_option_int(args, "threads", 1, 1024, rec_team_threads, &threads))
        return 2;
    struct error err = {0};
    cap_run_begin(&run, threads, cap_option(args, "quiet") != NULL);
    cap_stage(&run, "report", 0);
    enum status status = rec_report(args->positional[0], run.threads, &err);
    cap_run_end(&run);
    if (!status && cap_option(args, "json"))
        printf("{\"report\": \"%s/report.html\"}\n", args->positional[0]);
    return cap_exit(status, &err);
}
