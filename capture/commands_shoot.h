/* commands_shoot.h -- goniocam shoot, for the table of commands. */
#ifndef GONIOCAM_COMMANDS_SHOOT_H
#define GONIOCAM_COMMANDS_SHOOT_H

#include "program.h"

extern const struct option shoot_options[];
int run_shoot(const struct arguments *args);

#endif
