/* export.h -- a BRDF in other programs' formats. */
#ifndef GONIOCAM_EXPORT_H
#define GONIOCAM_EXPORT_H

#include "reconstruct.h"

/** What is exported: a BRDF, and the path it was read from. */
struct exported {
    const struct brdf *brdf;
    const char *source;
};
/** One format, in the table of export.c. */
struct exporter {
    const char *name, *ending, *help;
    /** Write file `path`, complete or not at all. */
    enum status (*write)(const struct exported *what, const char *path, struct run *run,
                         struct error *err);
};
extern const struct exporter rec_exporters[];  // ends with {0}
/** By name; NULL: there is none. */
const struct exporter *rec_exporter_find(const char *name);

/** Text under construction, complete or not at all. `fill` writes it to `to`. */
enum status rec_text_write(const char *path, void (*fill)(FILE *to, const void *data),
                           const void *data, struct error *err);

// The writers, each in the file of its name.
enum status rec_mitsuba_write(const struct exported *, const char *, struct run *, struct error *);
enum status rec_pbrt_write(const struct exported *, const char *, struct run *, struct error *);
enum status rec_materialx_write(const struct exported *, const char *, struct run *,
                                struct error *);
enum status rec_gltf_write(const struct exported *, const char *, struct run *, struct error *);
enum status rec_exr_write(const struct exported *, const char *, struct run *, struct error *);
enum status rec_csv_write(const struct exported *, const char *, struct run *, struct error *);
enum status rec_json_write(const struct exported *, const char *, struct run *, struct error *);
#endif
