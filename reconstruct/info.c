/* info.c -- what a file of reconstruct/ holds, told by its first bytes and not by its name. */
#include "info.h"

#include "bins_hdf5.h"
#include "formats.h"
#include "quantile.h"

#include <hdf5.h>
#include <jansson.h>
#include <stdlib.h>
#include <string.h>

enum kind { KIND_OTHER, KIND_MERL, KIND_FITS, KIND_BINS, KIND_SAMPLES };

static bool has_dataset(const char *path, const char *name)
{
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);  // the story is ours to tell
    hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    bool there = file >= 0 && H5Lexists(file, name, H5P_DEFAULT) > 0;
    if (file >= 0)
        H5Fclose(file);
    return there;
}

static enum kind kind_of(const char *path)
{
    static const unsigned char hdf5[8] = {0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n'};
    static const int32_t merl[3] = {MERL_THETA_H, MERL_THETA_D, MERL_PHI_D};
    unsigned char start[16] = {0};
    FILE *file = fopen(path, "rb");
    size_t n = file ? fread(start, 1, sizeof start, file) : 0;
    if (file)
        fclose(file);
    if (n >= sizeof hdf5 && memcmp(start, hdf5, sizeof hdf5) == 0)
        return has_dataset(path, "status") ? KIND_BINS : KIND_SAMPLES;
    if (n >= sizeof merl && memcmp(start, merl, sizeof merl) == 0)
        return KIND_MERL;
    return n >= 7 && memcmp(start, "models:", 7) == 0 ? KIND_FITS : KIND_OTHER;
}

static enum status tell_merl(json_t **told, const char *path, struct error *err)
{
    struct merl table = {0};
    enum status status = rec_merl_read(&table, path, err);
    if (status)
        return status;
    int filled = 0, above = 0;
    for (int i = 0; i < MERL_BINS; i++) {
        filled += table.value[i] >= 0;
        above += rec_merl_above(i);
    }
    double albedo[3];
    rec_table_albedo(albedo, &table, 0);
    *told =
        json_pack("{s:s, s:[i, i, i], s:i, s:i, s:[f, f, f]}", "format", "MERL table", "size",
                  MERL_THETA_H, MERL_THETA_D, MERL_PHI_D, "bins_with_values", filled,
                  "bins_above_horizon", above, "albedo_at_normal", albedo[0], albedo[1], albedo[2]);
    rec_merl_free(&table);
    return STATUS_OK;
}

static enum status tell_fits(json_t **told, const char *path, struct error *err)
{
    struct fits fits = {0};
    enum status status = rec_fits_read(&fits, path, err);
    if (status)
        return status;
    json_t *names = json_array();
    for (int i = 0; i < fits.count; i++)
        json_array_append_new(names, json_string(fits.fit[i].model->name));
    *told = json_pack("{s:s, s:s, s:o}", "format", "fits", "best", fits.fit[0].model->name,
                      "models", names);
    rec_fits_free(&fits);
    return STATUS_OK;
}

static enum status tell_bins(json_t **told, const char *path, struct error *err)
{
    struct bins bins = {0};
    enum status status = rec_bins_read(&bins, path, err);
    if (status)
        return status;
    double *relative = malloc((3 * (size_t)bins.count + 1) * sizeof *relative);
    json_int_t photosites = 0;
    int n = 0;
    for (int i = 0; i < bins.count; i++) {
        photosites += bins.bin[i].count;
        for (int c = 0; relative && c < 3; c++)
            if (bins.bin[i].mean[c] > 0)
                relative[n++] = bins.bin[i].sigma[c] / bins.bin[i].mean[c];
    }
    *told = json_pack("{s:s, s:i, s:I, s:o}", "format", "measured bins", "bins", bins.count,
                      "photosites", photosites, "median_relative_stderr",
                      n ? json_real(rec_quantile(relative, n, 0.5)) : json_null());
    free(relative);
    rec_bins_free(&bins);
    return STATUS_OK;
}

static herr_t count_shot(hid_t file, const char *name, const H5L_info_t *link, void *total)
{
    (void)link;
    json_int_t *count = total;
    hid_t group = H5Gopen2(file, name, H5P_DEFAULT);
    hid_t set = group >= 0 ? H5Dopen2(group, "weight", H5P_DEFAULT) : -1;
    hid_t space = set >= 0 ? H5Dget_space(set) : -1;
    if (space >= 0) {
        count[0]++;
        count[1] += H5Sget_simple_extent_npoints(space);
        H5Sclose(space);
    }
    if (set >= 0)
        H5Dclose(set);
    if (group >= 0)
        H5Gclose(group);
    return 0;
}

static enum status tell_samples(json_t **told, const char *path, struct error *err)
{
    json_int_t count[2] = {0, 0};  // shots, samples
    hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    bool ok =
        file >= 0 && H5Literate(file, H5_INDEX_NAME, H5_ITER_INC, NULL, count_shot, count) >= 0;
    if (file >= 0)
        H5Fclose(file);
    if (!ok || count[0] == 0)
        return cap_fail(err, STATUS_FORMAT, "%s: HDF5, but neither bins.h5 nor samples.h5", path);
    *told =
        json_pack("{s:s, s:I, s:I}", "format", "samples", "shots", count[0], "samples", count[1]);
    return STATUS_OK;
}

// A BRDF of another format: that it is read, and what it is.
static enum status tell_brdf(json_t **told, const struct format *format, const char *path,
                             struct error *err)
{
    struct brdf brdf = {0};
    enum status status = format->read(&brdf, path, err);
    if (status)
        return status;
    *told = json_pack("{s:s, s:s*}", "format", format->name, "model",
                      brdf.model ? brdf.model->name : NULL);
    rec_brdf_free(&brdf);
    return STATUS_OK;
}

static void print_lines(json_t *told, FILE *to)
{
    const char *key;
    json_t *value;
    json_object_foreach(told, key, value)
    {
        char *text = json_dumps(value, JSON_ENCODE_ANY | JSON_REAL_PRECISION(6));
        if (text)
            fprintf(to, "%s: %s\n", key, json_is_string(value) ? json_string_value(value) : text);
        free(text);
    }
}

enum status rec_info(const char *path, bool json, FILE *to, struct error *err)
{
    static enum status (*const tell[])(json_t * *told, const char *path, struct error *err) = {
        [KIND_MERL] = tell_merl,
        [KIND_FITS] = tell_fits,
        [KIND_BINS] = tell_bins,
        [KIND_SAMPLES] = tell_samples,
    };
    enum kind kind = kind_of(path);
    const struct format *format = kind == KIND_OTHER ? rec_format_of(path, NULL) : NULL;
    if (kind == KIND_OTHER && !format)
        return cap_info(path, json, to, err);
    json_t *told = NULL;
    enum status status =
        format ? tell_brdf(&told, format, path, err) : tell[kind](&told, path, err);
    if (status)
        return status;
    if (json) {
        json_dumpf(told, to, JSON_REAL_PRECISION(9));
        fputc('\n', to);
    } else {
        print_lines(told, to);
    }
    json_decref(told);
    return STATUS_OK;
}
