/* job.h -- all that reconstruct finds on its way, and the files that it becomes. */
#ifndef GONIOCAM_JOB_H
#define GONIOCAM_JOB_H

#include "checks.h"
#include "gather.h"

/** Everything that a job holds on its way. Freed at its one exit. */
struct job {
    const char *folder, *out, *calibration_file;
    bool keep_samples;
    struct run *run;
    struct capture capture;
    struct calibration calibration;
    struct blockers blockers;
    int all_views;  // of the calibration, also those left out
    bool *usable;   // [shots]
    char hash[33];
    struct census census;
    struct checks checks;
    struct bins bins, fine;  // fine: on the grid that is asked for, if any
    struct fits fits;
    struct merl table;
    uint8_t *status;  // [MERL_BINS]
    double median_sigma;
};

/** The rectangle that the tags span: rays do not pass through it. false: there are no tags. */
bool rec_job_board(struct board_extent *board, const struct job *job);
/** bins.h5, fits.yaml, brdf.binary, preview.png, predicted/, run.json, report.html, each complete
 *  or not at all. */
enum status rec_job_write(struct job *job, struct error *err);

#endif
