/* commands.h -- commands of calib/ that have files of their own. Internal to calib/. */
#ifndef GONIOCAM_CALIB_COMMANDS_H
#define GONIOCAM_CALIB_COMMANDS_H

#include "capture.h"

/** The positive number that an option gives, or 0 without it. false: it is none; it is told. */
bool option_length(const struct arguments *args, const char *name, double *value);

extern const struct option calibrate_options[];
int run_calibrate(const struct arguments *args);
extern const struct option board_options[];
int run_board(const struct arguments *args);
extern const struct option export_options[];
int run_export(const struct arguments *args);
extern const struct option init_options[];
int run_init(const struct arguments *args);
extern const struct option import_options[];
int run_import(const struct arguments *args);
#endif
