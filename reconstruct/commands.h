/* commands.h -- commands of reconstruct/ that stand in files of their own. */
#ifndef GONIOCAM_RECONSTRUCT_COMMANDS_H
#define GONIOCAM_RECONSTRUCT_COMMANDS_H

#include "program.h"

/** "fit OUT|BRDF" and its options. */
extern const struct option rec_fit_options[];
int rec_run_fit(const struct arguments *args);
/** "plot OUT|TABLE... -o FILE" and its options. */
extern const struct option rec_plot_options[];
int rec_run_plot(const struct arguments *args);
/** "report OUT". */
int rec_run_report(const struct arguments *args);

/** "export BRDF --to FORMAT" and its options. */
extern const struct option rec_export_options[];
int rec_run_export(const struct arguments *args);
/** "check BRDF". */
int rec_run_check(const struct arguments *args);
/** "compare A B" and its options. */
extern const struct option rec_compare_options[];
int rec_run_compare(const struct arguments *args);

#endif
