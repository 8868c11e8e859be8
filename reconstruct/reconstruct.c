/* reconstruct.c -- the whole job: photographs to BRDF. */
#include "looks.h"
#include "bins.h"
#include "summary.h"
#include "team.h"

#include <stdlib.h>
#include <string.h>

// Views of somebody's calibration that this capture has no map for are left out.
static enum status keep_views_with_maps(struct job *j, struct error *err)
{
    struct calibration *c = &j->calibration;
    int kept = 0;
    for (int v = 0; v < c->views; v++) {
        bool there = false;
        for (int s = 0; s < j->capture.shots; s++)
            there =
                there || (j->usable[s] && strcmp(j->capture.shot[s].name, c->view[v].name) == 0);
        if (!there) {
            cap_warn(j->run, "%s: shot %s is not among the photographs: left out",
                     j->calibration_file, c->view[v].name);
            continue;
        }
        struct view swap = c->view[kept];  // all stay in the list, so that all are freed
        c->view[kept++] = c->view[v];
        c->view[v] = swap;
    }
    if (kept == 0)
        return cap_fail(err, STATUS_DATA, "%s: none of its shots is in %s", j->calibration_file,
                        j->folder);
    j->all_views = c->views;
    c->views = kept;
    return STATUS_OK;
}

static enum status calibrate(struct job *j, struct error *err)
{
    enum status status;
    if (j->calibration_file) {
        status = cal_calibration_read(&j->calibration, j->calibration_file, err);
        if (!status)
            status = keep_views_with_maps(j, err);
        if (!status && j->calibration.sample.shape != SHAPE_NONE)
            status = cal_look_around(&j->calibration, &j->capture, j->out, j->run, err);
    } else {
        status = cal_calibrate(&j->calibration, &j->capture, j->out, j->usable, j->run, err);
    }
    if (status)
        return status;
    if (j->calibration.sample.shape == SHAPE_NONE)
        return cap_fail(err, STATUS_DATA, "there is no sample: a sphere, a cylinder or a mesh");
    char *path = cap_path(j->out, "calibration.yaml");
    status = path ? cal_calibration_write(&j->calibration, path, err)
                  : cap_fail(err, STATUS_MEMORY, "no memory");
    free(path);
    return status;
}

static enum status calibrate_alone(struct job *j, struct error *err)
{
    rec_team_alone(j->run, true);
    enum status status = calibrate(j, err);
    rec_team_alone(j->run, false);
    return status;
}

static double mean_blur2(const struct calibration *c)
{
    double sum = 0;
    for (int v = 0; v < c->views; v++)
        sum += c->view[v].blur_px * c->view[v].blur_px;
    return sum / c->views;
}

// A blunt highlight makes a blunt fit, which sharpens it too little: both, until they agree.
static enum status sharpen(struct job *j, struct error *err)
{
    const double little = 0.2;  // of a bin's noise
    enum { ROUNDS = 6 };
    enum status status = STATUS_OK;
    j->bins.blur2 = j->fine.blur2 = mean_blur2(&j->calibration);
    for (int k = 0; k < ROUNDS && !status; k++) {
        double change = rec_bins_sharpen(&j->bins, &j->fits.fit[0]);
        if (k > 0 && change < little)
            break;
        status = rec_fit_again(&j->fits, &j->bins, j->run, err);
    }
    return status;
}

// The leader's: fits, errors and the complete table.
static enum status conclude(struct job *j, struct error *err)
{
    cap_stage(j->run, "fit again", 0);
    rec_bins_align(&j->bins, &j->fits.fit[0]);
    enum status status = rec_fit_again(&j->fits, &j->bins, j->run, err);
    if (status)
        return status;
    status = sharpen(j, err);
    if (status)
        return status;
    rec_bins_widen(&j->bins, &j->fits.fit[0]);
    struct consensus consensus = {0};
    const double now = j->calibration.surroundings.strength, strength[2] = {now, now};
    status = rec_consensus_make(&consensus, &j->bins, &j->fits.fit[0], strength, j->run, err);
    if (status)
        return status;
    rec_consensus_widen(&j->bins, &consensus);
    if (j->fine.bin) {
        rec_bins_align(&j->fine, &j->fits.fit[0]);
        rec_bins_sharpen(&j->fine, &j->fits.fit[0]);
        rec_bins_widen(&j->fine, &j->fits.fit[0]);
        rec_consensus_widen(&j->fine, &consensus);
    }
    rec_consensus_free(&consensus);
    j->median_sigma = rec_median_sigma(&j->bins);
    cap_stage(j->run, "table", 0);
    j->status = malloc(MERL_BINS);
    if (!j->status)
        return cap_fail(err, STATUS_MEMORY, "no memory for the table");
    status = rec_fill(&j->table, j->status, &j->bins, &j->fits.fit[0], j->run, err);
    if (!status)
        status = rec_checks(&j->checks, &j->bins, &j->census, &j->table, j->status,
                            j->fits.fit[0].log_rms, &j->calibration.surroundings, err);
    if (!status)
        rec_checks_warn(&j->checks, j->run);
    return status;
}

static void free_job(struct job *j)
{
    rec_merl_free(&j->table);
    rec_fits_free(&j->fits);
    rec_bins_free(&j->bins);
    rec_bins_free(&j->fine);
    j->calibration.views = j->all_views > 0 ? j->all_views : j->calibration.views;
    cal_calibration_free(&j->calibration);
    rec_blockers_free(&j->blockers);
    cap_capture_free(&j->capture);
    free(j->usable);
    free(j->status);
}

// Photographs to radiance maps.
static enum status merge(struct job *j, struct error *err)
{
    j->run->mute = !rec_leads();  // all read the same
    enum status status = cap_capture_read(&j->capture, j->folder, j->run, err);
    if (!status)
        status = cap_capture_settle(&j->capture, j->run, err);
    j->run->mute = false;
    if (!status)
        status = cap_make_folder(j->out, err);
    if (!status) {
        j->usable = calloc((size_t)j->capture.shots + 1, sizeof *j->usable);
        if (!j->usable)
            status = cap_fail(err, STATUS_MEMORY, "no memory for shots");
    }
    status = rec_team_agree(status, err);
    if (status)
        return status;
    rec_team_next_stage(j->run);
    status = cap_merge(&j->capture, j->out, NULL, j->usable, j->run, err);
    rec_team_any(j->usable, j->capture.shots);
    return rec_team_agree(status, err);
}

enum status rec_reconstruct(struct summary *summary, const struct request *request, struct run *run,
                            struct error *err)
{
    struct job j = {.folder = request->capture,
                    .out = request->out,
                    .calibration_file = request->calibration,
                    .keep_samples = request->samples,
                    .fine.grid = request->grid,
                    .run = run};
    enum status status = merge(&j, err);
    if (!status)
        status = rec_team_agree(rec_leads() ? calibrate_alone(&j, err) : STATUS_OK, err);
    if (!status)
        status = rec_team_tell_calibration(&j.calibration, err);
    if (!status)
        status =
            rec_team_agree(rec_blockers_make(&j.blockers, &j.capture, &j.calibration, err), err);
    if (!status)
        status = rec_looks(&j, err);
    cap_radiance_forget();
    rec_team_alone(j.run, true);
    rec_team_hear_warnings(j.run);
    if (!status && rec_leads())
        status = conclude(&j, err);
    if (!status && rec_leads())
        status = rec_job_write(&j, err);
    status = rec_team_agree(status, err);
    if (!status && rec_leads())
        *summary = rec_summary_of(&j);
    free_job(&j);
    return status;
}
