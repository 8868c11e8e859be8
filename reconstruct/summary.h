/* summary.h -- what reconstruct tells at its end. */
#ifndef GONIOCAM_SUMMARY_H
#define GONIOCAM_SUMMARY_H

#include "job.h"

struct summary rec_summary_of(const struct job *job);
/** A table for a person on stdout. */
void rec_summary_print(const struct summary *summary, const char *out);
/** One line of JSON. */
void rec_summary_print_json(const struct summary *summary, const char *out);
/** "ggx:  albedo 0.5 +- 0.01, ..." on stdout. */
void rec_fit_print(const struct fit *fit);

#endif
