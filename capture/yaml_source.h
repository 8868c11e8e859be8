/* yaml_source.h -- the text of capture.yaml, prepared for libcyaml, with the line of every key. */
#ifndef GONIOCAM_YAML_SOURCE_H
#define GONIOCAM_YAML_SOURCE_H

#include "capture.h"

/** Where a node stands: path is "board.tags[3].size". */
struct yaml_place {
    char *path;
    int line;  // from 1
};

/** A YAML text in which every node that may be one thing or a list of them is a list, so that a
 *  schema without union types can describe it. Lines keep their numbers. Owns all; {0} is empty. */
struct yaml_source {
    char *file;  // for messages
    char *text;
    size_t size;
    struct yaml_place *place;  // [places]
    int places;
    struct error odd;  // the first scalar that is no number and no known text; or it is under an
                       // unknown key, which the schema then finds: that is the better story
};

/** Read a file. Nodes whose path without indices ("lights[].photos") is in lists[] (ends with
 *  NULL) become lists; the last key of texts[] paths may be any text, and of whole[] paths must be
 *  a whole number; all other scalars must be numbers, to their last character (see odd).
 *  STATUS_IO; STATUS_FORMAT with file, line and key: broken YAML, a key twice, an alias. */
struct yaml_rules {
    const char *const *lists, *const *texts, *const *whole;
};
enum status yaml_source_read(struct yaml_source *source, const char *file,
                             const struct yaml_rules *rules, struct error *err);
void yaml_source_free(struct yaml_source *source);
/** The line of a node; 0: it is not there. */
int yaml_source_line(const struct yaml_source *source, const char *path);
/** STATUS_FORMAT with "FILE: line N: PATH: ..." before the story. The line is that of the node or
 *  of the nearest one around it. */
enum status yaml_source_fail(const struct yaml_source *source, struct error *err, const char *path,
                             const char *format, ...) __attribute__((format(printf, 4, 5)));
#endif
