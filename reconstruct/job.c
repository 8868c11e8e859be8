/* job.c -- the files that a job ends in. */
#include "job.h"

#include "bins_hdf5.h"
#include "lookup.h"
#include "predicted.h"
#include "preview.h"
#include "report.h"
#include "run_json.h"

#include <stdlib.h>

bool rec_job_board(struct board_extent *board, const struct job *j)
{
    const struct capture *capture = &j->capture;
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

// The largest solid angle of a lamp's ball, seen from the sample; 0: points, or not known.
static double lamp_solid_angle(const struct calibration *c)
{
    double largest = 0;
    for (int v = 0; v < c->views; v++) {
        const struct lamp *lamp = &c->lamp[c->view[v].light];
        vec3 place = cal_lamp_position(lamp, c->view[v].view_from_world);
        double sine = fmin(1, lamp->radius / vec3_length(vec3_sub(place, c->sample.center)));
        double cosine = sqrt(1 - sine * sine);  // 1 - cos without cancellation
        largest = fmax(largest, 2 * CAP_PI * sine * sine / (1 + cosine));
    }
    return largest;
}

static struct bins_about about_bins(const struct job *j)
{
    return (struct bins_about){
        .version = "goniocam " GONIOCAM_VERSION,
        .input_hash = j->hash,
        .reference_albedo =
            j->capture.patches ? j->capture.patch[0].albedo : j->capture.reference_albedo,
        .lamp_solid_angle = lamp_solid_angle(&j->calibration),
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

static enum status write_predicted(const struct job *j, struct error *err)
{
    struct board_extent board;
    struct brdf brdf = {.table = j->table};  // borrowed
    const struct predicted_of of = {.calibration = &j->calibration,
                                    .brdf = &brdf,
                                    .board = rec_job_board(&board, j) ? &board : NULL,
                                    .blockers = &j->blockers,
                                    .out = j->out};
    enum status status = rec_lookup_make(&brdf.lookup, &j->table, err);
    if (!status)
        status = rec_predicted(&of, j->run, err);
    rec_lookup_free(brdf.lookup);
    return status;
}

static enum status write_story(const struct job *j, const char *path, struct error *err)
{
    cap_stage(j->run, "", 0);  // the times of all stages are known, but for the report's
    struct run_story story = {
        .capture = j->folder,
        .out = j->out,
        .calibration_file = j->calibration_file,
        .input_hash = j->hash,
        .run = j->run,
        .layout = &j->capture,
        .census = &j->census,
        .calibration = &j->calibration,
        .bins = &j->bins,
        .fits = &j->fits,
        .table = &j->table,
        .median_sigma = j->median_sigma,
        .checks = &j->checks,
    };
    return rec_run_json(&story, path, err);
}

typedef enum status writer(const struct job *j, const char *path, struct error *err);

static enum status write_one(const struct job *j, const char *name, writer *write,
                             struct error *err)
{
    char *path = cap_path(j->out, name);
    enum status status =
        path ? write(j, path, err) : cap_fail(err, STATUS_MEMORY, "no memory for a path");
    free(path);
    return status;
}

enum status rec_job_write(struct job *j, struct error *err)
{
    static const struct {
        const char *name;
        writer *write;
    } results[] = {
        {"bins.h5", write_bins},
        {"fits.yaml", write_fits},
        {"brdf.binary", write_table},
        {"preview.png", write_preview},
    };
    enum { RESULTS = sizeof results / sizeof *results };
    cap_stage(j->run, "write", RESULTS);
    enum status status = cap_capture_hash(j->hash, &j->capture, err);
    if (!status) {
#pragma omp parallel for schedule(dynamic, 1) num_threads(j->run->threads)
        for (int i = 0; i < RESULTS; i++) {
            struct error why = {0};
            enum status written = write_one(j, results[i].name, results[i].write, &why);
            if (written) {
#pragma omp critical(job_status)
                status = cap_fail(err, written, "%s", why.text);
            }
            cap_step(j->run);
        }
    }
    if (!status && j->fine.bin)
        status = write_fine(j, err);
    if (!status)
        status = write_predicted(j, err);
    if (!status)
        status = write_one(j, "run.json", write_story, err);
    cap_stage(j->run, "report", 0);
    return status ? status : rec_report(j->out, j->run->threads, err);
}
