/* formats.c -- the table of formats, and the file that one call reads whichever it is. A new format
 * is a file and a line here. */
#include "formats.h"

#include <ctype.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* ---- formats of our own -----------------------------------------------------------------------
 */

static bool merl_probe(const char *start, size_t size)
{
    static const int32_t n[3] = {MERL_THETA_H, MERL_THETA_D, MERL_PHI_D};
    return size >= sizeof n && memcmp(start, n, sizeof n) == 0;
}

static enum status merl_read(struct brdf *brdf, const char *path, struct error *err)
{
    struct brdf read = {0};
    enum status status = rec_merl_read(&read.table, path, err);
    if (!status)
        status = rec_brdf_prepare(&read, err);
    if (status)
        rec_brdf_free(&read);
    else
        *brdf = read;
    return status;
}

static bool fits_probe(const char *start, size_t size)
{
    (void)size;
    for (const char *line = start; *line; line += strcspn(line, "\n"), line += *line == '\n')
        if (strncmp(line, "models:", 7) == 0)
            return true;
    return false;
}

static enum status fits_read(struct brdf *brdf, const char *path, struct error *err)
{
    struct fits fits = {0};
    enum status status = rec_fits_read(&fits, path, err);
    if (!status) {
        *brdf = (struct brdf){.model = fits.fit[0].model};
        memcpy(brdf->value, fits.fit[0].value, sizeof brdf->value);
    }
    rec_fits_free(&fits);
    return status;
}

const struct format rec_format_merl = {"MERL table", merl_probe, merl_read};
const struct format rec_format_fits = {"fits", fits_probe, fits_read};

/* ---- all of them ------------------------------------------------------------------------------
 */

// The first that knows a file takes it: MIT's header is stricter than MERL's three numbers.
static const struct format *const formats[] = {
    &rec_format_rgl,       &rec_format_mit,     &rec_format_merl,    &rec_format_fits,
    &rec_format_published, &rec_format_cornell, &rec_format_samples,
};

const char *rec_path_mark(const char *path)
{
    struct stat info;
    return stat(path, &info) == 0 ? NULL : strrchr(path, '#');
}

// The first bytes of a file, with a zero after them. false: it cannot be read, and errno says why.
static bool read_start(char start[FORMAT_START + 1], size_t *size, const char *path)
{
    FILE *file = fopen(path, "rb");
    *size = file ? fread(start, 1, FORMAT_START, file) : 0;
    bool ok = file && !ferror(file);
    start[*size] = '\0';
    if (file)
        fclose(file);
    return ok;
}

const struct format *rec_format_of(const char *path, struct error *err)
{
    char start[FORMAT_START + 1];
    size_t size;
    const char *mark = rec_path_mark(path);
    char *file = mark ? strndup(path, (size_t)(mark - path)) : strdup(path);
    bool ok = file && read_start(start, &size, file);
    int why = errno;
    free(file);
    if (!ok) {
        cap_fail(err, STATUS_IO, "%s: %s", path, strerror(why));
        return NULL;
    }
    for (size_t i = 0; i < sizeof formats / sizeof *formats; i++)
        if (formats[i]->probe(start, size))
            return formats[i];
    cap_fail(err, STATUS_FORMAT,
             "%s: no BRDF that is known: neither a table (MERL, RGL, MIT, text) nor fits.yaml nor "
             "parameters",
             path);
    return NULL;
}

static bool is_folder(const char *path)
{
    struct stat info;
    return stat(path, &info) == 0 && S_ISDIR(info.st_mode);
}

enum status rec_brdf_read(struct brdf *brdf, const char *path, struct error *err)
{
    struct error own;
    struct error *told = err ? err : &own;
    if (is_folder(path)) {
        char *table = cap_path(path, "brdf.binary");
        enum status status = table ? merl_read(brdf, table, err)
                                   : cap_fail(err, STATUS_MEMORY, "%s: no memory", path);
        free(table);
        return status;
    }
    const struct format *format = rec_format_of(path, told);
    return format ? format->read(brdf, path, err) : told->status;
}
