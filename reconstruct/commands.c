/* commands.c -- the commands of reconstruct/: arguments and messages, no arithmetic. */
#include "reconstruct.h"

const struct command rec_commands[] = {
    {0},
};
