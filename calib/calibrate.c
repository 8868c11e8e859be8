/* calibrate.c -- the order of calibration: geometry, sample, lamps, pictures. */
#include "geometry.h"
#include "lamp.h"
#include "overlay.h"
#include "solid_place.h"
#include "sphere.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

static enum status nominal_mesh(struct sample *sample, const struct sample_place *nominal,
                                struct error *err)
{
    struct sample s = {.shape = SHAPE_MESH,
                       .file = realpath(nominal->file, NULL),
                       .world_from_file = {nominal->rotation, nominal->translation}};
    if (!s.file)
        return cap_fail(err, STATUS_IO, "%s: %s", nominal->file, strerror(errno));
    enum status status = cal_sample_load(&s, err);
    if (status)
        free(s.file);
    else
        *sample = s;
    return status;
}

/** The sample by its outline, from where capture.yaml says that it is. */
static enum status place_sample(struct calibration *c, const struct capture *capture,
                                const char *out, struct run *run, struct error *err)
{
    const struct sample_place *nominal = &capture->sample;
    if (nominal->shape == SHAPE_NONE)
        return cap_fail(err, STATUS_DATA, "%s: no `sample` in capture.yaml", capture->folder);
    if (nominal->shape == SHAPE_SPHERE)
        return cal_sphere_place(c, capture, out, run, err);
    enum status status = STATUS_OK;
    if (nominal->shape == SHAPE_MESH)
        status = nominal_mesh(&c->sample, nominal, err);
    else
        c->sample = (struct sample){.shape = nominal->shape,
                                    .center = nominal->center,
                                    .radius = nominal->radius,
                                    .height = nominal->height,
                                    .axis = vec3_normalize(nominal->axis)};
    return status ? status : cal_solid_place(c, out, run, err);
}

enum status cal_calibrate(struct calibration *calibration, const struct capture *capture,
                          const char *out, const bool *usable, struct run *run, struct error *err)
{
    struct calibration c = {0};
    enum status status = cal_geometry(&c, capture, out, usable, run, err);
    if (!status) {
        cap_stage(run, "sample", c.views);
        status = place_sample(&c, capture, out, run, err);
    }
    if (!status) {
        cap_stage(run, "lamps", c.views);
        status = cal_lamps_find(&c, capture, out, run, err);
    }
    if (!status) {
        cap_stage(run, "overlays", c.views);
        status = cal_overlay(&c, capture, out, run, err);
    }
    cap_stage(run, "", 0);
    if (status)
        cal_calibration_free(&c);
    else
        *calibration = c;
    return status;
}
