/* commands_plan.c -- goniocam plan: what shots measure, and which to make next. */
#include "commands_plan.h"

#include "plan.h"
#include "reconstruct.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { PROPOSALS_MAX = 100 };

const struct option plan_options[] = {
    {"shots", "N", "how many shots to propose (default 5; 0: only what is there)", 0},
    {"output", "FILE", "draw what is measured, before and after: FILE.png, .svg or .pdf", 'o'},
    {"move-lamp", NULL, "propose other places of the lamp too", 0},
    {0},
};

static bool is_folder(const char *path)
{
    struct stat info;
    return stat(path, &info) == 0 && S_ISDIR(info.st_mode);
}

static void print_coverage(const struct coverage *c)
{
    printf("%5.1f %% %5.1f %% %5.1f %%\n", 100 * c->within_60, 100 * c->within_75, 100 * c->whole);
}

// The shots of a scene, one after another; their bins enter seen.
static enum status look_at_shots(uint8_t *seen, const struct rig *rig, bool tell, struct run *run,
                                 struct error *err)
{
    const struct calibration *c = &rig->calibration;
    struct seen_bins *list = calloc((size_t)c->views + 1, sizeof *list);
    if (!list)
        return cap_fail(err, STATUS_MEMORY, "no memory for %d shots", c->views);
    cap_stage(run, "coverage", c->views);
    enum status status = rec_coverage(list, c, 1, run, err);
    cap_stage(run, "", 0);
    if (tell && !status)
        printf("shot  lamp          new bins   measured to 60, 75, 90 degrees\n");
    for (int v = 0; v < c->views && !status; v++) {
        int fresh = 0;
        for (int i = 0; i < list[v].count; i++) {
            fresh += !seen[list[v].bin[i]];
            seen[list[v].bin[i]] = 1;
        }
        struct coverage now = rec_coverage_of(seen);
        if (tell) {
            printf("%4d  %-12s %9d   ", v, c->lamp[c->view[v].light].name, fresh);
            print_coverage(&now);
        }
        rec_seen_free(&list[v]);
    }
    free(list);
    return status;
}

// Whole millimetres or degrees, without a sign before 0.
static double whole(double x)
{
    return round(x) + 0.0;
}

static void print_proposals(const struct proposal *p, int count, struct coverage before)
{
    static const double degrees = 180 / CAP_PI;
    printf("as it is                                                                        ");
    print_coverage(&before);
    if (count == 0)
        return;
    printf("\nnext  camera at (mm)          azimuth elevation (deg)  lamp at azimuth elevation     "
           "new bins   measured to 60, 75, 90 degrees\n");
    for (int i = 0; i < count; i++) {
        printf("%4d  %6.0f, %6.0f, %6.0f %8.0f %9.0f         %-10.10s %4.0f %4.0f%s %9d   ", i + 1,
               p[i].eye.x, p[i].eye.y, p[i].eye.z, p[i].azimuth * degrees, p[i].elevation * degrees,
               p[i].lamp, p[i].lamp_azimuth * degrees, p[i].lamp_elevation * degrees,
               p[i].moved ? " (move)" : "       ", p[i].fresh);
        print_coverage(&p[i].coverage);
    }
    printf("Aim at %.0f, %.0f, %.0f, from %.0f mm. Azimuth runs from the board's x to its y.\n",
           whole(p[0].target.x), whole(p[0].target.y), whole(p[0].target.z), p[0].distance);
}

static void print_vector(const char *key, vec3 v)
{
    printf("\"%s\": [%.17g, %.17g, %.17g]", key, v.x, v.y, v.z);
}

static void print_json(const struct proposal *p, int count, struct coverage before)
{
    printf("{\"measured\": [%.6f, %.6f, %.6f], \"proposals\": [", before.within_60,
           before.within_75, before.whole);
    for (int i = 0; i < count; i++) {
        printf("%s{", i ? ", " : "");
        print_vector("eye", p[i].eye);
        printf(", ");
        print_vector("target", p[i].target);
        printf(", ");
        print_vector("lamp", p[i].lamp_position);
        printf(", \"lamp_name\": \"%s\", \"move_lamp\": %s, \"new_bins\": %d, "
               "\"measured\": [%.6f, %.6f, %.6f]}",
               p[i].lamp, p[i].moved ? "true" : "false", p[i].fresh, p[i].coverage.within_60,
               p[i].coverage.within_75, p[i].coverage.whole);
    }
    printf("]}\n");
}

int run_plan(const struct arguments *args)
{
    int threads, found = 0;
    struct plan_request request = {.move_lamp = cap_option(args, "move-lamp") != NULL};
    if (args->count != 1 || !cap_option_int(args, "threads", 1, 1024, 0, &threads)
        || !cap_option_int(args, "shots", 0, PROPOSALS_MAX, 5, &request.shots))
        return 2;
    struct run run;
    struct error err = {0};
    struct rig rig = {0};
    struct proposal proposal[PROPOSALS_MAX];
    bool result = is_folder(args->positional[0]), json = cap_option(args, "json") != NULL;
    const char *picture = cap_option(args, "output");
    uint8_t *seen = calloc(2, MERL_BINS), *then = seen ? seen + MERL_BINS : NULL;
    cap_run_begin(&run, threads, cap_option(args, "quiet") != NULL);
    enum status status = seen ? STATUS_OK : cap_fail(&err, STATUS_MEMORY, "no memory");
    if (!status)
        status = (result ? sam_rig_of_result : sam_rig_of_scene)(&rig, args->positional[0], &err);
    if (!status)
        status = result ? rec_coverage_measured(seen, args->positional[0], &err)
                        : look_at_shots(seen, &rig, !json, &run, &err);
    struct coverage before = {0};
    if (!status)
        before = rec_coverage_of(seen);
    if (!status) {
        memcpy(then, seen, MERL_BINS);
        status = request.shots > 0 ? sam_plan(proposal, &found, then, &rig, request, &run, &err)
                                   : STATUS_OK;
    }
    if (!status && picture)
        status = rec_coverage_draw(seen, then, picture, &err);
    cap_run_end(&run);
    if (!status)
        (json ? print_json : print_proposals)(proposal, found, before);
    sam_rig_free(&rig);
    free(seen);
    return cap_exit(status, &err);
}
