/* dry_run.h -- what a merge would do, told before it is done. */
#ifndef GONIOCAM_DRY_RUN_H
#define GONIOCAM_DRY_RUN_H

#include "capture.h"

/** Print which photographs become which shot, and why; the dark and flat frames; and which ambient
 *  frames belong to which shot, for which photographs are decoded. As cap_merge(). */
enum status dry_run(const struct capture *capture, struct run *run, struct error *err);
#endif
