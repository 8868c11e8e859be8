/* commands_goniometer.h -- "goniometer SURFACE.yaml -o TABLE"; commands.c has the table. */
#ifndef GONIOCAM_SAMPLES_COMMANDS_GONIOMETER_H
#define GONIOCAM_SAMPLES_COMMANDS_GONIOMETER_H

#include "program.h"

extern const struct option goniometer_options[];
int run_goniometer(const struct arguments *args);
#endif
