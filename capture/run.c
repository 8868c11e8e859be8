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

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

void cap_run_begin(struct run *run, int threads, bool quiet)
{
    *run = (struct run){.threads = threads > 0 ? threads : omp_get_num_procs(),
                        .quiet = quiet,
                        .bar = isatty(STDERR_FILENO) == 1};
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

static void draw_bar(const struct run *run)
{
    enum { CELLS = 24 };
    static const char full[] = "########################";
    double seconds = now() - run->began;
    double rate = seconds > 0 ? run->step / seconds : 0;
    int filled = run->steps > 0 ? CELLS * run->step / run->steps : 0;
    fprintf(stderr, "%s%-12s [%-*.*s] %d/%d", clear_line, run->stage[run->stages - 1].name, CELLS,
            filled, full, run->step, run->steps);
    if (run->step > 0)
        fprintf(stderr, "  %.1f/s, %.0f s left", rate, (run->steps - run->step) / rate);
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
    fprintf(stderr, "%sgoniocam: warning: %s\n", run->bar && run->began > 0 ? clear_line : "",
            text);
    remember(run, text);
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
    run->began = 0;
    if (!run->quiet)
        fprintf(stderr, "%s%-12s %.2f s\n", run->bar ? clear_line : "", stage->name,
                stage->seconds);
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
