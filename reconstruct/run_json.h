/* run_json.h -- run.json: what a run was asked, did and met. */
#ifndef GONIOCAM_RUN_JSON_H
#define GONIOCAM_RUN_JSON_H

#include "checks.h"
#include "gather.h"

/** What run.json tells. Borrows everything; calibration_file may be NULL. */
struct run_story {
    const char *capture, *out, *calibration_file, *input_hash;
    const struct run *run;
    const struct capture *layout;  // its patches; may be NULL
    const struct census *census;
    const struct calibration *calibration;
    const struct bins *bins;
    const struct fits *fits;
    const struct merl *table;
    const struct checks *checks;
    double median_sigma;
};

/** Write run.json, complete or not at all. STATUS_IO, STATUS_MEMORY. */
enum status rec_run_json(const struct run_story *story, const char *path, struct error *err);

#endif
