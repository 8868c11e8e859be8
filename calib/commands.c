/* commands.c -- the commands of calib/. */
#include "calib.h"
#include "commands.h"

const struct command cal_commands[] = {
    {"calibrate", "CAPTURE -o OUT", "find cameras, poses, sample and lamps", calibrate_options,
     run_calibrate},
    {"init", "PHOTOS --tag-size MM", "a first capture.yaml from the photographs", init_options,
     run_init},
    {"board", "-o PDF > capture.yaml", "a board to print, and its capture.yaml on stdout",
     board_options, run_board},
    {"import-calibration", "CALIBRATION -o FILE", "other programs' calibration as calibration.yaml",
     import_options, run_import},
    {"export-calibration", "CALIBRATION --to FORMAT -o OUT", "calibration.yaml for other programs",
     export_options, run_export},
    {0},
};
