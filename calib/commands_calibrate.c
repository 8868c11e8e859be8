/* commands_calibrate.c -- goniocam calibrate: arguments and messages. */
#include "commands.h"
#include "table.h"

#include <stdlib.h>

static void print_numbers(const char *key, const double *value, int count)
{
    printf(", \"%s\": [", key);
    for (int i = 0; i < count; i++)
        printf("%s%.17g", i ? ", " : "", value[i]);
    printf("]");
}

// A name as a JSON string.
static void print_name(const char *name)
{
    printf("{\"name\": \"");
    for (const char *p = name; *p; p++) {
        unsigned char ch = (unsigned char)*p;
        if (ch == '"' || ch == '\\')
            printf("\\%c", ch);
        else if (ch < 0x20)
            printf("\\u%04x", ch);
        else
            putchar(ch);
    }
    printf("\"");
}

static void print_json(const struct calibration *c)
{
    printf("{\"shots\": %d, \"cameras\": [", c->views);
    for (int i = 0; i < c->cameras; i++) {
        printf("%s", i ? ", " : "");
        print_name(c->camera[i].name);
        print_numbers("focal", c->camera[i].focal, 2);
        print_numbers("center", c->camera[i].center, 2);
        printf(", \"rms_px\": %.6g}", c->camera[i].rms_px);
    }
    const vec3 center = c->sample.center;
    printf("], \"sample\": {\"center\": [%.17g, %.17g, %.17g], \"radius\": %.17g}, \"lights\": [",
           center.x, center.y, center.z, c->sample.radius);
    for (int i = 0; i < c->lamps; i++) {
        const struct lamp *l = c->lamp + i;
        vec3 p = l->at_infinity ? l->direction : l->position;
        const double at[3] = {p.x, p.y, p.z};
        printf("%s", i ? ", " : "");
        print_name(l->name);
        print_numbers(l->at_infinity ? "direction" : "position", at, 3);
        print_numbers(l->at_infinity ? "irradiance" : "intensity", l->intensity, 3);
        printf("}");
    }
    printf("]}\n");
}

// Merge, then calibrate; or, where checks is not NULL, check the cameras of the file `against`.
static enum status calibrate(struct calibration *c, struct camera_check **checks,
                             const char *against, struct capture *capture, const char *out,
                             struct run *run, struct error *err)
{
    bool *usable = calloc((size_t)capture->shots + 1, sizeof *usable);
    char *path = cap_path(out, "calibration.yaml");
    enum status status = usable && path ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%s", out);
    if (!status)
        status = cap_capture_settle(capture, run, err);
    if (!status)
        status = cap_merge(capture, out, NULL, usable, run, err);
    if (!status)
        status = against ? cal_check(c, checks, capture, against, out, usable, run, err)
                         : cal_calibrate(c, capture, out, usable, run, err);
    if (!status)
        status = cal_calibration_write(c, path, err);
    free(path);
    free(usable);
    return status;
}

static void print_checks(const struct camera_check *check, int cameras, bool json)
{
    if (json)
        printf("{\"cameras\": [");
    for (int i = 0; i < cameras; i++) {
        const struct camera_check *k = check + i;
        if (json) {
            printf("%s", i ? ", " : "");
            print_name(k->name);
            printf(", \"shots\": %d, \"held_px\": %.6g, \"free_px\": %.6g, \"focal_off\": %.6g, "
                   "\"sigma_focal\": %.6g, \"rays_px\": %.6g, \"verdict\": \"%s\"}",
                   k->shots, k->held_px, k->free_px, k->focal_off, k->sigma_focal, k->rays_px,
                   k->verdict == VERDICT_HOLDS     ? "holds"
                   : k->verdict == VERDICT_DRIFTED ? "drifted"
                                                   : "wrong");
            continue;
        }
        printf("camera %s: the calibration %s\n", k->name, cal_verdict_text(k->verdict));
        printf("  tags off by %.3f px rms in %d shots, at worst %.3f px in %s\n", k->held_px,
               k->shots, k->worst_px, k->worst);
        if (k->free_px > 0)
            printf("  with a lens of their own %.3f px: its focal length differs by %+.4f %% "
                   "(+- %.4f), its rays by up to %.2f px\n",
                   k->free_px, 100 * k->focal_off, 100 * k->sigma_focal, k->rays_px);
        else
            printf("  (three shots or more would tell what has changed)\n");
    }
    if (json)
        printf("]}\n");
}

int run_calibrate(const struct arguments *args)
{
    const char *out = cap_option(args, "output"), *against = cap_option(args, "check");
    int threads;
    if (args->count != 1 || !out) {
        fprintf(stderr, "goniocam calibrate: wants one CAPTURE folder, and -o OUT\n");
        return 2;
    }
    if (!cap_option_int(args, "threads", 1, 1024, 0, &threads))
        return 2;
    struct run run;
    struct error err = {0};
    struct capture capture = {0};
    struct calibration calibration = {0};
    struct camera_check *checks = NULL;
    cap_run_begin(&run, threads, cap_option(args, "quiet") != NULL);
    enum status status = cap_capture_read(&capture, args->positional[0], &run, &err);
    if (!status)
        status = cap_make_folder(out, &err);
    if (!status)
        status = calibrate(&calibration, &checks, against, &capture, out, &run, &err);
    cap_run_end(&run);
    bool json = cap_option(args, "json") != NULL, wrong = false;
    for (int i = 0; checks && i < calibration.cameras; i++)
        wrong = wrong || checks[i].verdict == VERDICT_WRONG;
    if (!status && checks)
        print_checks(checks, calibration.cameras, json);
    else if (!status && json)
        print_json(&calibration);
    else if (!status)
        cal_print_table(&calibration, stdout);
    free(checks);
    cal_calibration_free(&calibration);
    cap_capture_free(&capture);
    return status ? cap_exit(status, &err) : wrong;
}

const struct option calibrate_options[] = {
    {"output", "OUT", "folder for calibration.yaml, overlay/ and radiance/", 'o'},
    {"check", "CALIBRATION", "do these photographs still fit that calibration's cameras?", 0},
    {0},
};
