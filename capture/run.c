/* run.c -- the context of a command: threads, progress, warnings, timings.
 *
 * Progress goes to stderr: a bar with rate and time left on a terminal, one plain line a finished
 * stage elsewhere, nothing if quiet. One mutex guards what threads share.
 */
#include "capture.h"

#include <omp.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static const char clear_line[] = "\r\033[K";

static double clock_of(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static double now(void)
{
    return clock_of(CLOCK_MONOTONIC);
}

// Of all threads: what a stage costs, whoever else is on the machine.
static double processors_now(void)
{
    return clock_of(CLOCK_PROCESS_CPUTIME_ID);
}

void cap_run_begin(struct run *run, int threads, bool quiet)
{
    *run = (struct run){.threads = threads > 0 ? threads : omp_get_num_procs(),
                        .quiet = quiet,
                        .bar = isatty(STDERR_FILENO) == 1};
    run->color = run->bar && !getenv("NO_COLOR");  // https://no-color.org
    omp_set_num_threads(run->threads);
}

void cap_run_end(struct run *run)
{
    cap_stage(run, "", 0);
    for (int i = 0; i < run->warnings; i++)
        free(run->warning[i]);
    free(run->warning);
    free(run->stage);
    *run = (struct run){0};
}

// "12 s", "3 min 20 s", "1 h 05 min".
static const char *duration(char *text, size_t size, double seconds)
{
    long s = (long)(seconds + 0.5);
    if (s < 60)
        snprintf(text, size, "%ld s", s);
    else if (s < 3600)
        snprintf(text, size, "%ld min %02ld s", s / 60, s % 60);
    else
        snprintf(text, size, "%ld h %02ld min", s / 3600, s / 60 % 60);
    return text;
}

static void draw_bar(const struct run *run)
{
    enum { CELLS = 24 };
    static const char full[] = "########################";
    double seconds = now() - run->began;
    int filled = run->steps > 0 ? CELLS * run->step / run->steps : 0;
    fprintf(stderr, "%s%-14s", clear_line, run->stage[run->stages - 1].name);
    if (run->steps == 0)
        fprintf(stderr, "...");
    else
        fprintf(stderr, "[%s%-*.*s%s] %d/%d", run->color ? "\033[32m" : "", CELLS, filled, full,
                run->color ? "\033[0m" : "", run->step, run->steps);
    if (run->step > 0 && run->step < run->steps && seconds > 0) {
        char left[32];
        double rate = run->step / seconds;
        fprintf(stderr, rate < 1 ? "  %.2f/s" : "  %.1f/s", rate);
        fprintf(stderr, ", %s left", duration(left, sizeof left, (run->steps - run->step) / rate));
    }
    fflush(stderr);
}

static void remember(struct run *run, const char *text)
{
    for (int i = 0; i < run->warnings; i++)
        if (strcmp(run->warning[i], text) == 0)
            return;
    char **grown = realloc(run->warning, (size_t)(run->warnings + 1) * sizeof *grown);
    if (!grown)
        return;
    run->warning = grown;
    char *copy = strdup(text);
    if (copy)
        run->warning[run->warnings++] = copy;
}

void cap_warn(struct run *run, const char *format, ...)
{
    char text[800];
    va_list args;
    if (run->mute)
        return;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    pthread_mutex_lock(&lock);
    fprintf(stderr, "%sgoniocam: %swarning:%s %s\n", run->bar && run->began > 0 ? clear_line : "",
            run->color ? "\033[33m" : "", run->color ? "\033[0m" : "", text);
    remember(run, text);
    pthread_mutex_unlock(&lock);
}

void cap_tell(struct run *run, const char *format, ...)
{
    char text[800];
    va_list args;
    if (run->mute || run->quiet)
        return;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    pthread_mutex_lock(&lock);
    fprintf(stderr, "%s%s\n", run->bar && run->began > 0 ? clear_line : "", text);
    pthread_mutex_unlock(&lock);
}

void cap_warned(struct run *run, const char *text)
{
    pthread_mutex_lock(&lock);
    remember(run, text);
    pthread_mutex_unlock(&lock);
}

static void end_stage(struct run *run)
{
    if (run->began <= 0 || run->stages == 0)
        return;
    struct stage *stage = &run->stage[run->stages - 1];
    stage->seconds = now() - run->began;
    stage->processor_seconds = processors_now() - run->processors_began;
    run->began = 0;
    if (!run->quiet)
        fprintf(stderr, "%s%-14s%.2f s\n", run->bar ? clear_line : "", stage->name, stage->seconds);
}

void cap_stage(struct run *run, const char *name, int steps)
{
    pthread_mutex_lock(&lock);
    end_stage(run);
    struct stage *grown = NULL;
    if (*name)
        grown = realloc(run->stage, (size_t)(run->stages + 1) * sizeof *grown);
    if (grown) {  // without memory for it, the stage runs untimed
        run->stage = grown;
        struct stage *stage = &run->stage[run->stages++];
        *stage = (struct stage){0};
        snprintf(stage->name, sizeof stage->name, "%s", name);
        run->step = 0;
        run->steps = steps;
        run->began = now();
        run->processors_began = processors_now();
        if (run->bar && !run->quiet)
            draw_bar(run);
    }
    pthread_mutex_unlock(&lock);
}

void cap_step(struct run *run)
{
    pthread_mutex_lock(&lock);
    run->step++;
    if (run->bar && !run->quiet && run->began > 0)
        draw_bar(run);
    pthread_mutex_unlock(&lock);
}
