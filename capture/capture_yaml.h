/* capture_yaml.h -- capture.yaml as it is written, before anything is looked up or checked. */
#ifndef GONIOCAM_CAPTURE_YAML_H
#define GONIOCAM_CAPTURE_YAML_H

#include "yaml_source.h"

struct yaml_tag {
    int id;
    double size, center[3], x_axis[3], y_axis[3];
};
struct yaml_board {
    char *family;
    struct yaml_tag *tag;
    unsigned tags;
    double tag_size, place_sigma;
};
struct yaml_camera {
    char **photo;
    unsigned photos;
    char *intrinsics, *use;
};
struct yaml_sample {
    char *shape, *file;
    double radius, radius_sigma, height, center[3], axis[3], scale, pose[6];
};
struct yaml_patch {
    char *capture;
    double albedo, corner[4][3];
};
/** Selections are globs on the file name. */
struct yaml_photos {
    char **pattern;
    unsigned patterns;
};
struct yaml_light {
    char *name, *frame;
    char **photo;
    unsigned photos;
    double position[3], radius;
};
struct yaml_shot {
    char *name;
    char **photo;
    unsigned photos;
};
struct yaml_override {
    char **photo;
    unsigned photos;
    char *exposure_time;  // "0.033" or "1/30"
    double aperture, iso, focal_length;
};
struct yaml_occluder {
    char *shape, *file;
    double radius, height, center[3], axis[3], size[3], rotation[3], pose[6];
};
struct yaml_ball {
    double radius, radius_sigma, center[3];
};
struct yaml_noise {
    double black, white, gain, read_noise;
};

/** What is optional and absent is NULL or 0; of numbers, the source tells whether they stand
 *  there. Owns all; {0} is empty; release with capture_yaml_free(). */
struct capture_yaml {
    struct yaml_source source;
    struct capture_yaml_root {
        int goniocam;
        struct yaml_board *board;
        struct yaml_sample *sample;
        struct yaml_patch *patch;
        struct yaml_photos *photos;
        struct yaml_light *light;
        struct yaml_shot *shot;
        struct yaml_camera *camera;
        struct yaml_override *override;
        struct yaml_noise *noise;
        struct yaml_occluder *occluder;
        struct yaml_ball *ball;
        char *response;
        char **dark, **flat, **ambient;
        unsigned patches, lights, shots, overrides, darks, flats, ambients, occluders, balls,
            cameras;
    } * root;
};

/** STATUS_IO; STATUS_FORMAT with file, line and key. */
enum status capture_yaml_read(struct capture_yaml *yaml, const char *file, struct error *err);
void capture_yaml_free(struct capture_yaml *yaml);
/** Does a file name match one of the globs? */
bool capture_yaml_matches(char *const *glob, unsigned globs, const char *name);

/** Check what the values mean, and put board, sample, patches, lights, response and noise into
 *  *capture. STATUS_FORMAT with file, line and key. */
enum status capture_check(struct capture *capture, const struct capture_yaml *yaml,
                          struct error *err);
/** Its parts of that: board and cameras (board_check.c). */
enum status capture_check_board(struct capture *capture, const struct capture_yaml *yaml,
                                struct error *err);
enum status capture_check_cameras(struct capture *capture, const struct capture_yaml *yaml,
                                  struct error *err);
/** The node `path` as a unit vector; where it is absent, fallback. A ruler and a pocket calculator
 *  give axes to three digits. */
#define CAPTURE_AXIS_TOLERANCE 1e-3
enum status capture_check_axis(vec3 *axis, const struct capture_yaml *yaml, const char *path,
                               const double given[3], vec3 fallback, struct error *err);
/** Its part of that: patches, or a capture for their place (reference_check.c). */
enum status capture_check_reference(struct capture *capture, const struct capture_yaml *yaml,
                                    struct error *err);
/** Its part of that: balls that show the lamps (balls_check.c). */
enum status capture_check_balls(struct capture *capture, const struct capture_yaml *yaml,
                                struct error *err);
/** How well a radius is known where nothing is said, relative: a caliper gives it to that. */
#define CAPTURE_CALIPER 0.005
/** Its part of that: what stands in the way (occluders.c). */
enum status capture_check_occluders(struct capture *capture, const struct capture_yaml *yaml,
                                    struct error *err);

#endif
