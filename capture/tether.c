/* tether.c -- brackets with a camera at the cable: which of its times, and what files are called.
 */
#include "tether.h"

#include <dirent.h>
#include <stdlib.h>
#include <string.h>

double cap_tether_seconds(const char *name)
{
    char text[32], *end;
    snprintf(text, sizeof text, "%s", name);
    for (char *p = text; *p; p++)
        *p = *p == ',' ? '.' : *p;
    double seconds = strtod(text, &end);
    if (end == text)
        return 0;
    if (*end == '/') {
        char *from = end + 1;
        double parts = strtod(from, &end);
        if (end == from || !(parts > 0))
            return 0;
        seconds /= parts;
    }
    end += strspn(end, " ");
    bool known = !*end || strcmp(end, "s") == 0 || strcmp(end, "\"") == 0;
    return known && isfinite(seconds) && seconds > 0 ? seconds : 0;
}

// The name that is nearest to a time by its ratio; -1: none is a time.
static int nearest(const char *const *name, int count, double seconds)
{
    int best = -1;
    double least = INFINITY;
    for (int i = 0; i < count; i++) {
        double here = cap_tether_seconds(name[i]);
        double off = here > 0 ? fabs(log(here / seconds)) : INFINITY;
        if (off < least) {
            least = off;
            best = i;
        }
    }
    return best;
}

static enum status choose(int *chosen, const char *const *name, int names, const double *seconds,
                          int count, struct run *run, struct error *err)
{
    for (int k = 0; k < count; k++) {
        chosen[k] = nearest(name, names, seconds[k]);
        if (chosen[k] < 0)
            return cap_fail(err, STATUS_DATA,
                            "the camera offers no exposure times: set it to M (manual)");
        for (int i = 0; i < k; i++)
            if (chosen[i] == chosen[k])
                return cap_fail(err, STATUS_DATA,
                                "%g s and %g s are both nearest to the camera's %s: leave one out",
                                seconds[i], seconds[k], name[chosen[k]]);
        double has = cap_tether_seconds(name[chosen[k]]);
        if (fabs(log(has / seconds[k])) > log(1.05))
            cap_warn(run, "the camera has no %g s: %s is the nearest", seconds[k], name[chosen[k]]);
    }
    return STATUS_OK;
}

static enum status take(const struct tether *camera, const char *folder, const char *name, int k,
                        const char *time, struct error *err)
{
    char *path, file[300];
    snprintf(file, sizeof file, "%s_exp%d", name, k);
    if (!(path = cap_path(folder, file)))
        return cap_fail(err, STATUS_MEMORY, "no memory for a path");
    enum status status = camera->set_time(camera->self, time, err);
    if (!status)
        status = camera->take(camera->self, path, err);
    free(path);
    return status;
}

enum status cap_tether_bracket(const struct tether *camera, const char *folder, const char *name,
                               const double *seconds, int count, struct run *run, struct error *err)
{
    const char *const *time;
    int times, *chosen = calloc((size_t)count + 1, sizeof *chosen);
    if (!chosen)
        return cap_fail(err, STATUS_MEMORY, "no memory for a bracket");
    enum status status = camera->times(camera->self, &time, &times, err);
    if (!status)
        status = choose(chosen, time, times, seconds, count, run, err);
    if (!status)
        status = cap_make_folder(folder, err);
    if (!status)
        cap_stage(run, name, count);
    for (int k = 0; k < count && !status; k++) {
        status = take(camera, folder, name, k, time[chosen[k]], err);
        cap_step(run);
    }
    cap_stage(run, "", 0);
    free(chosen);
    return status;
}

static bool begins_a_file(const char *folder, const char *name)
{
    DIR *entries = opendir(folder);
    bool found = false;
    for (struct dirent *e; entries && !found && (e = readdir(entries));)
        found = strncmp(e->d_name, name, strlen(name)) == 0
                && !(e->d_name[strlen(name)] >= '0' && e->d_name[strlen(name)] <= '9');
    if (entries)
        closedir(entries);
    return found;
}

void cap_tether_next_name(char name[16], const char *folder)
{
    int k = 0;
    do {
        snprintf(name, 16, "shot%02d", k++ % 100000);
    } while (begins_a_file(folder, name) && k < 100000);
}
