/* manual.c -- manual pages and shell completion, made from the tables that parse the arguments.
 *
 * So there is one copy of the words: `goniocam --help`, man pages and completion cannot disagree.
 */
#include "program.h"

#include <string.h>

/* ---- manual pages, in man(7) -------------------------------------------------------------- */

// Text with what troff would take for its own escaped: backslashes, hyphens, leading dots.
static void print_roff(FILE *to, const char *text)
{
    if (*text == '.' || *text == '\'')
        fputs("\\&", to);
    for (; *text; text++) {
        if (*text == '\\')
            fputs("\\e", to);
        else if (*text == '-')
            fputs("\\-", to);
        else
            fputc(*text, to);
    }
}

static void print_roff_line(FILE *to, const char *macro, const char *text)
{
    fputs(macro, to);
    print_roff(to, text);
    fputc('\n', to);
}

static void print_options_roff(FILE *to, const struct option *options)
{
    for (const struct option *o = options; o && o->name; o++) {
        fputs(".TP\n", to);
        if (o->letter)
            fprintf(to, "\\fB\\-%c\\fR, ", o->letter);
        fputs("\\fB\\-\\-", to);
        print_roff(to, o->name);
        fputs("\\fR", to);
        if (o->value) {
            fputs(" \\fI", to);
            print_roff(to, o->value);
            fputs("\\fR", to);
        }
        fputc('\n', to);
        print_roff_line(to, "", o->help);
    }
}

static void print_command_roff(FILE *to, const struct program *program, const struct command *c)
{
    fputs(".SS \"", to);
    print_roff(to, program->name);
    fputc(' ', to);
    print_roff(to, c->name);
    fputc(' ', to);
    print_roff(to, c->arguments);
    fputs("\"\n", to);
    print_roff_line(to, "", c->help);
    print_options_roff(to, c->options);
}

void cap_manual_write(FILE *to, const struct program *program)
{
    fprintf(to, ".TH %s 1 \"\" \"%s %s\"\n.SH NAME\n%s \\- ", program->name, program->name,
            program->version, program->name);
    print_roff_line(to, "", program->purpose);
    fprintf(to, ".SH SYNOPSIS\n.B %s\n.I COMMAND ARGUMENTS\n.SH COMMANDS\n", program->name);
    for (int t = 0; program->table[t]; t++)
        for (const struct command *c = program->table[t]; c->name; c++)
            print_command_roff(to, program, c);
    fputs(".SH \"OPTIONS OF EVERY COMMAND\"\n", to);
    print_options_roff(to, cap_common_options);
    fputs(".SH \"EXIT STATUS\"\n0 done, 1 failed and said why, 2 usage.\n", to);
    fputs(".SH ENVIRONMENT\n.TP\n.B NO_COLOR\nno colours on a terminal\n", to);
}

/* ---- completion --------------------------------------------------------------------------- */

static void each_option(FILE *to, const struct option *options, const char *format)
{
    for (const struct option *o = options; o && o->name; o++)
        fprintf(to, format, o->name);
}

static void print_names(FILE *to, const struct program *program)
{
    const char *space = "";
    for (int t = 0; program->table[t]; t++)
        for (const struct command *c = program->table[t]; c->name; c++, space = " ")
            fprintf(to, "%s%s", space, c->name);
}

static void write_bash(FILE *to, const struct program *program)
{
    fprintf(to,
            "# bash completion for %s\n_%s()\n{\n    local word=${COMP_WORDS[COMP_CWORD]} "
            "options=\n    COMPREPLY=()\n    if [ \"$COMP_CWORD\" -eq 1 ]; then\n"
            "        COMPREPLY=($(compgen -W \"",
            program->name, program->name);
    print_names(to, program);
    fputs(" --help --version\" -- \"$word\"))\n        return\n    fi\n"
          "    case ${COMP_WORDS[1]} in\n",
          to);
    for (int t = 0; program->table[t]; t++)
        for (const struct command *c = program->table[t]; c->name; c++) {
            fprintf(to, "    %s) options=\"", c->name);
            each_option(to, c->options, "--%s ");
            fputs("\" ;;\n", to);
        }
    fputs("    esac\n    case $word in\n    -*) COMPREPLY=($(compgen -W \"$options", to);
    each_option(to, cap_common_options, " --%s");
    fprintf(to,
            "\" -- \"$word\")) ;;\n    *) COMPREPLY=($(compgen -f -- \"$word\")) ;;\n    esac\n}\n"
            "complete -o filenames -F _%s %s\n",
            program->name, program->name);
}

// Text within single quotes of zsh and fish: neither table holds a single quote that they know.
static void print_quoted(FILE *to, const char *text, const char *special)
{
    for (; *text; text++) {
        if (*text == '\'')
            fputs("'\\'", to);
        else if (strchr(special, *text))
            fputc('\\', to);
        fputc(*text, to);
    }
}

static void zsh_options(FILE *to, const struct option *options)
{
    for (const struct option *o = options; o && o->name; o++) {
        fprintf(to, " \\\n            '--%s[", o->name);
        print_quoted(to, o->help, "[]:\\");
        fputc(']', to);
        if (o->value)
            fprintf(to, ":%s:_files", o->value);
        fputc('\'', to);
    }
}

static void write_zsh(FILE *to, const struct program *program)
{
    fprintf(to, "#compdef %s\n_%s() {\n    local -a commands\n    commands=(\n", program->name,
            program->name);
    for (int t = 0; program->table[t]; t++)
        for (const struct command *c = program->table[t]; c->name; c++) {
            fprintf(to, "        '%s:", c->name);
            print_quoted(to, c->help, ":\\");
            fputs("'\n", to);
        }
    fprintf(to, "    )\n    if (( CURRENT == 2 )); then\n        _describe command commands\n"
                "        return\n    fi\n    case $words[2] in\n");
    for (int t = 0; program->table[t]; t++)
        for (const struct command *c = program->table[t]; c->name; c++) {
            fprintf(to, "        %s) _arguments '*:file:_files'", c->name);
            zsh_options(to, c->options);
            zsh_options(to, cap_common_options);
            fputs(" ;;\n", to);
        }
    fprintf(to, "    esac\n}\n_%s \"$@\"\n", program->name);
}

static void fish_options(FILE *to, const char *program, const char *command,
                         const struct option *options)
{
    for (const struct option *o = options; o && o->name; o++) {
        fprintf(to, "complete -c %s", program);
        if (command)
            fprintf(to, " -n '__fish_seen_subcommand_from %s'", command);
        fprintf(to, " -l %s%s -d '", o->name, o->value ? " -r" : "");
        print_quoted(to, o->help, "\\");
        fputs("'\n", to);
    }
}

static void write_fish(FILE *to, const struct program *program)
{
    for (int t = 0; program->table[t]; t++)
        for (const struct command *c = program->table[t]; c->name; c++) {
            fprintf(to, "complete -c %s -n __fish_use_subcommand -a %s -d '", program->name,
                    c->name);
            print_quoted(to, c->help, "\\");
            fputs("'\n", to);
            fish_options(to, program->name, c->name, c->options);
        }
    fish_options(to, program->name, NULL, cap_common_options);
}

bool cap_completion_write(FILE *to, const struct program *program, const char *shell)
{
    static const struct {
        const char *name;
        void (*write)(FILE *to, const struct program *program);
    } shells[] = {{"bash", write_bash}, {"zsh", write_zsh}, {"fish", write_fish}};
    for (size_t i = 0; i < sizeof shells / sizeof *shells; i++)
        if (strcmp(shells[i].name, shell) == 0) {
            shells[i].write(to, program);
            return true;
        }
    return false;
}
