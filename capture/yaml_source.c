/* yaml_source.c -- prepare a YAML text for libcyaml, and remember the line of every key.
 *
 * libcyaml knows no union types, so "photos: a_*" has to become "photos: ['a_*']". One pass over
 * libyaml's events finds such nodes, and the text is edited where they stand:
 *
 *     a scalar            a_*          becomes  ['a_*']
 *     a flow mapping      {...}        becomes  [{...}]
 *     a block mapping     key: ...     becomes  - key: ..., its other lines moved right by 2
 *
 * so that no line changes its number. The same pass checks what libcyaml does not: numbers with
 * something after them, and aliases (a glob that was not quoted, most of the time).
 */
#include "yaml_source.h"

#include <errno.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <yaml.h>

enum { DEPTH_MAX = 16, PATH_MAX_LENGTH = 200 };

/* One level of nesting while the events pass by. */
struct level {
    bool map, expects_key, becomes_list, flow;
    int item;         // of a list, from 0
    size_t path_end;  // the container's own path is path[0..path_end)
    size_t start, start_line;
};

/* Insert text at a byte of the source; del bytes there are left out. */
struct edit {
    size_t at, del;
    char *insert;
};

struct walk {
    struct yaml_source *source;
    const struct yaml_rules *rules;
    char *text;  // the file as it is
    size_t size;
    struct level level[DEPTH_MAX];
    int depth;
    char path[PATH_MAX_LENGTH];
    struct edit *edit;
    int edits;
};

static bool in_list(const char *const *list, const char *text)
{
    for (; *list; list++)
        if (strcmp(*list, text) == 0)
            return true;
    return false;
}

/* "tags[3].size" -> "tags[].size" */
static void without_indices(char *generic, const char *path)
{
    for (; *path; path++)
        if (!(*path >= '0' && *path <= '9' && (path[-1] == '[' || strchr("0123456789", path[-1]))))
            *generic++ = *path;
    *generic = '\0';
}

/* libyaml counts characters, we count bytes: UTF-8 continuation bytes start no character. */
static size_t byte_of(const struct walk *walk, size_t character)
{
    size_t byte = 0;
    for (; byte < walk->size; byte++)
        if (((unsigned char)walk->text[byte] & 0xC0) != 0x80 && character-- == 0)
            break;
    return byte;
}

static enum status fail_at(const struct walk *walk, struct error *err, size_t line,
                           const char *what)
{
    return cap_fail(err, STATUS_FORMAT, "%s: line %zu: %s%s%s", walk->source->file, line + 1,
                    walk->path, *walk->path ? ": " : "", what);
}

static enum status add_edit(struct walk *walk, size_t at, size_t del, char *insert,
                            struct error *err)
{
    struct edit *grown = insert ? realloc(walk->edit, (walk->edits + 1) * sizeof *grown) : NULL;
    if (!grown) {
        free(insert);
        return cap_fail(err, STATUS_MEMORY, "%s", walk->source->file);
    }
    walk->edit = grown;
    walk->edit[walk->edits++] = (struct edit){at, del, insert};
    return STATUS_OK;
}

static enum status add_place(struct walk *walk, size_t line, struct error *err)
{
    struct yaml_source *source = walk->source;
    if (yaml_source_line(source, walk->path))
        return fail_at(walk, err, line, "this key stands here for the second time");
    struct yaml_place *grown = realloc(source->place, (size_t)(source->places + 1) * sizeof *grown);
    if (grown)
        source->place = grown;
    char *path = grown ? strdup(walk->path) : NULL;
    if (!path)
        return cap_fail(err, STATUS_MEMORY, "%s", source->file);
    source->place[source->places++] = (struct yaml_place){path, (int)line + 1};
    return STATUS_OK;
}

/* walk->path becomes that of the node that now begins as a value or an item. */
static enum status begin_node(struct walk *walk, size_t line, struct error *err)
{
    struct level *top = walk->depth > 0 ? &walk->level[walk->depth - 1] : NULL;
    if (!top)
        return STATUS_OK;
    if (!top->map) {
        snprintf(walk->path + top->path_end, sizeof walk->path - top->path_end, "[%d]",
                 top->item++);
        return add_place(walk, line, err);
    }
    top->expects_key = true;
    return STATUS_OK;
}

static enum status take_key(struct walk *walk, const char *key, size_t line, struct error *err)
{
    struct level *top = &walk->level[walk->depth - 1];
    size_t room = sizeof walk->path - top->path_end;
    int length = snprintf(walk->path + top->path_end, room, "%s%s", top->path_end ? "." : "", key);
    top->expects_key = false;
    if ((size_t)length >= room)
        return fail_at(walk, err, line, "this key is too long");
    return add_place(walk, line, err);
}

/* In single quotes, as an item of a list. A text over several lines keeps their number. */
static char *quoted_item(const char *value, size_t lines)
{
    char *made = malloc(2 * strlen(value) + lines + 5), *to = made;
    if (!made)
        return NULL;
    *to++ = '[';
    *to++ = '\'';
    for (; *value; value++) {
        if (*value == '\'')
            *to++ = '\'';
        *to++ = *value;
    }
    *to++ = '\'';
    memset(to, '\n', lines);
    to += lines;
    strcpy(to, "]");
    return made;
}

static void check_number(struct walk *walk, const char *generic, const char *text, size_t line)
{
    char *end;
    bool whole = in_list(walk->rules->whole, generic), good;
    if (whole) {
        errno = 0;
        long number = strtol(text, &end, 10);
        good = end != text && !*end && !errno && number == (int)number;
    } else {
        double number = strtod(text, &end);
        good = end != text && !*end && isfinite(number);
    }
    struct error *odd = &walk->source->odd;
    if (!good && !odd->status)
        fail_at(walk, odd, line,
                whole ? "this has to be a whole number" : "this has to be a number");
}

static enum status take_scalar(struct walk *walk, const yaml_event_t *event, struct error *err)
{
    const char *text = (const char *)event->data.scalar.value;
    size_t line = event->start_mark.line;
    struct level *top = walk->depth > 0 ? &walk->level[walk->depth - 1] : NULL;
    if (top && top->map && top->expects_key)
        return take_key(walk, text, line, err);
    enum status status = begin_node(walk, line, err);
    char generic[PATH_MAX_LENGTH];
    without_indices(generic, walk->path);
    if (!status && in_list(walk->rules->lists, generic)) {
        size_t from = byte_of(walk, event->start_mark.index);
        size_t to = byte_of(walk, event->end_mark.index);
        return add_edit(walk, from, to - from, quoted_item(text, event->end_mark.line - line), err);
    }
    size_t length = strlen(generic);
    if (length > 2 && strcmp(generic + length - 2, "[]") == 0)
        generic[length - 2] = '\0';  // an item has the type of its list
    if (!status && !in_list(walk->rules->texts, generic))
        check_number(walk, generic, text, line);
    return status;
}

static enum status open_container(struct walk *walk, const yaml_event_t *event, struct error *err)
{
    bool map = event->type == YAML_MAPPING_START_EVENT;
    size_t line = event->start_mark.line;
    struct level *top = walk->depth > 0 ? &walk->level[walk->depth - 1] : NULL;
    if (top && top->map && top->expects_key)
        return fail_at(walk, err, line, "a key has to be text");
    enum status status = begin_node(walk, line, err);
    if (status)
        return status;
    if (walk->depth == DEPTH_MAX)
        return fail_at(walk, err, line, "nested too deeply");
    char generic[PATH_MAX_LENGTH];
    without_indices(generic, walk->path);
    size_t length = strlen(walk->path);
    bool becomes_list = map && in_list(walk->rules->lists, generic);
    if (becomes_list) {  // its keys are then those of an item
        snprintf(walk->path + length, sizeof walk->path - length, "[0]");
        status = add_place(walk, line, err);
    }
    walk->level[walk->depth++] = (struct level){
        .map = map,
        .expects_key = map,
        .becomes_list = becomes_list,
        .flow = map && event->data.mapping_start.style == YAML_FLOW_MAPPING_STYLE,
        .path_end = strlen(walk->path),
        .start = byte_of(walk, event->start_mark.index),
        .start_line = line,
    };
    return status;
}

/* Move lines first..last (from 0) right by 2. */
static enum status indent_lines(struct walk *walk, size_t first, size_t last, struct error *err)
{
    size_t line = 0;
    enum status status = STATUS_OK;
    for (size_t i = 0; i < walk->size && line <= last && !status; i++) {
        if ((i == 0 || walk->text[i - 1] == '\n') && line >= first)
            status = add_edit(walk, i, 0, strdup("  "), err);
        line += walk->text[i] == '\n';
    }
    return status;
}

static enum status close_container(struct walk *walk, const yaml_event_t *event, struct error *err)
{
    const struct level *top = &walk->level[--walk->depth];
    walk->path[top->path_end] = '\0';
    if (!top->becomes_list)
        return STATUS_OK;
    enum status status = add_edit(walk, top->start, 0, strdup(top->flow ? "[" : "- "), err);
    if (!status && top->flow)
        return add_edit(walk, byte_of(walk, event->end_mark.index), 0, strdup("]"), err);
    // A block mapping ends where the next key begins, or at the end of the text.
    if (!status && event->end_mark.line > top->start_line + 1)
        status = indent_lines(walk, top->start_line + 1, event->end_mark.line - 1, err);
    return status;
}

static enum status take_event(struct walk *walk, const yaml_event_t *event, struct error *err)
{
    switch (event->type) {
    case YAML_ALIAS_EVENT:
        return fail_at(walk, err, event->start_mark.line,
                       "an alias (*name) is not understood here; put quotes around a glob");
    case YAML_SCALAR_EVENT:
        return take_scalar(walk, event, err);
    case YAML_MAPPING_START_EVENT:
    case YAML_SEQUENCE_START_EVENT:
        return open_container(walk, event, err);
    case YAML_MAPPING_END_EVENT:
    case YAML_SEQUENCE_END_EVENT:
        return close_container(walk, event, err);
    default:
        return STATUS_OK;
    }
}

static enum status walk_events(struct walk *walk, struct error *err)
{
    yaml_parser_t parser;
    if (!yaml_parser_initialize(&parser))
        return cap_fail(err, STATUS_MEMORY, "%s", walk->source->file);
    yaml_parser_set_input_string(&parser, (const unsigned char *)walk->text, walk->size);
    enum status status = STATUS_OK;
    bool ended = false;
    while (!status && !ended) {
        yaml_event_t event;
        if (!yaml_parser_parse(&parser, &event)) {
            walk->path[0] = '\0';
            status = fail_at(walk, err, parser.problem_mark.line, parser.problem);
        } else {
            status = take_event(walk, &event, err);
            ended = event.type == YAML_STREAM_END_EVENT;
            yaml_event_delete(&event);
        }
    }
    yaml_parser_delete(&parser);
    return status;
}

static int by_place(const void *a, const void *b)
{
    size_t x = ((const struct edit *)a)->at, y = ((const struct edit *)b)->at;
    return (x > y) - (x < y);
}

static enum status apply_edits(struct walk *walk, struct error *err)
{
    size_t size = walk->size;
    for (int i = 0; i < walk->edits; i++)
        size += strlen(walk->edit[i].insert);
    char *made = malloc(size + 1), *to = made;
    if (!made)
        return cap_fail(err, STATUS_MEMORY, "%s", walk->source->file);
    if (walk->edits > 0)
        qsort(walk->edit, (size_t)walk->edits, sizeof *walk->edit, by_place);
    size_t from = 0;
    for (int i = 0; i < walk->edits; i++) {
        const struct edit *edit = &walk->edit[i];
        to = mempcpy(to, walk->text + from, edit->at - from);
        to = mempcpy(to, edit->insert, strlen(edit->insert));
        from = edit->at + edit->del;
    }
    to = mempcpy(to, walk->text + from, walk->size - from);
    *to = '\0';
    walk->source->text = made;
    walk->source->size = (size_t)(to - made);
    return STATUS_OK;
}

static enum status read_text(struct walk *walk, const char *file, struct error *err)
{
    enum { SIZE_MAX_BYTES = 16 << 20 };  // a capture.yaml is some kilobytes
    FILE *stream = fopen(file, "rb");
    if (!stream)
        return cap_fail(err, STATUS_IO, "%s: %s", file, strerror(errno));
    enum status status = STATUS_OK;
    walk->text = malloc(SIZE_MAX_BYTES);
    if (walk->text)
        walk->size = fread(walk->text, 1, SIZE_MAX_BYTES, stream);
    if (!walk->text)
        status = cap_fail(err, STATUS_MEMORY, "%s", file);
    else if (ferror(stream))
        status = cap_fail(err, STATUS_IO, "%s: %s", file, strerror(errno));
    else if (walk->size == SIZE_MAX_BYTES)
        status = cap_fail(err, STATUS_FORMAT, "%s: too large for a capture.yaml", file);
    fclose(stream);
    return status;
}

enum status yaml_source_read(struct yaml_source *source, const char *file,
                             const struct yaml_rules *rules, struct error *err)
{
    struct yaml_source made = {.file = strdup(file)};
    struct walk walk = {.source = &made, .rules = rules};
    enum status status =
        made.file ? read_text(&walk, file, err) : cap_fail(err, STATUS_MEMORY, "%s", file);
    if (!status)
        status = walk_events(&walk, err);
    if (!status)
        status = apply_edits(&walk, err);
    if (!status) {
        *source = made;
        made = (struct yaml_source){0};  // the caller's now
    }
    for (int i = 0; i < walk.edits; i++)
        free(walk.edit[i].insert);
    free(walk.edit);
    free(walk.text);
    yaml_source_free(&made);
    return status;
}

void yaml_source_free(struct yaml_source *source)
{
    for (int i = 0; i < source->places; i++)
        free(source->place[i].path);
    free(source->place);
    free(source->file);
    free(source->text);
    *source = (struct yaml_source){0};
}

int yaml_source_line(const struct yaml_source *source, const char *path)
{
    for (int i = 0; i < source->places; i++)
        if (strcmp(source->place[i].path, path) == 0)
            return source->place[i].line;
    return 0;
}

enum status yaml_source_fail(const struct yaml_source *source, struct error *err, const char *path,
                             const char *format, ...)
{
    char story[400], around[PATH_MAX_LENGTH];
    va_list args;
    va_start(args, format);
    vsnprintf(story, sizeof story, format, args);
    va_end(args);
    snprintf(around, sizeof around, "%s", path);
    int line = 0;
    while (*around && !(line = yaml_source_line(source, around))) {
        size_t end = strlen(around);
        while (end > 0 && around[end - 1] != '.' && around[end - 1] != '[')
            end--;
        around[end > 0 ? end - 1 : 0] = '\0';
    }
    return cap_fail(err, STATUS_FORMAT, "%s: line %d: %s: %s", source->file, line ? line : 1, path,
                    story);
}
