/* commands.c -- the commands of calib/: arguments and messages, no arithmetic. */
#include "calib.h"

const struct command cal_commands[] = {
    {0},
};
