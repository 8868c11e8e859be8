/* capture_yaml.c -- the keys of capture.yaml, as a schema for libcyaml. */
#include "capture_yaml.h"

#include <cyaml/cyaml.h>
#include <fnmatch.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

enum { NEED = CYAML_FLAG_DEFAULT, MAY = CYAML_FLAG_OPTIONAL };

static const cyaml_schema_value_t number = {CYAML_VALUE_FLOAT(CYAML_FLAG_STRICT, double)};
static const cyaml_schema_value_t point = {
    CYAML_VALUE_SEQUENCE_FIXED(CYAML_FLAG_DEFAULT, double, &number, 3)};
static const cyaml_schema_value_t text = {
    CYAML_VALUE_STRING(CYAML_FLAG_POINTER, char, 1, CYAML_UNLIMITED)};

// clang-format off: a table of keys reads best as one
#define NUMBER(key, flags, type, member)                                                           \
    CYAML_FIELD_FLOAT(key, (flags) | CYAML_FLAG_STRICT, struct type, member)
#define POINT(key, flags, type, member)                                                            \
    CYAML_FIELD_SEQUENCE_FIXED(key, flags, struct type, member, &number, 3)
#define TEXT(key, flags, type, member)                                                             \
    CYAML_FIELD_STRING_PTR(key, (flags) | CYAML_FLAG_POINTER, struct type, member, 1,              \
                           CYAML_UNLIMITED)
#define LIST(key, flags, type, member, count, entry)                                               \
    CYAML_FIELD_SEQUENCE_COUNT(key, (flags) | CYAML_FLAG_POINTER, struct type, member, count,      \
                               entry, 1, CYAML_UNLIMITED)
#define MAP(key, flags, type, member, fields)                                                      \
    CYAML_FIELD_MAPPING_PTR(key, (flags) | CYAML_FLAG_POINTER, struct type, member, fields)

static const cyaml_schema_field_t tag_fields[] = {
    CYAML_FIELD_INT("id", NEED, struct yaml_tag, id), NUMBER("size", MAY, yaml_tag, size),
    POINT("center", MAY, yaml_tag, center),           POINT("x_axis", MAY, yaml_tag, x_axis),
    POINT("y_axis", MAY, yaml_tag, y_axis),           CYAML_FIELD_END};
static const cyaml_schema_value_t tag = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct yaml_tag, tag_fields)};

static const cyaml_schema_field_t board_fields[] = {
    TEXT("family", NEED, yaml_board, family), LIST("tags", MAY, yaml_board, tag, tags, &tag),
    NUMBER("tag_size", MAY, yaml_board, tag_size),
    NUMBER("place_sigma", MAY, yaml_board, place_sigma), CYAML_FIELD_END};

static const cyaml_schema_field_t camera_fields[] = {
    LIST("photos", MAY, yaml_camera, photo, photos, &text),
    TEXT("intrinsics", MAY, yaml_camera, intrinsics), TEXT("use", MAY, yaml_camera, use),
    CYAML_FIELD_END};
static const cyaml_schema_value_t camera = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct yaml_camera, camera_fields)};

static const cyaml_schema_field_t sample_fields[] = {
    TEXT("shape", NEED, yaml_sample, shape),
    NUMBER("radius", MAY, yaml_sample, radius),
    NUMBER("radius_sigma", MAY, yaml_sample, radius_sigma),
    NUMBER("height", MAY, yaml_sample, height),
    POINT("center", MAY, yaml_sample, center),
    POINT("axis", MAY, yaml_sample, axis),
    TEXT("file", MAY, yaml_sample, file),
    NUMBER("scale", MAY, yaml_sample, scale),
    CYAML_FIELD_SEQUENCE_FIXED("pose", MAY, struct yaml_sample, pose, &number, 6),
    CYAML_FIELD_END};

static const cyaml_schema_field_t patch_fields[] = {
    NUMBER("albedo", MAY, yaml_patch, albedo),
    CYAML_FIELD_SEQUENCE_FIXED("corners", MAY, struct yaml_patch, corner, &point, 4),
    TEXT("capture", MAY, yaml_patch, capture), CYAML_FIELD_END};
static const cyaml_schema_value_t patch = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct yaml_patch, patch_fields)};

static const cyaml_schema_field_t photos_fields[] = {
    LIST("pattern", NEED, yaml_photos, pattern, patterns, &text), CYAML_FIELD_END};

static const cyaml_schema_field_t light_fields[] = {
    TEXT("name", NEED, yaml_light, name),
    LIST("photos", NEED, yaml_light, photo, photos, &text),
    TEXT("frame", MAY, yaml_light, frame),
    POINT("position", MAY, yaml_light, position),
    NUMBER("radius", MAY, yaml_light, radius),
    CYAML_FIELD_END};
static const cyaml_schema_value_t light = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct yaml_light, light_fields)};

static const cyaml_schema_field_t shot_fields[] = {
    TEXT("name", NEED, yaml_shot, name), LIST("photos", NEED, yaml_shot, photo, photos, &text),
    CYAML_FIELD_END};
static const cyaml_schema_value_t shot = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct yaml_shot, shot_fields)};

static const cyaml_schema_field_t override_fields[] = {
    LIST("photos", NEED, yaml_override, photo, photos, &text),
    TEXT("exposure_time", MAY, yaml_override, exposure_time),
    NUMBER("aperture", MAY, yaml_override, aperture),
    NUMBER("iso", MAY, yaml_override, iso),
    NUMBER("focal_length", MAY, yaml_override, focal_length),
    CYAML_FIELD_END};
static const cyaml_schema_value_t override = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct yaml_override, override_fields)};

static const cyaml_schema_field_t noise_fields[] = {
    NUMBER("black", MAY, yaml_noise, black), NUMBER("white", MAY, yaml_noise, white),
    NUMBER("gain", MAY, yaml_noise, gain), NUMBER("read_noise", MAY, yaml_noise, read_noise),
    CYAML_FIELD_END};

static const cyaml_schema_field_t occluder_fields[] = {
    TEXT("shape", NEED, yaml_occluder, shape),
    NUMBER("radius", MAY, yaml_occluder, radius),
    NUMBER("height", MAY, yaml_occluder, height),
    POINT("center", MAY, yaml_occluder, center),
    POINT("axis", MAY, yaml_occluder, axis),
    POINT("size", MAY, yaml_occluder, size),
    POINT("rotation", MAY, yaml_occluder, rotation),
    TEXT("file", MAY, yaml_occluder, file),
    CYAML_FIELD_SEQUENCE_FIXED("pose", MAY, struct yaml_occluder, pose, &number, 6),
    CYAML_FIELD_END};
static const cyaml_schema_value_t occluder = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct yaml_occluder, occluder_fields)};

static const cyaml_schema_field_t ball_fields[] = {
    NUMBER("radius", NEED, yaml_ball, radius), NUMBER("radius_sigma", MAY, yaml_ball, radius_sigma),
    POINT("center", NEED, yaml_ball, center), CYAML_FIELD_END};
static const cyaml_schema_value_t ball = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct yaml_ball, ball_fields)};

static const cyaml_schema_field_t root_fields[] = {
    CYAML_FIELD_INT("goniocam", NEED, struct capture_yaml_root, goniocam),
    LIST("camera", MAY, capture_yaml_root, camera, cameras, &camera),
    MAP("board", MAY, capture_yaml_root, board, board_fields),
    MAP("sample", MAY, capture_yaml_root, sample, sample_fields),
    LIST("reference", MAY, capture_yaml_root, patch, patches, &patch),
    MAP("photos", MAY, capture_yaml_root, photos, photos_fields),
    LIST("lights", MAY, capture_yaml_root, light, lights, &light),
    LIST("shots", MAY, capture_yaml_root, shot, shots, &shot),
    LIST("overrides", MAY, capture_yaml_root, override, overrides, &override),
    MAP("noise", MAY, capture_yaml_root, noise, noise_fields),
    TEXT("response", MAY, capture_yaml_root, response),
    LIST("dark", MAY, capture_yaml_root, dark, darks, &text),
    LIST("flat", MAY, capture_yaml_root, flat, flats, &text),
    LIST("ambient", MAY, capture_yaml_root, ambient, ambients, &text),
    LIST("occluders", MAY, capture_yaml_root, occluder, occluders, &occluder),
    LIST("balls", MAY, capture_yaml_root, ball, balls, &ball),
    CYAML_FIELD_END};
// clang-format on
static const cyaml_schema_value_t root = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_POINTER, struct capture_yaml_root, root_fields)};

static const struct yaml_rules rules = {
    .lists = (const char *const[]){"reference", "camera", "camera[].photos", "photos.pattern",
                                   "lights[].photos", "shots[].photos", "overrides[].photos",
                                   "dark", "flat", "ambient", "occluders", "balls", NULL},
    .texts = (const char *const[]){"board.family",
                                   "camera[].photos",
                                   "camera[].intrinsics",
                                   "camera[].use",
                                   "sample.shape",
                                   "sample.file",
                                   "reference[].capture",
                                   "photos.pattern",
                                   "lights[].name",
                                   "lights[].photos",
                                   "lights[].frame",
                                   "shots[].name",
                                   "shots[].photos",
                                   "overrides[].photos",
                                   "overrides[].exposure_time",
                                   "response",
                                   "dark",
                                   "flat",
                                   "ambient",
                                   "occluders[].shape",
                                   "occluders[].file",
                                   NULL},
    .whole = (const char *const[]){"goniocam", "board.tags[].id", NULL},
};

/* libcyaml tells first what is wrong, then where: from the innermost node outwards,
 *     Load: Unexpected key: sise
 *     Load: Backtrace:
 *       in mapping (line: 4, column: 8)
 *       in sequence entry '2' (line: 4, column: 3)
 *       in mapping field 'tags' (line: 3, column: 1)                                          */
struct complaint {
    char what[300], where[200];
    unsigned line;
    bool of_child;  // it is about a key in the node that the backtrace begins with
};

static void keep_complaint(cyaml_log_t level, void *context, const char *format, va_list args)
{
    (void)level;
    struct complaint *c = context;
    char message[300], key[100], outer[sizeof c->where];
    vsnprintf(message, sizeof message, format, args);
    message[strcspn(message, "\n")] = '\0';
    const char *place = strstr(message, "(line: ");
    unsigned line = place ? (unsigned)strtoul(place + 7, NULL, 10) : 0;
    if (!place) {
        const char *what = strncmp(message, "Load: ", 6) == 0 ? message + 6 : message;
        if (!*c->what)
            snprintf(c->what, sizeof c->what, "%s", what);
        c->of_child = strncmp(c->what, "Missing", 7) == 0 || strncmp(c->what, "Unexp", 5) == 0;
        return;
    }
    bool innermost = c->line == 0;
    if (innermost)
        c->line = line;
    if (innermost && c->of_child)
        return;
    unsigned item;
    snprintf(outer, sizeof outer, "%s", c->where);
    if (sscanf(message, " in mapping field '%99[^']'", key) == 1)
        snprintf(c->where, sizeof c->where, "%.99s%s%.90s", key, *outer && *outer != '[' ? "." : "",
                 outer);
    else if (sscanf(message, " in sequence entry '%u'", &item) == 1)
        snprintf(c->where, sizeof c->where, "[%u]%s%.90s", item - (item > 0),
                 *outer && *outer != '[' ? "." : "", outer);
}

static cyaml_config_t configuration(struct complaint *complaint)
{
    return (cyaml_config_t){.log_level = CYAML_LOG_ERROR,
                            .log_fn = keep_complaint,
                            .log_ctx = complaint,
                            .mem_fn = cyaml_mem};
}

/* An unknown key stands where the source says; libcyaml points at the one before it. */
static unsigned line_of(const struct complaint *c, const struct yaml_source *source)
{
    static const char unexpected[] = "Unexpected key: ";
    char path[320];
    if (strncmp(c->what, unexpected, strlen(unexpected)) != 0)
        return c->line ? c->line : 1;
    snprintf(path, sizeof path, "%.150s%s%.150s", c->where, *c->where ? "." : "",
             c->what + strlen(unexpected));
    int line = yaml_source_line(source, path);
    return line ? (unsigned)line : c->line;
}

enum status capture_yaml_read(struct capture_yaml *yaml, const char *file, struct error *err)
{
    struct capture_yaml made = {0};
    enum status status = yaml_source_read(&made.source, file, &rules, err);
    if (status)
        return status;
    struct complaint c = {0};
    cyaml_config_t config = configuration(&c);
    cyaml_err_t result = cyaml_load_data((const uint8_t *)made.source.text, made.source.size,
                                         &config, &root, (cyaml_data_t **)&made.root, NULL);
    bool odd = made.source.odd.status && result != CYAML_ERR_INVALID_KEY;
    if (result == CYAML_OK && made.root && !odd) {
        *yaml = made;
        return STATUS_OK;
    }
    if (odd)
        status = cap_fail(err, made.source.odd.status, "%s", made.source.odd.text);
    else if (result == CYAML_OK)
        status = cap_fail(err, STATUS_FORMAT, "%s: is empty", file);
    else
        status =
            cap_fail(err, STATUS_FORMAT, "%s: line %u: %s%s%s", file, line_of(&c, &made.source),
                     c.where, *c.where ? ": " : "", *c.what ? c.what : cyaml_strerror(result));
    capture_yaml_free(&made);
    return status;
}

void capture_yaml_free(struct capture_yaml *yaml)
{
    struct complaint ignored = {0};
    cyaml_config_t config = configuration(&ignored);
    if (yaml->root)
        cyaml_free(&config, &root, yaml->root, 0);
    yaml_source_free(&yaml->source);
    *yaml = (struct capture_yaml){0};
}

bool capture_yaml_matches(char *const *glob, unsigned globs, const char *name)
{
    for (unsigned i = 0; i < globs; i++)
        if (fnmatch(glob[i], name, 0) == 0)
            return true;
    return false;
}
