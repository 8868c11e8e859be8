/* program.h -- what all folders share: status and error, vec3, the run (threads, progress,
 * warnings), the table of commands, files that appear when they are complete.
 *
 * It lies in the lowest folder, beside its face. Any function that takes struct error accepts NULL
 * there.
 */
#ifndef GONIOCAM_PROGRAM_H
#define GONIOCAM_PROGRAM_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

/** A function marked WIDE is compiled for several widths of vector, and the machine's is taken when
 *  the program starts. Sanitizers are not awake yet at that moment, and clang 14 hides such a
 *  function from other files: there the mark means nothing. */
#if defined __x86_64__ && !defined __clang__ && !defined __SANITIZE_ADDRESS__
#define WIDE __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define WIDE
#endif

/* ---- status and error ------------------------------------------------------------------- */

#define STATUS_LIST(X)                                                                             \
    X(OK, "success")                                                                               \
    X(IO, "a file cannot be opened, read or written")                                              \
    X(FORMAT, "a file breaks its format")                                                          \
    X(MEMORY, "out of memory")                                                                     \
    X(DATA, "measurements do not determine the result")                                            \
    X(SOLVER, "a solver did not converge")

#define STATUS_ENUM(name, text) STATUS_##name,
enum status { STATUS_LIST(STATUS_ENUM) };
#undef STATUS_ENUM

/** The story for a person, outermost first: "view 12: a.exr: Is a directory". */
struct error {
    enum status status;
    char text[600];
};

/** Tell *err (may be NULL) and return status: one statement both reports and fails. */
enum status cap_fail(struct error *err, enum status status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/** Put "context: " before the story that *err tells already; returns its status. */
enum status cap_fail_within(struct error *err, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
const char *cap_status_text(enum status status);

/* ---- vec3 ------------------------------------------------------------------------------- */

#define CAP_PI 3.14159265358979323846

typedef struct {
    double x, y, z;
} vec3;

static inline vec3 vec3_add(vec3 a, vec3 b)
{
    vec3 v = {a.x + b.x, a.y + b.y, a.z + b.z};
    return v;
}
static inline vec3 vec3_sub(vec3 a, vec3 b)
{
    vec3 v = {a.x - b.x, a.y - b.y, a.z - b.z};
    return v;
}
static inline vec3 vec3_scale(vec3 a, double s)
{
    vec3 v = {a.x * s, a.y * s, a.z * s};
    return v;
}
static inline double vec3_dot(vec3 a, vec3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
static inline vec3 vec3_cross(vec3 a, vec3 b)
{
    vec3 v = {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    return v;
}
static inline double vec3_length(vec3 a)
{
    return sqrt(vec3_dot(a, a));
}
/** a / |a|; requires |a| > 0. */
static inline vec3 vec3_normalize(vec3 a)
{
    return vec3_scale(a, 1 / vec3_length(a));
}

/* ---- the run: what a command was asked for, and what it has to tell ------------------------ */

/** One stage of a run, for run.json. */
struct stage {
    char name[32];
    double seconds, processor_seconds;  // of the clock; of all threads of this process
};

/** The context of a command: threads, progress on stderr, warnings, timings. Begin with
 *  cap_run_begin() and end with cap_run_end(). Warnings may come from any thread. */
struct run {
    int threads;     // >= 1
    bool quiet;      // no progress; warnings and errors are told all the same
    bool mute;       // warnings come from another process that does the same: say nothing
    char **warning;  // [warnings]
    int warnings;
    int hot, dead;        // photosites found defective, for run.json
    struct stage *stage;  // [stages], finished ones and the current one
    int stages;
    int step, steps;                 // progress of the current stage
    double began, processors_began;  // of the current stage
    bool bar;                        // stderr is a terminal
    bool color;                      // and NO_COLOR is not set
    // Where several processes share a job; NULL: this one is alone.
    bool (*take)(void *team, int item);                 // is this item of the current stage ours?
    void (*tell)(void *team, void *data, size_t size);  // the leader's bytes become those of all
    void (*alone)(struct run *run, bool begins);        // the leader works with the cores of all
    bool follows;                                       // this one does not lead
    void *team;
};

static inline bool cap_ours(const struct run *run, int item)
{
    return !run->take || run->take(run->team, item);
}

/** threads <= 0: one for each core. */
void cap_run_begin(struct run *run, int threads, bool quiet);
void cap_run_end(struct run *run);
/** "goniocam: warning: ..." on stderr, once a line, and remembered for run.json. Thread-safe. */
void cap_warn(struct run *run, const char *format, ...) __attribute__((format(printf, 2, 3)));
/** A line on stderr for who looks on; not where the run is quiet. Thread-safe. */
void cap_tell(struct run *run, const char *format, ...) __attribute__((format(printf, 2, 3)));
/** A warning that another process has told already, for run.json; none twice. Thread-safe. */
void cap_warned(struct run *run, const char *text);
/** A stage of `steps` steps begins; ends the one before. The name "" only ends it. */
void cap_stage(struct run *run, const char *name, int steps);
/** One step of the current stage is done. Thread-safe. */
void cap_step(struct run *run);

/* ---- commands --------------------------------------------------------------------------- */

/** An option of a command: "--name VALUE", or a flag where value is NULL. Tables end with {0}. */
struct option {
    const char *name, *value, *help;
    char letter;  // short form "-o VALUE", or 0
};

enum { ARGUMENTS_MAX = 16 };
/** Parsed arguments: positional ones, and the values of options in the order of given[]. */
struct arguments {
    const char *positional[ARGUMENTS_MAX];
    int count;
    const struct option *given[ARGUMENTS_MAX];
    const char *value[ARGUMENTS_MAX];
    int options;
};

/** One command. A folder's table ends with {0}. Help, manual pages and completion come from it.
 *  run returns 0 done, 1 failed and said why, 2 usage. */
struct command {
    const char *name, *arguments, *help;
    const struct option *options;  // besides the common ones; may be NULL
    int (*run)(const struct arguments *args);
};

/** --threads N, --quiet, --json, --help, --version: every command takes them. */
extern const struct option cap_common_options[];
/** Parse argv[1..] (argv[0] is the command's name) by the command's own and the common options.
 *  false: *err says what is wrong (an unknown option, a missing value, too many arguments). */
bool cap_arguments_parse(struct arguments *args, const struct command *command, int argc,
                         char **argv, struct error *err);
/** The value of an option, "" for a flag that is there, NULL where it was not given. */
const char *cap_option(const struct arguments *args, const char *name);
/** The whole number that an option gives, or fallback. false: it is no number in [low, high];
 *  a message is on stderr, and the command returns 2. */
bool cap_option_int(const struct arguments *args, const char *name, int low, int high, int fallback,
                    int *value);
/** A program: what its manual and its completion are made of. */
struct program {
    const char *name, *purpose, *version;
    const struct command *const *table;  // ends with NULL
};
/** Its manual page, in man(7). */
void cap_manual_write(FILE *to, const struct program *program);
/** Its completion for bash, zsh or fish. false: another shell; nothing is written. */
bool cap_completion_write(FILE *to, const struct program *program, const char *shell);
/** How every command ends: STATUS_OK -> 0; else the story on stderr, and 1. */
int cap_exit(enum status status, const struct error *err);

/* ---- files ------------------------------------------------------------------------------ */

/** "folder/name", malloc'd; the caller frees it. NULL: out of memory. */
char *cap_path(const char *folder, const char *name);
/** Make a folder and its parents. STATUS_IO with the reason, e.g. not writable. */
enum status cap_make_folder(const char *path, struct error *err);
/** A file that appears under its name only when complete. Write to file->stream, then
 *  cap_file_commit (STATUS_IO on a full disk, the name untouched) or cap_file_abandon. A library
 *  that wants a name writes to file->aside, and closes it itself before the commit. */
struct atomic_file {
    char *name, *aside;
    FILE *stream;  // NULL when opened for a library (with_stream false)
};
enum status cap_file_begin(struct atomic_file *file, const char *path, bool with_stream,
                           struct error *err);
enum status cap_file_commit(struct atomic_file *file, struct error *err);
void cap_file_abandon(struct atomic_file *file);
/** Remove what is half-written; from then on no file appears. For a program that is about to end.
 */
void cap_files_stop(void);

/** From here on Ctrl-C (SIGINT, SIGTERM, SIGHUP) ends the program with nothing half-written, and
 *  says on stderr how to go on. Call before any other thread is made. */
void cap_interruptible(const char *program);

/* ---- YAML, written ---------------------------------------------------------------------- */

/** A YAML document under construction (libyaml's emitter). Errors are kept until the end. */
struct yaml_out;
/** On success the caller owns *out; end with cap_yaml_end, which frees it. */
enum status cap_yaml_begin(struct yaml_out **out, const char *path, struct error *err);
void cap_yaml_map(struct yaml_out *out, const char *key);       // key NULL: an item of a list
void cap_yaml_flow_map(struct yaml_out *out, const char *key);  // {on: one, line: ...}
void cap_yaml_list(struct yaml_out *out, const char *key);
void cap_yaml_flow_list(struct yaml_out *out, const char *key);
void cap_yaml_close(struct yaml_out *out);  // the innermost map or list
void cap_yaml_text(struct yaml_out *out, const char *key, const char *value);
void cap_yaml_int(struct yaml_out *out, const char *key, long long value);
/** The shortest decimal that reads back as the same double. */
void cap_yaml_number(struct yaml_out *out, const char *key, double value);
void cap_yaml_numbers(struct yaml_out *out, const char *key, const double *value, int count);
/** Write what is there under its name (or, where keep is false, nothing) and free *out. */
enum status cap_yaml_end(struct yaml_out *out, bool keep, struct error *err);

#ifdef __cplusplus
}
#endif

#endif
