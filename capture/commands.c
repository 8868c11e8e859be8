/* commands.c -- the commands of capture/: arguments and messages, no arithmetic. */
#include "capture.h"

const struct command cap_commands[] = {
    {0},
};
