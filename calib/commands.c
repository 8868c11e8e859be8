/* commands.c -- the commands of calib/: arguments and messages, no arithmetic. */
#include "calib.h"
#include "commands.h"

#include <stdlib.h>

static double per_cent(double part, double whole)
{
    return 100 * part / whole;
}

// What each cue alone says, as its way from the joint answer.
static void print_cues(const struct lamp *l)
{
    static const double degrees = 180 / CAP_PI;
    for (int k = CUE_BOARD; k < CUES; k++) {
        const struct lamp_cue *cue = &l->cue[k], *joint = &l->cue[CUE_JOINT];
        if (cue->sigma <= 0)
            continue;
        vec3 off = vec3_sub(cue->direction, joint->direction);
        printf("  by %s alone: %.3f degrees off (+- %.3f)", cal_cue_name((enum cue)k),
               vec3_length(off) * degrees, hypot(cue->sigma, joint->sigma) * degrees);
        if (cue->distance > 0 && joint->distance > 0)
            printf(", %.1f mm %s (+- %.1f)", fabs(cue->distance - joint->distance),
                   cue->distance > joint->distance ? "farther" : "nearer", cue->sigma_distance);
        printf("\n");
    }
}

static void print_table(const struct calibration *c)
{
    for (int i = 0; i < c->cameras; i++) {
        const struct camera *m = c->camera + i;
        printf("camera %s: focal length %.2f, %.2f px (+- %.4f %%), centre %.2f, %.2f px, tags off "
               "by %.3f px rms\n",
               m->name, m->focal[0], m->focal[1], per_cent(m->sigma_focal[0], m->focal[0]),
               m->center[0], m->center[1], m->rms_px);
    }
    printf("shots: %d\n", c->views);
    double glare, sigma_glare;
    cal_glare_of(c, &glare, &sigma_glare);
    if (glare > 0)
        printf("glare: %.2g %% of the light (+- %.1g)\n", 100 * glare, 100 * sigma_glare);
    const struct sample *s = &c->sample;
    printf("sample: centre %.3f, %.3f, %.3f mm (+- %.3f, %.3f, %.3f)", s->center.x, s->center.y,
           s->center.z, s->sigma_center[0], s->sigma_center[1], s->sigma_center[2]);
    if (s->radius > 0)
        printf(", radius %.3f mm (+- %.3f)", s->radius, s->sigma_radius);
    printf("\n");
    for (int i = 0; i < c->lamps; i++) {
        const struct lamp *l = c->lamp + i;
        vec3 p = l->at_infinity ? l->direction : l->position;
        const double *sigma = l->at_infinity ? l->sigma_direction : l->sigma_position;
        printf("lamp %s: %s %.*f, %.*f, %.*f%s (+- %.2g, %.2g, %.2g)%s\n", l->name,
               l->at_infinity ? "towards" : "at", l->at_infinity ? 5 : 2, p.x,
               l->at_infinity ? 5 : 2, p.y, l->at_infinity ? 5 : 2, p.z,
               l->at_infinity ? "" : " mm", sigma[0], sigma[1], sigma[2],
               l->on_camera ? ", on the camera" : "");
        print_cues(l);
    }
}

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

static enum status calibrate(struct calibration *c, struct capture *capture, const char *out,
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
        status = cal_calibrate(c, capture, out, usable, run, err);
    if (!status)
        status = cal_calibration_write(c, path, err);
    free(path);
    free(usable);
    return status;
}

static int run_calibrate(const struct arguments *args)
{
    const char *out = cap_option(args, "output");
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
    cap_run_begin(&run, threads, cap_option(args, "quiet") != NULL);
    enum status status = cap_capture_read(&capture, args->positional[0], &run, &err);
    if (!status)
        status = cap_make_folder(out, &err);
    if (!status)
        status = calibrate(&calibration, &capture, out, &run, &err);
    cap_run_end(&run);
    if (!status && cap_option(args, "json"))
        print_json(&calibration);
    else if (!status)
        print_table(&calibration);
    cal_calibration_free(&calibration);
    cap_capture_free(&capture);
    return cap_exit(status, &err);
}

static const struct option calibrate_options[] = {
    {"output", "OUT", "folder for calibration.yaml, overlay/ and radiance/", 'o'},
    {0},
};

const struct command cal_commands[] = {
    {"calibrate", "CAPTURE -o OUT", "find cameras, poses, sample and lamps", calibrate_options,
     run_calibrate},
    {"init", "PHOTOS --tag-size MM", "a first capture.yaml from the photographs", init_options,
     run_init},
    {"board", "-o PDF > capture.yaml", "a board to print, and its capture.yaml on stdout",
     board_options, run_board},
    {"export-calibration", "CALIBRATION --to FORMAT -o OUT", "calibration.yaml for other programs",
     export_options, run_export},
    {0},
};
