/* arguments.c -- command lines, parsed by the tables that also make the help. */
#include "capture.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

const struct option cap_common_options[] = {
    {"threads", "N", "use N threads (default: one for each core)", 'j'},
    {"quiet", NULL, "show no progress; warnings and errors are shown all the same", 'q'},
    {"json", NULL, "write a result line for scripts on standard output", 0},
    {"help", NULL, "show this text", 'h'},
    {"version", NULL, "show the version", 0},
    {0},
};

static const struct option *find_in(const struct option *table, const char *name, size_t length,
                                    char letter)
{
    for (const struct option *o = table; o && o->name; o++)
        if (letter ? o->letter == letter
                   : strlen(o->name) == length && strncmp(o->name, name, length) == 0)
            return o;
    return NULL;
}

static const struct option *find_option(const struct command *command, const char *name,
                                        size_t length, char letter)
{
    const struct option *own = find_in(command->options, name, length, letter);
    return own ? own : find_in(cap_common_options, name, length, letter);
}

static bool add_positional(struct arguments *args, const char *text, struct error *err)
{
    if (args->count == ARGUMENTS_MAX) {
        cap_fail(err, STATUS_FORMAT, "more than %d arguments", ARGUMENTS_MAX);
        return false;
    }
    args->positional[args->count++] = text;
    return true;
}

/* "--name", "--name VALUE", "--name=VALUE", "-l", "-l VALUE". Moves *i over a VALUE of its own. */
static bool add_option(struct arguments *args, const struct command *command, int argc, char **argv,
                       int *i, struct error *err)
{
    const char *text = argv[*i];
    bool is_long = text[1] == '-';
    const char *name = text + (is_long ? 2 : 1);
    size_t length = strcspn(name, "=");
    const struct option *option = NULL;
    if (is_long)
        option = find_option(command, name, length, 0);
    else if (length == 1)
        option = find_option(command, name, length, name[0]);
    const char *value = name[length] == '=' ? name + length + 1 : NULL;
    if (!option) {
        cap_fail(err, STATUS_FORMAT, "no option is called '%s'", text);
    } else if (args->options == ARGUMENTS_MAX) {
        cap_fail(err, STATUS_FORMAT, "more than %d options", ARGUMENTS_MAX);
    } else if (cap_option(args, option->name)) {
        cap_fail(err, STATUS_FORMAT, "--%s is given twice", option->name);
    } else if (!option->value && value) {
        cap_fail(err, STATUS_FORMAT, "--%s takes no value", option->name);
    } else if (option->value && !value && *i + 1 == argc) {
        cap_fail(err, STATUS_FORMAT, "--%s needs a value: --%s %s", option->name, option->name,
                 option->value);
    } else {
        if (option->value && !value)
            value = argv[++*i];
        args->given[args->options] = option;
        args->value[args->options++] = option->value ? value : "";
        return true;
    }
    return false;
}

bool cap_arguments_parse(struct arguments *args, const struct command *command, int argc,
                         char **argv, struct error *err)
{
    *args = (struct arguments){0};
    bool only_positional = false;  // after "--"
    for (int i = 1; i < argc; i++) {
        const char *text = argv[i];
        bool ok;
        if (only_positional || text[0] != '-' || text[1] == '\0') {
            ok = add_positional(args, text, err);
        } else if (strcmp(text, "--") == 0) {
            ok = only_positional = true;
        } else {
            ok = add_option(args, command, argc, argv, &i, err);
        }
        if (!ok)
            return false;
    }
    return true;
}

const char *cap_option(const struct arguments *args, const char *name)
{
    for (int i = 0; i < args->options; i++)
        if (strcmp(args->given[i]->name, name) == 0)
            return args->value[i];
    return NULL;
}

bool cap_option_int(const struct arguments *args, const char *name, int low, int high, int fallback,
                    int *value)
{
    const char *text = cap_option(args, name);
    if (!text) {
        *value = fallback;
        return true;
    }
    char *end;
    errno = 0;
    long number = strtol(text, &end, 10);
    if (errno || end == text || *end || number < low || number > high) {
        fprintf(stderr, "goniocam: --%s %s: not a whole number from %d to %d\n", name, text, low,
                high);
        return false;
    }
    *value = (int)number;
    return true;
}

int cap_exit(enum status status, const struct error *err)
{
    if (status)
        fprintf(stderr, "goniocam: %s (%s)\n", err->text, cap_status_text(status));
    return status ? 1 : 0;
}
