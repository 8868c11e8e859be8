/* commands.c -- the commands of samples/: arguments and messages, no arithmetic. */
#include "samples.h"

const struct command sam_commands[] = {
    {0},
};
