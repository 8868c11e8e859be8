/* goniocam.c -- the front door: joins the folders' command tables, finds the command, runs it. */
#include "calib.h"
#include "capture.h"
#include "reconstruct.h"
#include "samples.h"

#include <stdio.h>
#include <string.h>

static int run_manual(const struct arguments *args);
static int run_completion(const struct arguments *args);

static const struct command front_commands[] = {
    {"manual", "", "this program's manual page: goniocam manual | man -l -", NULL, run_manual},
    {"completion", "bash|zsh|fish", "what a shell completes command lines with", NULL,
     run_completion},
    {0},
};
// In the order of a day's work; ends with NULL.
static const struct command *const tables[] = {rec_commands, cap_commands,   cal_commands,
                                               sam_commands, front_commands, NULL};
static const struct program program = {
    "goniocam", "from a folder of photographs to a material's BRDF", GONIOCAM_VERSION, tables};

static int run_manual(const struct arguments *args)
{
    if (args->count != 0)
        return 2;
    cap_manual_write(stdout, &program);
    return 0;
}

static int run_completion(const struct arguments *args)
{
    return args->count == 1 && cap_completion_write(stdout, &program, args->positional[0]) ? 0 : 2;
}

static const struct command *find_command(const char *name)
{
    for (int t = 0; tables[t]; t++)
        for (const struct command *c = tables[t]; c->name; c++)
            if (strcmp(c->name, name) == 0)
                return c;
    return NULL;
}

static void print_options(FILE *to, const struct option *options)
{
    for (const struct option *o = options; o && o->name; o++) {
        char left[40];
        snprintf(left, sizeof left, "--%s%s%s", o->name, o->value ? " " : "",
                 o->value ? o->value : "");
        fprintf(to, "  %c%c%s%-20s %s\n", o->letter ? '-' : ' ', o->letter ? o->letter : ' ',
                o->letter ? ", " : "  ", left, o->help);
    }
}

static void print_usage(FILE *to)
{
    fprintf(to, "%s: %s\n\nusage: %s COMMAND ARGUMENTS\n\n", program.name, program.purpose,
            program.name);
    for (int t = 0; tables[t]; t++)
        for (const struct command *c = tables[t]; c->name; c++)
            fprintf(to, "  %-12s %-24s %s\n", c->name, c->arguments, c->help);
    fprintf(to, "\noptions of every command:\n");
    print_options(to, cap_common_options);
}

static void print_command_usage(FILE *to, const struct command *c)
{
    fprintf(to, "usage: goniocam %s %s\n%s\n\noptions:\n", c->name, c->arguments, c->help);
    print_options(to, c->options);
    print_options(to, cap_common_options);
}

static int run_command(const struct command *command, int argc, char **argv)
{
    struct arguments args;
    struct error err = {0};
    if (!cap_arguments_parse(&args, command, argc, argv, &err)) {
        fprintf(stderr, "goniocam %s: %s\n", command->name, err.text);
        print_command_usage(stderr, command);
        return 2;
    }
    if (cap_option(&args, "help")) {
        print_command_usage(stdout, command);
        return 0;
    }
    cap_interruptible("goniocam");
    int code = command->run(&args);
    if (code == 2)
        print_command_usage(stderr, command);
    if (fflush(stdout) != 0 || ferror(stdout)) {
        fprintf(stderr, "goniocam: standard output cannot be written\n");
        return 1;
    }
    return code;
}

int main(int argc, char **argv)
{
    if (argc >= 2 && strcmp(argv[1], "--version") == 0) {
        puts("goniocam " GONIOCAM_VERSION);
        return 0;
    }
    if (argc >= 2 && (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0)) {
        print_usage(stdout);
        return 0;
    }
    const struct command *command = argc >= 2 ? find_command(argv[1]) : NULL;
    if (!command) {
        if (argc >= 2)
            fprintf(stderr, "goniocam: no command is called '%s'\n\n", argv[1]);
        print_usage(stderr);
        return 2;
    }
    return run_command(command, argc - 1, argv + 1);
}
