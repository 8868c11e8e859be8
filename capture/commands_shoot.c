/* commands_shoot.c -- goniocam shoot: a bracket from a camera at the cable. */
#include "commands_shoot.h"

#include "tether.h"

#include <stdlib.h>
#include <string.h>

enum { TIMES_MAX = 64 };

const struct option shoot_options[] = {
    {"times", "LIST", "exposure times, as 1/500,1/125,1/30,1/8,0.5 (the default)", 't'},
    {"name", "NAME", "what the shot is called (default: the next of shot00, shot01, ...)", 'n'},
    {"camera", "MODEL", "the camera, by the name that libgphoto2 knows (default: the one it finds)",
     0},
    {"port", "PORT", "where it is connected, as usb: (default: where it is found)", 0},
    {0},
};

// "1/500,0.5" to seconds. false: something in the list is no time, and a message is out.
static bool read_times(double *seconds, int *count, const char *list)
{
    char *rest = NULL, *copy = strdup(list);
    bool good = copy != NULL;
    *count = 0;
    for (char *word = good ? strtok_r(copy, ",", &rest) : NULL; good && word;
         word = strtok_r(NULL, ",", &rest)) {
        double time = cap_tether_seconds(word);
        good = time > 0 && *count < TIMES_MAX;
        if (good)
            seconds[(*count)++] = time;
        else
            fprintf(stderr, "goniocam shoot: --times: '%s' is no exposure time, as 1/125 or 0.5\n",
                    word);
    }
    free(copy);
    return good && *count > 0;
}

int run_shoot(const struct arguments *args)
{
    const char *list = cap_option(args, "times"), *name = cap_option(args, "name");
    double seconds[TIMES_MAX];
    int count;
    char next[16];
    if (args->count != 1 || !read_times(seconds, &count, list ? list : "1/500,1/125,1/30,1/8,0.5"))
        return 2;
    const char *folder = args->positional[0];
    struct run run;
    struct tether camera = {0};
    struct error err = {0};
    cap_run_begin(&run, 0, cap_option(args, "quiet") != NULL);
    enum status status =
        cap_tether_open(&camera, cap_option(args, "camera"), cap_option(args, "port"), &err);
    if (!status && !name) {
        cap_tether_next_name(next, folder);
        name = next;
    }
    if (!status)
        status = cap_tether_bracket(&camera, folder, name, seconds, count, &run, &err);
    if (!status && cap_option(args, "json"))
        printf("{\"shot\": \"%s\", \"photographs\": %d}\n", name, count);
    else if (!status)
        printf("%s: %d photographs in %s\n", name, count, folder);
    cap_tether_close(&camera);
    cap_run_end(&run);
    return cap_exit(status, &err);
}
