/* calibration_schema.h -- calibration.yaml as libcyaml reads it. Internal to calib/. */
#ifndef GONIOCAM_CALIBRATION_SCHEMA_H
#define GONIOCAM_CALIBRATION_SCHEMA_H

#include "calib.h"

#include <cyaml/cyaml.h>

struct shot_node {
    char *name, *camera, *light;
    double rotation[3], translation[3], sigma_rotation[3], sigma_translation[3];
    double power, sigma_power, rms_px, blur_px, glare[GLARE_TERMS], sigma_glare;
    struct seen_tag *tag;
    int tags;
};
struct cue_node {
    enum cue cue;
    double direction[3], sigma_direction, distance, sigma_distance;
};
struct light_node {
    char *name, *frame;
    double *position, *direction, *intensity, *irradiance;  // [3] each, or NULL
    double *beam_axis, beam_falloff[2], sigma_beam[2];
    double radius, sigma_radius, sigma_position[3], sigma_direction[3], sigma_intensity[3],
        sigma_irradiance[3];
    double covariance[16];
    struct cue_node *cue;
    int cues;
};
struct sample_node {
    enum shape shape;
    char *file;
    double rotation[3], translation[3];
    double scale, radius, height, center[3], axis[3], sigma_center[3], sigma_radius, sigma_turn[3],
        outline_rms_px;
    int outline_edges;
};
struct board_tag_node {
    int id, shots;
    double size, center[3], x_axis[3], y_axis[3], sigma_center[3], sigma_turn[3], rms_px;
};
struct board_node {
    char *family;
    struct board_tag_node *tag;
    int tags;
};
struct root_node {
    int goniocam;
    struct camera *camera;
    struct shot_node *shot;
    struct light_node *light;
    struct sample_node *sample, *ball;
    struct board_node *board;
    int cameras, shots, lights, balls;
};

/** Loads a struct root_node *; what it holds is cyaml_free()'s. */
extern const cyaml_schema_value_t cal_calibration_schema;

#endif
