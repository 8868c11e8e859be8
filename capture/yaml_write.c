/* yaml_write.c -- YAML documents through libyaml's emitter.
 *
 * Numbers are written with the fewest digits that read back as the same double. The first failure
 * (no memory, no room on the disk) is kept, and told when the document ends.
 */
#include "capture.h"

#include <assert.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <yaml.h>

enum { DEPTH_MAX = 32 };
struct yaml_out {
    yaml_emitter_t emitter;
    struct atomic_file file;
    bool is_map[DEPTH_MAX];
    int depth;
    bool failed;
    int reason;  // errno of the first failed write
};

static int write_stream(void *data, unsigned char *buffer, size_t size)
{
    struct yaml_out *out = data;
    errno = 0;
    if (fwrite(buffer, 1, size, out->file.stream) == size)
        return 1;
    if (!out->reason)
        out->reason = errno;
    return 0;
}

/* libyaml frees the event, also where it fails. */
static void emit(struct yaml_out *out, yaml_event_t *event, int made)
{
    if (!made || out->failed) {
        if (made)
            yaml_event_delete(event);
        out->failed = true;
    } else if (!yaml_emitter_emit(&out->emitter, event)) {
        out->failed = true;
    }
}

static void scalar(struct yaml_out *out, const char *text, yaml_scalar_style_t style)
{
    yaml_event_t event;
    int made = yaml_scalar_event_initialize(&event, NULL, NULL, (const yaml_char_t *)text,
                                            (int)strlen(text), 1, 1, style);
    emit(out, &event, made);
}

/* Would a plain scalar read back as something else than text? */
static bool needs_quotes(const char *text)
{
    static const char *const words[] = {"true", "false", "null", "yes", "no",
                                        "on",   "off",   "y",    "n",   "~"};
    if (!*text || strchr("0123456789+-.", text[0]))
        return true;
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        if (strcasecmp(text, words[i]) == 0)
            return true;
    return false;
}

static void put_text(struct yaml_out *out, const char *text)
{
    scalar(out, text, needs_quotes(text) ? YAML_DOUBLE_QUOTED_SCALAR_STYLE : YAML_ANY_SCALAR_STYLE);
}

static void put_key(struct yaml_out *out, const char *key)
{
    assert(!key == !out->is_map[out->depth - 1]);  // members have keys, items have none
    if (key)
        put_text(out, key);
}

static void open_node(struct yaml_out *out, const char *key, bool map, bool flow)
{
    assert(out->depth < DEPTH_MAX);
    if (out->depth > 0)
        put_key(out, key);
    yaml_event_t event;
    int made =
        map ? yaml_mapping_start_event_initialize(
            &event, NULL, NULL, 1, flow ? YAML_FLOW_MAPPING_STYLE : YAML_BLOCK_MAPPING_STYLE)
            : yaml_sequence_start_event_initialize(
                &event, NULL, NULL, 1, flow ? YAML_FLOW_SEQUENCE_STYLE : YAML_BLOCK_SEQUENCE_STYLE);
    emit(out, &event, made);
    out->is_map[out->depth++] = map;
}

void cap_yaml_map(struct yaml_out *out, const char *key)
{
    open_node(out, key, true, false);
}

void cap_yaml_flow_map(struct yaml_out *out, const char *key)
{
    open_node(out, key, true, true);
}

void cap_yaml_list(struct yaml_out *out, const char *key)
{
    open_node(out, key, false, false);
}

void cap_yaml_flow_list(struct yaml_out *out, const char *key)
{
    open_node(out, key, false, true);
}

void cap_yaml_close(struct yaml_out *out)
{
    assert(out->depth > 0);
    yaml_event_t event;
    int made = out->is_map[--out->depth] ? yaml_mapping_end_event_initialize(&event)
                                         : yaml_sequence_end_event_initialize(&event);
    emit(out, &event, made);
}

void cap_yaml_text(struct yaml_out *out, const char *key, const char *value)
{
    put_key(out, key);
    put_text(out, value);
}

void cap_yaml_int(struct yaml_out *out, const char *key, long long value)
{
    char text[32];
    snprintf(text, sizeof text, "%lld", value);
    put_key(out, key);
    scalar(out, text, YAML_PLAIN_SCALAR_STYLE);
}

/* YAML 1.1 readers take 1e+20 for text: a mantissa needs its point. */
static void format_number(char text[40], double value)
{
    if (isnan(value) || isinf(value)) {
        strcpy(text, isnan(value) ? ".nan" : value > 0 ? ".inf" : "-.inf");
        return;
    }
    if (value == trunc(value) && fabs(value) < 1e15) {
        snprintf(text, 40, "%.0f", value);
        return;
    }
    for (int digits = 1; digits <= 17; digits++) {
        snprintf(text, 40, "%.*g", digits, value);
        if (strtod(text, NULL) == value)
            break;
    }
    char *exponent = strchr(text, 'e');
    if (exponent && !strchr(text, '.')) {
        memmove(exponent + 2, exponent, strlen(exponent) + 1);
        memcpy(exponent, ".0", 2);
    }
}

void cap_yaml_number(struct yaml_out *out, const char *key, double value)
{
    char text[40];
    format_number(text, value);
    put_key(out, key);
    scalar(out, text, YAML_PLAIN_SCALAR_STYLE);
}

void cap_yaml_numbers(struct yaml_out *out, const char *key, const double *value, int count)
{
    cap_yaml_flow_list(out, key);
    for (int i = 0; i < count; i++)
        cap_yaml_number(out, NULL, value[i]);
    cap_yaml_close(out);
}

enum status cap_yaml_begin(struct yaml_out **out, const char *path, struct error *err)
{
    struct yaml_out *made = calloc(1, sizeof *made);
    if (!made || !yaml_emitter_initialize(&made->emitter)) {
        free(made);
        return cap_fail(err, STATUS_MEMORY, "%s", path);
    }
    enum status status = cap_file_begin(&made->file, path, true, err);
    if (status) {
        yaml_emitter_delete(&made->emitter);
        free(made);
        return status;
    }
    yaml_emitter_set_output(&made->emitter, write_stream, made);
    yaml_emitter_set_unicode(&made->emitter, 1);
    yaml_emitter_set_width(&made->emitter, 100);
    yaml_event_t event;
    emit(made, &event, yaml_stream_start_event_initialize(&event, YAML_UTF8_ENCODING));
    emit(made, &event, yaml_document_start_event_initialize(&event, NULL, NULL, NULL, 1));
    open_node(made, NULL, true, false);
    *out = made;
    return STATUS_OK;
}

enum status cap_yaml_end(struct yaml_out *out, bool keep, struct error *err)
{
    enum status status = STATUS_OK;
    if (keep) {
        assert(out->depth == 1);
        yaml_event_t event;
        cap_yaml_close(out);
        emit(out, &event, yaml_document_end_event_initialize(&event, 1));
        emit(out, &event, yaml_stream_end_event_initialize(&event));
    }
    if (keep && out->failed) {
        status = cap_fail(err, out->reason ? STATUS_IO : STATUS_MEMORY, "%s: cannot be written: %s",
                          out->file.name,
                          out->reason ? strerror(out->reason) : "the text is not UTF-8, or memory");
    }
    yaml_emitter_delete(&out->emitter);
    if (keep && !status)
        status = cap_file_commit(&out->file, err);
    else
        cap_file_abandon(&out->file);
    free(out);
    return status;
}
