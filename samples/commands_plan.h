/* commands_plan.h -- goniocam plan, for the table of commands. */
#ifndef GONIOCAM_SAMPLES_COMMANDS_PLAN_H
#define GONIOCAM_SAMPLES_COMMANDS_PLAN_H

#include "capture.h"

extern const struct option plan_options[];
int run_plan(const struct arguments *args);

#endif
