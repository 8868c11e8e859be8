/* commands.c -- the commands of samples/: arguments and messages, no arithmetic. */
#include "samples.h"

#include "commands_goniometer.h"
#include "commands_plan.h"
#include "render.h"

static int run_render(const struct arguments *args)
{
    const char *out = cap_option(args, "output");
    int threads;
    if (args->count != 1 || !out || !cap_option_int(args, "threads", 1, 1024, 0, &threads))
        return 2;
    struct run run;
    struct scene scene = {0};
    struct error err = {0};
    cap_run_begin(&run, threads, cap_option(args, "quiet") != NULL);
    enum status status = sam_scene_read(&scene, args->positional[0], &err);
    if (!status)
        status = sam_render(&scene, out, &run, &err);
    if (!status && cap_option(args, "json"))
        printf("{\"capture\": \"%s\", \"shots\": %d, \"photographs\": %d}\n", out, scene.shots,
               scene.shots * scene.exposures);
    else if (!status)
        printf("%s: %d shots of %d photographs\n", out, scene.shots, scene.exposures);
    sam_scene_free(&scene);
    cap_run_end(&run);
    return cap_exit(status, &err);
}

const struct command sam_commands[] = {
    {"render", "SCENE.yaml -o CAPTURE", "make synthetic photographs, with their truth beside them",
     (const struct option[]){{"output", "CAPTURE", "the folder to make", 'o'}, {0}}, run_render},
    {"plan", "SCENE.yaml|OUT", "what shots measure, and which to make next", plan_options,
     run_plan},
    {"goniometer", "SURFACE.yaml -o TABLE", "trace rays at explicit geometry: its BRDF",
     goniometer_options, run_goniometer},
    {0},
};
