/* doc.h -- a YAML document, read key by key.
 *
 * A getter says what it wants of a key: its kind, its range and what stands in its place. The first
 * wrong value is kept as the error (file, line, key) and getters then return their fallback, so a
 * reader runs straight through and asks once at the end. Keys nobody asked for are errors.
 *
 * This is on libyaml's document and not on libcyaml, because a scene needs what a fixed schema has
 * not: values that stand for missing keys, lists of things of different kinds, and the parameters
 * of a reflectance model, whose names are known at run time only.
 */
#ifndef GONIOCAM_SAMPLES_DOC_H
#define GONIOCAM_SAMPLES_DOC_H

#include "capture.h"

struct doc;
/** A place in a document: the number of a node, 0 for what is not there. Getters of a place that
 *  is not there return fallbacks. */
typedef int doc_node;

/** On success the caller owns *doc; end with sam_doc_close. STATUS_IO, STATUS_FORMAT. */
enum status sam_doc_open(struct doc **doc, const char *path, struct error *err);
/** The verdict: the first error, or the first key that nobody asked for. Frees *doc. */
enum status sam_doc_close(struct doc *doc, struct error *err);
/** Has nothing been wrong so far? */
bool sam_doc_fine(const struct doc *doc);
/** Tell that a value is wrong: "file:line: key: story". Only the first one is kept. */
void sam_doc_wrong(struct doc *doc, doc_node node, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/** The path of a file that the document names, from the document's folder; free() it. NULL: out of
 *  memory. */
char *sam_doc_beside(const struct doc *doc, const char *file);

doc_node sam_doc_root(const struct doc *doc);
/** The value of a key of a mapping; 0 when it is not there. */
doc_node sam_doc_get(struct doc *doc, doc_node map, const char *key);
/** The same, for a key that must be there. */
doc_node sam_doc_need(struct doc *doc, doc_node map, const char *key);
/** How many items a list has; 0 for what is not there. */
int sam_doc_count(struct doc *doc, doc_node list);
doc_node sam_doc_item(struct doc *doc, doc_node list, int i);
bool sam_doc_is_list(const struct doc *doc, doc_node node);

/** A number in [low, high]. A fallback of NAN means that the key must be there. */
double sam_doc_number(struct doc *doc, doc_node map, const char *key, double fallback, double low,
                      double high);
int sam_doc_int(struct doc *doc, doc_node map, const char *key, int fallback, int low, int high);
bool sam_doc_bool(struct doc *doc, doc_node map, const char *key, bool fallback);
/** A text, owned by the document. A NULL fallback means that the key must be there (then ""). */
const char *sam_doc_text(struct doc *doc, doc_node map, const char *key, const char *fallback);
/** A list of exactly `count` numbers in [low, high]; one number stands for `count` equal ones when
 *  `spread`. *value stays as it is when the key is not there. */
void sam_doc_numbers(struct doc *doc, doc_node map, const char *key, double *value, int count,
                     bool spread, double low, double high);
/** A point or direction, finite. */
vec3 sam_doc_vec3(struct doc *doc, doc_node map, const char *key, vec3 fallback);
/** The same for a node that is a list of three numbers itself. */
vec3 sam_doc_as_vec3(struct doc *doc, doc_node node);
#endif
