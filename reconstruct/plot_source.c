/* plot_source.c -- what plots are made of, from the files of OUT. */
#include "bins_hdf5.h"
#include "plot.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static enum status read_bins(struct plot_source *s, const char *path, struct error *err)
{
    s->status = malloc(MERL_BINS);
    s->bin_at = malloc(MERL_BINS * sizeof *s->bin_at);
    if (!s->status || !s->bin_at)
        return cap_fail(err, STATUS_MEMORY, "%s: no memory for its bins", path);
    enum status status = rec_bins_read(&s->bins, path, err);
    if (!status)
        status = rec_bins_read_status(s->status, path, err);
    if (status)
        return status;
    memset(s->bin_at, -1, MERL_BINS * sizeof *s->bin_at);
    for (int i = 0; i < s->bins.count; i++)
        s->bin_at[s->bins.bin[i].index] = i;
    return STATUS_OK;
}

// What lies in OUT besides the table is read where it is there.
static enum status read_beside(struct plot_source *s, const char *out, struct error *err)
{
    char *bins = cap_path(out, "bins.h5"), *fits = cap_path(out, "fits.yaml");
    enum status status =
        bins && fits ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%s: no memory", out);
    if (!status && access(bins, F_OK) == 0)
        status = read_bins(s, bins, err);
    if (!status && access(fits, F_OK) == 0)
        status = rec_fits_read(&s->fits, fits, err);
    free(bins);
    free(fits);
    return status;
}

// "a/b/" -> "b"
static char *last_part(const char *path)
{
    size_t end = strlen(path);
    while (end > 1 && path[end - 1] == '/')
        end--;
    size_t begin = end;
    while (begin > 0 && path[begin - 1] != '/')
        begin--;
    return strndup(path + begin, end - begin);
}

enum status rec_plot_source_read(struct plot_source *source, const char *path, struct error *err)
{
    struct plot_source s = {.name = last_part(path)};
    struct stat info;
    enum status status = s.name ? rec_brdf_read(&s.brdf, path, err)
                                : cap_fail(err, STATUS_MEMORY, "%s: no memory", path);
    if (!status && stat(path, &info) == 0 && S_ISDIR(info.st_mode))
        status = read_beside(&s, path, err);
    if (status)
        rec_plot_source_free(&s);
    else
        *source = s;
    return status;
}

void rec_plot_source_free(struct plot_source *source)
{
    free(source->name);
    rec_brdf_free(&source->brdf);
    rec_bins_free(&source->bins);
    rec_fits_free(&source->fits);
    free(source->bin_at);
    free(source->status);
    *source = (struct plot_source){0};
}

struct brdf rec_plot_fit(const struct plot_source *source, int k)
{
    struct brdf brdf = {.model = source->fits.fit[k].model};
    memcpy(brdf.value, source->fits.fit[k].value, sizeof brdf.value);
    return brdf;
}
