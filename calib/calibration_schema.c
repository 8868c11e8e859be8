/* calibration_schema.c -- the keys of calibration.yaml. */
#include "calibration_schema.h"

enum { NEED = CYAML_FLAG_DEFAULT, MAY = CYAML_FLAG_OPTIONAL };

// clang-format off: a table of keys reads best with one key a line
#define NUMBER(flags, type, key) CYAML_FIELD_FLOAT(#key, flags, struct type, key)
#define NUMBERS(flags, type, key, count)                                                           \
    CYAML_FIELD_SEQUENCE_FIXED(#key, flags, struct type, key, &number, count)
#define VECTOR(type, key)                                                                          \
    CYAML_FIELD_SEQUENCE_FIXED(#key, CYAML_FLAG_OPTIONAL | CYAML_FLAG_POINTER, struct type, key,   \
                               &number, 3)
#define TEXT(flags, type, key)                                                                     \
    CYAML_FIELD_STRING_PTR(#key, (flags) | CYAML_FLAG_POINTER, struct type, key, 1, CYAML_UNLIMITED)
#define LIST(key, flags, type, member, entry)                                                      \
    CYAML_FIELD_SEQUENCE_COUNT(key, (flags) | CYAML_FLAG_POINTER, struct type, member, member##s,  \
                               entry, 0, CYAML_UNLIMITED)

static const cyaml_schema_value_t number = {CYAML_VALUE_FLOAT(CYAML_FLAG_DEFAULT, double)};
static const cyaml_schema_value_t corner = {
    CYAML_VALUE_SEQUENCE_FIXED(CYAML_FLAG_DEFAULT, double, &number, 2)};

static const cyaml_schema_field_t camera_fields[] = {
    TEXT(NEED, camera, name),
    CYAML_FIELD_INT("width", NEED, struct camera, width),
    CYAML_FIELD_INT("height", NEED, struct camera, height),
    NUMBERS(NEED, camera, focal, 2),
    NUMBERS(NEED, camera, center, 2),
    NUMBERS(MAY, camera, distortion, 5),
    NUMBERS(MAY, camera, vignetting, 2),
    NUMBERS(MAY, camera, sigma_focal, 2),
    NUMBERS(MAY, camera, sigma_center, 2),
    NUMBERS(MAY, camera, sigma_distortion, 5),
    NUMBER(MAY, camera, rms_px),
    CYAML_FIELD_END};
static const cyaml_schema_field_t tag_fields[] = {
    CYAML_FIELD_INT("id", NEED, struct seen_tag, id),
    CYAML_FIELD_SEQUENCE_FIXED("corners", NEED, struct seen_tag, corner, &corner, 4),
    CYAML_FIELD_END};
static const cyaml_schema_value_t tag_value = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct seen_tag, tag_fields)};
static const cyaml_schema_field_t shot_fields[] = {TEXT(NEED, shot_node, name),
                                                   TEXT(NEED, shot_node, camera),
                                                   TEXT(MAY, shot_node, light),
                                                   NUMBERS(NEED, shot_node, rotation, 3),
                                                   NUMBERS(NEED, shot_node, translation, 3),
                                                   NUMBERS(MAY, shot_node, sigma_rotation, 3),
                                                   NUMBERS(MAY, shot_node, sigma_translation, 3),
                                                   NUMBER(MAY, shot_node, power),
                                                   NUMBER(MAY, shot_node, sigma_power),
                                                   NUMBER(MAY, shot_node, rms_px),
                                                   NUMBER(MAY, shot_node, blur_px),
                                                   NUMBERS(MAY, shot_node, glare, GLARE_TERMS),
                                                   NUMBER(MAY, shot_node, sigma_glare),
                                                   LIST("tags", MAY, shot_node, tag, &tag_value),
                                                   CYAML_FIELD_END};
static const cyaml_strval_t cue_names[] = {{"board", CUE_BOARD},
                                           {"sample", CUE_SAMPLE},
                                           {"highlight", CUE_HIGHLIGHT},
                                           {"shadow", CUE_SHADOW},
                                           {"ball", CUE_BALL}};
static const cyaml_schema_field_t cue_fields[] = {CYAML_FIELD_ENUM("cue", CYAML_FLAG_STRICT,
                                                                   struct cue_node, cue, cue_names,
                                                                   CYAML_ARRAY_LEN(cue_names)),
                                                  NUMBERS(NEED, cue_node, direction, 3),
                                                  NUMBER(NEED, cue_node, sigma_direction),
                                                  NUMBER(MAY, cue_node, distance),
                                                  NUMBER(MAY, cue_node, sigma_distance),
                                                  CYAML_FIELD_END};
static const cyaml_schema_value_t cue_value = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct cue_node, cue_fields)};
static const cyaml_schema_field_t light_fields[] = {TEXT(NEED, light_node, name),
                                                    TEXT(MAY, light_node, frame),
                                                    VECTOR(light_node, position),
                                                    VECTOR(light_node, direction),
                                                    VECTOR(light_node, intensity),
                                                    VECTOR(light_node, irradiance),
                                                    NUMBER(MAY, light_node, radius),
                                                    NUMBER(MAY, light_node, sigma_radius),
                                                    VECTOR(light_node, beam_axis),
                                                    NUMBERS(MAY, light_node, beam_falloff, 2),
                                                    NUMBERS(MAY, light_node, sigma_beam, 2),
                                                    NUMBERS(MAY, light_node, sigma_position, 3),
                                                    NUMBERS(MAY, light_node, sigma_direction, 3),
                                                    NUMBERS(MAY, light_node, sigma_intensity, 3),
                                                    NUMBERS(MAY, light_node, covariance, 16),
                                                    NUMBERS(MAY, light_node, sigma_irradiance, 3),
                                                    LIST("cues", MAY, light_node, cue, &cue_value),
                                                    CYAML_FIELD_END};
static const cyaml_strval_t shapes[] = {
    {"sphere", SHAPE_SPHERE}, {"cylinder", SHAPE_CYLINDER}, {"mesh", SHAPE_MESH}};
static const cyaml_schema_field_t sample_fields[] = {
    CYAML_FIELD_ENUM("shape", CYAML_FLAG_STRICT, struct sample_node, shape, shapes,
                     CYAML_ARRAY_LEN(shapes)),
    NUMBERS(NEED, sample_node, center, 3),
    NUMBER(MAY, sample_node, radius),
    NUMBER(MAY, sample_node, height),
    NUMBERS(MAY, sample_node, axis, 3),
    TEXT(MAY, sample_node, file),
    NUMBER(MAY, sample_node, scale),
    NUMBERS(MAY, sample_node, rotation, 3),
    NUMBERS(MAY, sample_node, translation, 3),
    NUMBERS(MAY, sample_node, sigma_center, 3),
    NUMBER(MAY, sample_node, sigma_radius),
    NUMBERS(MAY, sample_node, sigma_turn, 3),
    NUMBER(MAY, sample_node, outline_rms_px),
    CYAML_FIELD_INT("outline_edges", MAY, struct sample_node, outline_edges),
    CYAML_FIELD_END};
static const cyaml_schema_field_t board_tag_fields[] = {
    CYAML_FIELD_INT("id", NEED, struct board_tag_node, id),
    NUMBER(NEED, board_tag_node, size),
    NUMBERS(NEED, board_tag_node, center, 3),
    NUMBERS(NEED, board_tag_node, x_axis, 3),
    NUMBERS(NEED, board_tag_node, y_axis, 3),
    NUMBERS(MAY, board_tag_node, sigma_center, 3),
    NUMBERS(MAY, board_tag_node, sigma_turn, 3),
    CYAML_FIELD_INT("shots", MAY, struct board_tag_node, shots),
    NUMBER(MAY, board_tag_node, rms_px),
    CYAML_FIELD_END};
static const cyaml_schema_value_t board_tag_value = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct board_tag_node, board_tag_fields)};
static const cyaml_schema_field_t board_fields[] = {
    TEXT(NEED, board_node, family), LIST("tags", NEED, board_node, tag, &board_tag_value),
    CYAML_FIELD_END};
static const cyaml_schema_value_t camera_value = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct camera, camera_fields)};
static const cyaml_schema_value_t shot_value = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct shot_node, shot_fields)};
static const cyaml_schema_value_t light_value = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct light_node, light_fields)};
static const cyaml_schema_value_t ball_value = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct sample_node, sample_fields)};
static const cyaml_schema_field_t root_fields[] = {
    CYAML_FIELD_INT("goniocam", MAY, struct root_node, goniocam),
    LIST("cameras", NEED, root_node, camera, &camera_value),
    LIST("shots", NEED, root_node, shot, &shot_value),
    LIST("lights", NEED, root_node, light, &light_value),
    CYAML_FIELD_MAPPING_PTR("sample", CYAML_FLAG_OPTIONAL | CYAML_FLAG_POINTER, struct root_node,
                            sample, sample_fields),
    LIST("balls", MAY, root_node, ball, &ball_value),
    CYAML_FIELD_MAPPING_PTR("board", CYAML_FLAG_OPTIONAL | CYAML_FLAG_POINTER, struct root_node,
                            board, board_fields),
    CYAML_FIELD_END};
const cyaml_schema_value_t cal_calibration_schema = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_POINTER, struct root_node, root_fields)};
// clang-format on
