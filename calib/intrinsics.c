/* intrinsics.c -- what is known of cameras before they are calibrated: a file of intrinsics, held,
 * or taken as so many more measurements. */
#include "intrinsics.h"

#include "interchange.h"
#include "lens_capture.h"

#include <string.h>

struct lens_prior intrinsics_unknown(void)
{
    struct lens_prior prior;
    for (int k = 0; k < LENS_PARAMETERS; k++) {
        prior.value[k] = 0;
        prior.sigma[k] = INFINITY;
    }
    prior.sigma_square = 0;
    return prior;
}

void intrinsics_assume_usual(struct lens_prior *prior, const struct camera *camera)
{
    // Deviations: of the centre in parts of the image's longer side, of p1 and p2, of square
    // pixels.
    static const double center_off = 0.01, decentering = 5e-4, not_square = 3e-4;
    const int size[2] = {camera->width, camera->height};
    for (int k = 2; k < 8; k++) {
        if (isfinite(prior->sigma[k]) || k == 4 || k == 5)
            continue;  // told; or radial, which lenses have much of
        prior->value[k] = k < 4 ? (size[k - 2] - 1) / 2.0 : 0;
        prior->sigma[k] = k < 4 ? center_off * fmax(size[0], size[1]) : decentering;
    }
    if (!isfinite(prior->sigma[0]))
        prior->sigma_square = not_square;
}

const struct camera *intrinsics_match(const struct calibration *c, const struct camera *like)
{
    const struct camera *match = NULL;
    for (int i = 0; i < c->cameras; i++) {
        const struct camera *m = c->camera + i;
        bool size = m->width == like->width && m->height == like->height;
        bool named = m->name && like->name && strcmp(m->name, like->name) == 0;
        if (size && (!match || named))
            match = m;
    }
    return match;
}

// Deviations for a file that tells none: focus breathes, and lenses are put on again. The centre in
// parts of the diagonal; of the distortion, what such files differ by among each other.
static const double focal_part = 0.005, center_part = 0.005, distortion_off = 0.02;

static void set_sigma(struct lens_prior *prior, const struct camera *m)
{
    const double diagonal = hypot(m->width, m->height);
    double told[LENS_PARAMETERS];
    memcpy(told, m->sigma_focal, sizeof m->sigma_focal);
    memcpy(told + 2, m->sigma_center, sizeof m->sigma_center);
    memcpy(told + 4, m->sigma_distortion, sizeof m->sigma_distortion);
    bool any = told[0] > 0;
    for (int k = 0; k < LENS_PARAMETERS; k++) {
        double own = k < 2   ? focal_part * m->focal[k]
                     : k < 4 ? center_part * diagonal
                             : distortion_off;
        // A term that its calibration dropped has no deviation there, and stays where it is.
        prior->sigma[k] = any ? told[k] : own;
    }
}

enum status intrinsics_prior(struct lens_prior *prior, struct camera *camera,
                             const struct capture *capture, int kind, const char *out,
                             struct run *run, struct error *err)
{
    int index = capture->camera[kind].given;
    *prior = intrinsics_unknown();
    if (index < 0 || index >= capture->givens || !capture->given[index].file)
        return STATUS_OK;
    const struct camera_given *given = capture->given + index;
    struct calibration c = {0};
    enum status status = lens_capture_is(given->file)
                             ? lens_capture_calibrate(&c, given->file, out, run, err)
                             : cal_calibration_import(&c, given->file, err);
    const struct camera *match = status ? NULL : intrinsics_match(&c, camera);
    if (!status && !match)
        status = cap_fail(err, STATUS_DATA,
                          "%s: holds no camera of %d x %d pixels, which the photographs have",
                          given->file, camera->width, camera->height);
    if (match) {
        memcpy(camera->focal, match->focal, sizeof camera->focal);
        memcpy(camera->center, match->center, sizeof camera->center);
        memcpy(camera->distortion, match->distortion, sizeof camera->distortion);
        lens_to_array(prior->value, camera);
        if (given->prior)
            set_sigma(prior, match);
        else
            memset(prior->sigma, 0, sizeof prior->sigma);
    }
    cal_calibration_free(&c);
    return status;
}
