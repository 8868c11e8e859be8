/* reconstruct.c -- the whole job: photographs to BRDF. */
#include "bins_hdf5.h"
#include "preview.h"
#include "quantile.h"
#include "run_json.h"
#include "team.h"

#include <stdlib.h>
#include <string.h>

// Everything that a job holds on its way. Freed at its one exit.
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

// The rectangle that the tags span: rays do not pass through it.
static bool board_of(struct board_extent *board, const struct capture *capture)
{
    *board = (struct board_extent){{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
    for (int t = 0; t < capture->tags; t++)
        for (int k = 0; k < 4; k++) {
            vec3 p = cap_tag_corner(&capture->tag[t], k);
            double at[2] = {p.x, p.y};
            for (int i = 0; i < 2; i++) {
                board->low[i] = fmin(board->low[i], at[i]);
                board->high[i] = fmax(board->high[i], at[i]);
            }
        }
    return capture->tags > 0;
}

// The median over bins and channels of sigma / mean.
static double median_sigma(const struct bins *bins)
{
    double *relative = malloc((3 * (size_t)bins->count + 1) * sizeof *relative);
    int n = 0;
    for (int i = 0; relative && i < bins->count; i++)
        for (int c = 0; c < 3; c++)
            if (bins->bin[i].mean[c] > 0)
                relative[n++] = bins->bin[i].sigma[c] / bins->bin[i].mean[c];
    double median = rec_quantile(relative, relative ? n : 0, 0.5);
    free(relative);
    return median;
}

static enum status gather(struct job *j, const char *stage, const struct consensus *consensus,
                          struct samples_file *samples, struct error *err)
{
    struct board_extent board;
    bool has_board = board_of(&board, &j->capture);
    cap_stage(j->run, stage, j->calibration.views);
    rec_team_next_stage(j->run);
    bool fine = consensus && j->fine.grid.theta_h > 0;
    return rec_gather(&j->bins, fine ? &j->fine : NULL, &j->census, &j->calibration,
                      has_board ? &board : NULL, &j->blockers, consensus, samples, j->out, j->run,
                      err);
}

// All photosites as they come, and what the bins so found say of their neighbours. The fit stays
// where it is in j->fits: the consensus is relative to it.
static enum status look_first(struct job *j, struct consensus *consensus, struct error *err)
{
    enum status status = gather(j, "samples", NULL, NULL, err);
    rec_team_alone(j->run, true);
    if (!status && rec_leads()) {
        cap_stage(j->run, "fit", 0);
        status = rec_fit(&j->fits, &j->bins, NULL, 0, j->run, err);
    }
    if (!status && rec_leads()) {
        rec_bins_align(&j->bins, &j->fits.fit[0]);
        rec_bins_widen(&j->bins, &j->fits.fit[0]);
        status = rec_consensus_make(consensus, &j->bins, &j->fits.fit[0], j->run, err);
    }
    rec_bins_free(&j->bins);
    rec_team_alone(j->run, false);
    return rec_team_agree(status, err);
}

// The last look: its samples are kept in samples.h5 where that is asked for.
static enum status gather_kept(struct job *j, const struct consensus *consensus, struct error *err)
{
    struct samples_file samples;
    if (!j->keep_samples)
        return gather(j, "samples again", consensus, NULL, err);
    char *path = cap_path(j->out, "samples.h5");
    enum status status = path ? rec_samples_begin(&samples, path, err)
                              : cap_fail(err, STATUS_MEMORY, "no memory for a path");
    free(path);
    if (status)
        return status;
    struct error story = {0};
    status = gather(j, "samples again", consensus, &samples, &story);
    enum status written = rec_samples_end(&samples, !status, err);
    return status ? cap_fail(err, status, "%s", story.text) : written;
}

// Again, without what strays, and weighted by how much photosites really scatter.
static enum status look_again(struct job *j, struct error *err)
{
    struct consensus consensus = {0};
    struct fit fit;
    enum status status = look_first(j, &consensus, err);
    if (!status)
        status = rec_team_tell_consensus(&consensus, &fit, err);
    if (!status)
        status = gather_kept(j, &consensus, err);
    rec_consensus_free(&consensus);
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
    rec_bins_sharpen(&j->bins, &j->fits.fit[0]);
    status = rec_fit_again(&j->fits, &j->bins, j->run, err);
    if (status)
        return status;
    rec_bins_widen(&j->bins, &j->fits.fit[0]);
    struct consensus consensus = {0};
    status = rec_consensus_make(&consensus, &j->bins, &j->fits.fit[0], j->run, err);
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
    j->median_sigma = median_sigma(&j->bins);
    cap_stage(j->run, "table", 0);
    j->status = malloc(MERL_BINS);
    if (!j->status)
        return cap_fail(err, STATUS_MEMORY, "no memory for the table");
    status = rec_fill(&j->table, j->status, &j->bins, &j->fits.fit[0], j->run, err);
    if (!status) {
        j->checks = rec_checks(&j->bins, &j->census, &j->table);
        rec_checks_warn(&j->checks, j->run);
    }
    return status;
}

// The largest solid angle of the lens's aperture, seen from the sample; 0: EXIF does not tell.
static double detector_solid_angle(const struct job *j)
{
    double largest = 0;
    for (int v = 0; v < j->calibration.views; v++) {
        vec3 eye = cal_eye(j->calibration.view[v].view_from_world);
        double distance = vec3_length(vec3_sub(eye, j->calibration.sample.center));
        for (int p = 0; p < j->capture.photos; p++) {
            const struct photo *photo = &j->capture.photo[p];
            if (photo->aperture > 0 && photo->focal_length > 0) {
                double radius = photo->focal_length / photo->aperture / 2;
                largest = fmax(largest, CAP_PI * radius * radius / (distance * distance));
            }
        }
    }
    return largest;
}

static struct bins_about about_bins(const struct job *j)
{
    return (struct bins_about){
        .version = "goniocam " GONIOCAM_VERSION,
        .input_hash = j->hash,
        .reference_albedo = j->capture.patches ? j->capture.patch[0].albedo : 0,
        .detector_solid_angle = detector_solid_angle(j),
    };
}

static enum status write_bins(const struct job *j, const char *path, struct error *err)
{
    struct bins_about about = about_bins(j);
    return rec_bins_write(&j->bins, j->status, &about, path, err);
}

// The state of a finer bin that was not measured is that of the table's bin about its middle.
static void fine_status(uint8_t *status, const struct job *j)
{
    for (int i = 0; i < rec_grid_bins(j->fine.grid); i++) {
        half_diff low, high;
        rec_grid_ranges(j->fine.grid, i, &low, &high);
        half_diff middle = {(low.theta_h + high.theta_h) / 2, (low.theta_d + high.theta_d) / 2,
                            (low.phi_d + high.phi_d) / 2};
        uint8_t coarse = j->status[rec_merl_index(middle)];
        status[i] = coarse == BIN_MEASURED ? BIN_INTERPOLATED : coarse;
    }
    for (int i = 0; i < j->fine.count; i++)
        status[j->fine.bin[i].index] = BIN_MEASURED;
}

static enum status write_fine(const struct job *j, struct error *err)
{
    const struct grid g = j->fine.grid;
    char name[80];
    snprintf(name, sizeof name, "bins_%dx%dx%d.h5", g.theta_h, g.theta_d, g.phi_d);
    struct bins_about about = about_bins(j);
    char *path = cap_path(j->out, name);
    uint8_t *status = malloc((size_t)rec_grid_bins(g));
    enum status result = cap_fail(err, STATUS_MEMORY, "no memory for %s", name);
    if (path && status) {
        fine_status(status, j);
        result = rec_bins_write(&j->fine, status, &about, path, err);
    }
    free(status);
    free(path);
    return result;
}

static enum status write_fits(const struct job *j, const char *path, struct error *err)
{
    return rec_fits_write(&j->fits, path, err);
}

static enum status write_table(const struct job *j, const char *path, struct error *err)
{
    return rec_merl_write(&j->table, path, err);
}

static enum status write_preview(const struct job *j, const char *path, struct error *err)
{
    return rec_preview(&j->table, &j->fits.fit[0], path, j->run, err);
}

static enum status write_story(const struct job *j, const char *path, struct error *err)
{
    cap_stage(j->run, "", 0);  // the times of all stages are known, but for its own
    struct run_story story = {
        .capture = j->folder,
        .out = j->out,
        .calibration_file = j->calibration_file,
        .input_hash = j->hash,
        .run = j->run,
        .census = &j->census,
        .surroundings = &j->calibration.surroundings,
        .bins = &j->bins,
        .fits = &j->fits,
        .table = &j->table,
        .median_sigma = j->median_sigma,
        .checks = &j->checks,
    };
    return rec_run_json(&story, path, err);
}

static enum status write_results(struct job *j, struct error *err)
{
    static const struct {
        const char *name;
        enum status (*write)(const struct job *j, const char *path, struct error *err);
    } results[] = {
        {"bins.h5", write_bins},        {"fits.yaml", write_fits}, {"brdf.binary", write_table},
        {"preview.png", write_preview}, {"run.json", write_story},
    };
    enum { RESULTS = sizeof results / sizeof *results };
    cap_stage(j->run, "write", RESULTS);
    enum status status = cap_capture_hash(j->hash, &j->capture, err);
    for (int i = 0; i < RESULTS && !status; i++) {
        char *path = cap_path(j->out, results[i].name);
        status = path ? results[i].write(j, path, err)
                      : cap_fail(err, STATUS_MEMORY, "no memory for a path");
        free(path);
        cap_step(j->run);
    }
    return !status && j->fine.bin ? write_fine(j, err) : status;
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
    enum status status = cap_capture_read(&j->capture, j->folder, j->run, err);
    if (!status)
        status = cap_capture_settle(&j->capture, j->run, err);
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
        status = rec_team_agree(rec_blockers_make(&j.blockers, &j.capture, err), err);
    if (!status)
        status = look_again(&j, err);
    rec_team_alone(j.run, true);
    if (!status && rec_leads())
        status = conclude(&j, err);
    if (!status && rec_leads())
        status = write_results(&j, err);
    status = rec_team_agree(status, err);
    if (!status && rec_leads())
        *summary = (struct summary){j.census.shots, j.bins.count, j.median_sigma, j.fits.fit[0]};
    free_job(&j);
    return status;
}
