/* commands_goniometer.c -- goniocam goniometer: arguments and messages. */
#include "commands_goniometer.h"

#include "goniometer.h"

const struct option goniometer_options[] = {
    {"output", "TABLE", "MERL table to write", 'o'},
    {0},
};

static void tell(const char *path, const struct light_balance *balance, bool json)
{
    if (json)
        printf("{\"table\": \"%s\", \"out\": %.6f, \"absorbed\": %.6f, \"lost\": %.6f}\n", path,
               balance->out, balance->absorbed, balance->lost);
    else
        printf("%s: of the light %.4f left, %.4f was absorbed, %.4f was lost at the patch's ends\n",
               path, balance->out, balance->absorbed, balance->lost);
}

int run_goniometer(const struct arguments *args)
{
    const char *out = cap_option(args, "output");
    int threads;
    if (args->count != 1 || !out || !cap_option_int(args, "threads", 1, 1024, 0, &threads))
        return 2;
    struct run run;
    struct surface surface = {.nodes = 0};
    struct light_balance balance;
    struct merl table = {0};
    struct error err = {0};
    cap_run_begin(&run, threads, cap_option(args, "quiet") != NULL);
    enum status status = sam_surface_read(&surface, args->positional[0], &err);
    if (!status)
        status = sam_goniometer(&table, &balance, &surface, &run, &err);
    if (!status)
        status = rec_merl_write(&table, out, &err);
    cap_run_end(&run);
    if (!status)
        tell(out, &balance, cap_option(args, "json") != NULL);
    rec_merl_free(&table);
    sam_surface_free(&surface);
    return cap_exit(status, &err);
}
