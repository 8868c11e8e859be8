/* lens_capture.c -- cameras from a capture of their own: photographs of a board, taken before. */
#include "lens_capture.h"

#include <stdlib.h>
#include <unistd.h>

static bool holds(const char *folder, const char *name)
{
    char *path = cap_path(folder, name);
    bool there = path && access(path, R_OK) == 0;
    free(path);
    return there;
}

bool lens_capture_is(const char *folder)
{
    return holds(folder, "capture.yaml") && !holds(folder, "calibration.yaml");
}

// A chain of captures might lead back to its first.
static enum status check_no_chain(const struct capture *capture, struct error *err)
{
    for (int i = 0; i < capture->givens; i++)
        if (capture->given[i].file && lens_capture_is(capture->given[i].file))
            return cap_fail(err, STATUS_FORMAT,
                            "%s: a capture that gives intrinsics names another one, %s: name that "
                            "one alone",
                            capture->folder, capture->given[i].file);
    return STATUS_OK;
}

enum status lens_capture_calibrate(struct calibration *c, const char *folder, const char *out,
                                   struct run *run, struct error *err)
{
    struct capture capture = {0};
    bool *usable = NULL;
    char *lens = cap_path(out, "lens");
    enum status status =
        lens ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "no memory for %s", folder);
    if (!status)
        status = cap_capture_read(&capture, folder, run, err);
    if (!status)
        status = check_no_chain(&capture, err);
    if (!status)
        status = cap_make_folder(lens, err);
    if (!status && !(usable = calloc((size_t)capture.shots + 1, sizeof *usable)))
        status = cap_fail(err, STATUS_MEMORY, "%d shots", capture.shots);
    if (!status)
        status = cap_capture_settle(&capture, run, err);
    if (!status)
        status = cap_merge(&capture, lens, NULL, usable, run, err);
    if (!status)
        status = cal_geometry(c, &capture, lens, usable, run, err);
    if (status)
        cap_fail_within(err, "intrinsics from %s", folder);
    free(usable);
    free(lens);
    cap_capture_free(&capture);
    return status;
}
