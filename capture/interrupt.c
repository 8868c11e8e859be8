/* interrupt.c -- Ctrl-C: nothing is left half-written, and the person is told how to go on.
 *
 * A thread of its own waits for the signal, which all others leave to it: so it may do whatever a
 * thread may, and a signal handler may not. Its exit code is the shell's, 128 + signal.
 */
#include "program.h"

#include <pthread.h>
#include <signal.h>
#include <unistd.h>

static const char *name = "";

static void *wait_for_signal(void *set)
{
    int signal_number = 0;
    sigwait(set, &signal_number);
    cap_files_stop();
    fprintf(stderr,
            "\n%s: stopped. Files that were finished are kept, none is half-written; the same "
            "command goes on from there.\n",
            name);
    _exit(128 + signal_number);
}

void cap_interruptible(const char *program)
{
    static sigset_t set;
    pthread_t thread;
    sigset_t before;
    name = program;
    sigemptyset(&set);
    sigaddset(&set, SIGINT);
    sigaddset(&set, SIGTERM);
    sigaddset(&set, SIGHUP);
    if (pthread_sigmask(SIG_BLOCK, &set, &before) != 0)
        return;
    if (pthread_create(&thread, NULL, wait_for_signal, &set) == 0)
        pthread_detach(thread);
    else
        pthread_sigmask(SIG_SETMASK, &before, NULL);  // then the signal ends the program at once
}
