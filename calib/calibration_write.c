/* calibration_write.c -- calibration.yaml, written: the keys of design.md, all numbers so that they
 * read back as the same doubles. What is 0 because it is not known (sigmas of an ideal camera, an
 * outline that was not measured) is left out. */
#include "calib.h"

#include <string.h>

static bool known(const double *value, int count)
{
    for (int i = 0; i < count; i++)
        if (value[i] != 0)
            return true;
    return false;
}

static void numbers_if_known(struct yaml_out *out, const char *key, const double *value, int count)
{
    if (known(value, count))
        cap_yaml_numbers(out, key, value, count);
}

static void number_if_known(struct yaml_out *out, const char *key, double value)
{
    if (value != 0)
        cap_yaml_number(out, key, value);
}

static void write_vec3(struct yaml_out *out, const char *key, vec3 v)
{
    const double value[3] = {v.x, v.y, v.z};
    cap_yaml_numbers(out, key, value, 3);
}

static void write_camera(struct yaml_out *out, const struct camera *c)
{
    cap_yaml_map(out, NULL);
    cap_yaml_text(out, "name", c->name);
    cap_yaml_int(out, "width", c->width);
    cap_yaml_int(out, "height", c->height);
    cap_yaml_numbers(out, "focal", c->focal, 2);
    cap_yaml_numbers(out, "center", c->center, 2);
    cap_yaml_numbers(out, "distortion", c->distortion, 5);
    numbers_if_known(out, "vignetting", c->vignetting, 2);
    numbers_if_known(out, "sigma_focal", c->sigma_focal, 2);
    numbers_if_known(out, "sigma_center", c->sigma_center, 2);
    numbers_if_known(out, "sigma_distortion", c->sigma_distortion, 5);
    number_if_known(out, "rms_px", c->rms_px);
    cap_yaml_close(out);
}

static void write_tag(struct yaml_out *out, const struct seen_tag *tag)
{
    cap_yaml_flow_map(out, NULL);
    cap_yaml_int(out, "id", tag->id);
    cap_yaml_flow_list(out, "corners");
    for (int k = 0; k < 4; k++)
        cap_yaml_numbers(out, NULL, tag->corner[k], 2);
    cap_yaml_close(out);
    cap_yaml_close(out);
}

static void write_view(struct yaml_out *out, const struct calibration *c, const struct view *v)
{
    cap_yaml_map(out, NULL);
    cap_yaml_text(out, "name", v->name);
    cap_yaml_text(out, "camera", c->camera[v->camera].name);
    if (v->light >= 0 && v->light < c->lamps)
        cap_yaml_text(out, "light", c->lamp[v->light].name);
    write_vec3(out, "rotation", v->view_from_world.rotation);
    write_vec3(out, "translation", v->view_from_world.translation);
    numbers_if_known(out, "sigma_rotation", v->sigma_rotation, 3);
    numbers_if_known(out, "sigma_translation", v->sigma_translation, 3);
    cap_yaml_number(out, "power", v->power);
    number_if_known(out, "sigma_power", v->sigma_power);
    number_if_known(out, "rms_px", v->rms_px);
    number_if_known(out, "blur_px", v->blur_px);
    numbers_if_known(out, "glare", v->glare, GLARE_TERMS);
    number_if_known(out, "sigma_glare", v->sigma_glare);
    if (v->tags > 0) {
        cap_yaml_list(out, "tags");
        for (int i = 0; i < v->tags; i++)
            write_tag(out, v->tag + i);
        cap_yaml_close(out);
    }
    cap_yaml_close(out);
}

// What each cue alone says, seen from the sample.
static void write_cues(struct yaml_out *out, const struct lamp *l)
{
    bool any = false;
    for (int k = CUE_BOARD; k < CUES; k++)
        any = any || l->cue[k].sigma > 0;
    if (!any)
        return;
    cap_yaml_list(out, "cues");
    for (int k = CUE_BOARD; k < CUES; k++) {
        const struct lamp_cue *cue = &l->cue[k];
        if (cue->sigma <= 0)
            continue;
        cap_yaml_map(out, NULL);
        cap_yaml_text(out, "cue", cal_cue_name((enum cue)k));
        write_vec3(out, "direction", cue->direction);
        cap_yaml_number(out, "sigma_direction", cue->sigma);
        number_if_known(out, "distance", cue->distance);
        number_if_known(out, "sigma_distance", cue->sigma_distance);
        cap_yaml_close(out);
    }
    cap_yaml_close(out);
}

static void write_lamp(struct yaml_out *out, const struct lamp *l)
{
    cap_yaml_map(out, NULL);
    cap_yaml_text(out, "name", l->name);
    cap_yaml_text(out, "frame", l->on_camera ? "camera" : "world");
    if (l->at_infinity) {
        write_vec3(out, "direction", l->direction);
        numbers_if_known(out, "sigma_direction", l->sigma_direction, 3);
    } else {
        write_vec3(out, "position", l->position);
        numbers_if_known(out, "sigma_position", l->sigma_position, 3);
        number_if_known(out, "radius", l->radius);
        number_if_known(out, "sigma_radius", l->sigma_radius);
    }
    if (l->beam.exponent > 0) {
        const double falloff[2] = {l->beam.exponent, l->beam.cosine};
        const double sigma[2] = {l->beam.sigma_axis, l->beam.sigma_exponent};
        write_vec3(out, "beam_axis", l->beam.axis);
        cap_yaml_numbers(out, "beam_falloff", falloff, 2);
        numbers_if_known(out, "sigma_beam", sigma, 2);
    }
    cap_yaml_numbers(out, l->at_infinity ? "irradiance" : "intensity", l->intensity, 3);
    numbers_if_known(out, l->at_infinity ? "sigma_irradiance" : "sigma_intensity",
                     l->sigma_intensity, 3);
    numbers_if_known(out, "covariance", l->covariance[0], 16);
    write_cues(out, l);
    cap_yaml_close(out);
}

static void write_sample(struct yaml_out *out, const char *name, const struct sample *s)
{
    static const char *const names[] = {[SHAPE_NONE] = "",
                                        [SHAPE_SPHERE] = "sphere",
                                        [SHAPE_CYLINDER] = "cylinder",
                                        [SHAPE_MESH] = "mesh"};
    if (s->shape == SHAPE_NONE)
        return;
    cap_yaml_map(out, name);
    cap_yaml_text(out, "shape", names[s->shape]);
    write_vec3(out, "center", s->center);
    if (s->shape == SHAPE_MESH) {
        cap_yaml_text(out, "file", s->file);
        if (s->scale != 1)
            cap_yaml_number(out, "scale", s->scale);
        write_vec3(out, "rotation", s->world_from_file.rotation);
        write_vec3(out, "translation", s->world_from_file.translation);
    }
    number_if_known(out, "radius", s->radius);
    number_if_known(out, "height", s->height);
    if (s->shape == SHAPE_CYLINDER)
        write_vec3(out, "axis", s->axis);
    numbers_if_known(out, "sigma_center", s->sigma_center, 3);
    number_if_known(out, "sigma_radius", s->sigma_radius);
    numbers_if_known(out, "sigma_turn", s->sigma_turn, 3);
    number_if_known(out, "outline_rms_px", s->outline_rms_px);
    if (s->outline_edges > 0)
        cap_yaml_int(out, "outline_edges", s->outline_edges);
    cap_yaml_close(out);
}

static void write_board(struct yaml_out *out, const struct calibration *c)
{
    if (!c->family)
        return;
    cap_yaml_map(out, "board");
    cap_yaml_text(out, "family", c->family);
    cap_yaml_list(out, "tags");
    for (int i = 0; i < c->tags; i++) {
        const struct board_tag *tag = c->tag + i;
        cap_yaml_flow_map(out, NULL);
        cap_yaml_int(out, "id", tag->place.id);
        cap_yaml_number(out, "size", tag->place.size);
        write_vec3(out, "center", tag->place.center);
        write_vec3(out, "x_axis", tag->place.x_axis);
        write_vec3(out, "y_axis", tag->place.y_axis);
        numbers_if_known(out, "sigma_center", tag->sigma_center, 3);
        numbers_if_known(out, "sigma_turn", tag->sigma_turn, 3);
        cap_yaml_int(out, "shots", tag->views);
        number_if_known(out, "rms_px", tag->rms_px);
        cap_yaml_close(out);
    }
    cap_yaml_close(out);
    cap_yaml_close(out);
}

// Views in the order of their names, as people look for them.
static const struct view *next_by_name(const struct calibration *c, const struct view *last)
{
    const struct view *next = NULL;
    for (int i = 0; i < c->views; i++) {
        const struct view *v = &c->view[i];
        if ((!last || strcmp(v->name, last->name) > 0)
            && (!next || strcmp(v->name, next->name) < 0))
            next = v;
    }
    return next;
}

enum status cal_calibration_write(const struct calibration *c, const char *path, struct error *err)
{
    struct yaml_out *out = NULL;
    enum status status = cap_yaml_begin(&out, path, err);
    if (status)
        return status;
    cap_yaml_int(out, "goniocam", 1);  // version of this format
    cap_yaml_list(out, "cameras");
    for (int i = 0; i < c->cameras; i++)
        write_camera(out, c->camera + i);
    cap_yaml_close(out);
    cap_yaml_list(out, "shots");
    for (const struct view *v = next_by_name(c, NULL); v; v = next_by_name(c, v))
        write_view(out, c, v);
    cap_yaml_close(out);
    cap_yaml_list(out, "lights");
    for (int i = 0; i < c->lamps; i++)
        write_lamp(out, c->lamp + i);
    cap_yaml_close(out);
    write_sample(out, "sample", &c->sample);
    if (c->balls)
        cap_yaml_list(out, "balls");
    for (int i = 0; i < c->balls; i++)
        write_sample(out, NULL, &c->ball[i]);
    if (c->balls)
        cap_yaml_close(out);
    write_board(out, c);
    return cap_yaml_end(out, true, err);
}
